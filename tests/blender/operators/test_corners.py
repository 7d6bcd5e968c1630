# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as people have them: charts, materials, hard edges, split vertices, borders, parts."""

import bpy
import numpy as np
import pytest
import scenes


def mesh_of(points, faces, name="mesh"):
    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(points).tolist(), [], np.asarray(faces).tolist())
    return scenes.link(data, name)


def grid_of(size, x0=0.0):
    """Return points and quads of a flat grid of unit squares."""
    x, y = np.meshgrid(np.arange(size + 1.0), np.arange(size + 1.0), indexing="ij")
    number = np.arange((size + 1) ** 2).reshape(size + 1, size + 1)
    quads = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    points = np.column_stack([x.ravel() + x0, y.ravel(), np.zeros(x.size)])
    return points, np.stack([q.ravel() for q in quads], axis=1)


def simplified(obj, **options):
    assert bpy.ops.object.salient_simplify(
        **{"hide_source": False, "placement": "original"} | options
    ) == {"FINISHED"}
    return bpy.data.objects[obj.name + "_simplified"]


def triangles(obj):
    """Return points (t, 3, 3), corner numbers (t, 3) and polygons (t,) of an object's triangles."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    corners = np.array([t.loops[:] for t in mesh.loop_triangles])
    polygon = np.array([t.polygon_index for t in mesh.loop_triangles])
    vertex = np.array([loop.vertex_index for loop in mesh.loops])
    return scenes.positions(obj).astype(float)[vertex[corners]], corners, polygon


def figures():
    return bpy.context.window_manager.salient_simplify


def test_borders_between_materials_stay():
    points, quads = grid_of(60)
    middle = points[quads].mean(axis=1)
    red = middle[:, 1] > 30 + 12 * np.sin(9 * middle[:, 0] / 60)
    obj = mesh_of(points, quads)
    for name in ("red", "blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    obj.data.polygons.foreach_set("material_index", (~red).astype(np.int32))
    for ratio in (0.2, 0.05):
        check_materials(simplified(obj, ratio=ratio, measure=False), red)


def check_materials(result, red):
    """Check that every triangle has the colour that was there, and remove the result."""
    place, _, polygon = triangles(result)
    slot = np.array([p.material_index for p in result.data.polygons])[polygon]
    area = 0.5 * np.linalg.norm(
        np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1
    )
    # The colour that was there is looked up at points spread over each triangle.
    share = np.random.default_rng(1).dirichlet([1, 1, 1], 200)
    spots = np.einsum("sk,tkd->tsd", share, place)[:, :, :2].clip(0, 59.999)
    cell = spots.astype(int)
    was_red = red.reshape(60, 60)[cell[..., 0], cell[..., 1]]
    wrong = (was_red != (slot == 0)[:, None]).mean(axis=1)
    assert (wrong * area).sum() <= 0.01 * area.sum()
    bpy.data.objects.remove(result)


def block(cuts=8):
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.active_object
    scenes.select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=cuts)
    bpy.ops.mesh.remove_doubles()
    bpy.ops.object.mode_set(mode="OBJECT")
    return obj


def test_hard_edges_told_by_normals_keep_both_sides():
    obj = block()
    while obj.data.uv_layers:
        obj.data.uv_layers.remove(obj.data.uv_layers[0])
    flat = [tuple(p.normal) for p in obj.data.polygons for _ in p.loop_indices]
    obj.data.normals_split_custom_set(flat)
    assert obj.data.has_custom_normals
    for ratio in (0.5, 0.1, 0.03):
        check_normals(simplified(obj, ratio=ratio, measure=False, keep_sharp=False))


def check_normals(result):
    """Check that faces are shaded flat, and remove the result."""
    place, corners, _ = triangles(result)
    normal = np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    stored = np.empty(3 * len(result.data.loops), dtype="f4")
    result.data.corner_normals.foreach_get("vector", stored)
    cosine = (stored.reshape(-1, 3)[corners] * normal[:, None]).sum(axis=2)
    assert cosine.min() > np.cos(np.radians(20))
    assert result.data.has_custom_normals
    bpy.data.objects.remove(result)


def torn_torus(n=60):
    """Return a bumpy torus whose vertices are split along the seams of its texture."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    a, b = 2 * np.pi * (i % n) / n, 2 * np.pi * (j % n) / n
    ring = 2 + np.cos(b)
    bumps = np.sin(b) + 0.15 * np.sin(9 * a) * np.cos(5 * b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), bumps], axis=-1).reshape(-1, 3)
    _, quads = grid_of(n)
    obj = mesh_of(points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), "torus")
    layer = obj.data.uv_layers.new(name="UVMap")
    texture = np.column_stack([i.ravel(), j.ravel()]) / n
    vertex = [loop.vertex_index for loop in obj.data.loops]
    layer.uv.foreach_set("vector", texture[vertex].astype("f4").ravel())
    scenes.select(obj)
    return obj


@pytest.mark.parametrize("split", [False, True])
def test_no_triangle_reaches_across_a_chart(split):
    obj = torn_torus()
    if not split:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.remove_doubles(threshold=1e-5)
        bpy.ops.object.mode_set(mode="OBJECT")
        assert len(obj.data.vertices) == 3600
    for ratio in (0.5, 0.1, 0.02):
        result = simplified(obj, ratio=ratio, measure=False)
        check_charts(result)
        if split:
            places = len(np.unique(scenes.positions(result), axis=0))
            assert places == round(ratio * 3600)
        bpy.data.objects.remove(result)


def check_charts(result):
    """Check that every corner has its place's texture, and no triangle two charts."""
    place, corners, _ = triangles(result)
    uv = np.array([item.vector[:] for item in result.data.uv_layers[0].uv])[corners]
    area = 0.5 * np.linalg.norm(
        np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]), axis=1
    )
    a, b = 2 * np.pi * uv[..., 0], 2 * np.pi * uv[..., 1]
    ring = 2 + np.cos(b)
    bumps = np.sin(b) + 0.15 * np.sin(9 * a) * np.cos(5 * b)
    there = np.stack([ring * np.cos(a), ring * np.sin(a), bumps], axis=-1)
    np.testing.assert_allclose(there, place, atol=1e-4)  # every corner has its place's texture
    torn = np.ptp(uv, axis=1).max(axis=1) > 0.6
    assert area[torn].sum() <= 0.001 * area.sum()
    used = np.unique(np.array([loop.vertex_index for loop in result.data.loops]))
    assert len(used) == len(result.data.vertices)  # no copy is loose


def test_a_colour_of_points_tells_split_vertices_apart():
    obj = torn_torus()
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    color = obj.data.attributes.new("Col", "FLOAT_COLOR", "POINT")
    index = np.arange(61 * 61)
    ramp = np.column_stack([index // 61 / 60, index % 61 / 60, 0 * index, 0 * index + 1])
    color.data.foreach_set("color", ramp.astype("f4").ravel())
    result = simplified(obj, ratio=0.1, measure=False)
    vertex = np.array([loop.vertex_index for loop in result.data.loops]).reshape(-1, 3)
    values = np.array([item.color[:2] for item in result.data.attributes["Col"].data])[vertex]
    assert (np.ptp(values, axis=1).max(axis=1) < 0.6).all()


def test_tiles_still_meet_with_keep_border():
    tiles = []
    for k in range(2):
        points, quads = grid_of(24, 24.0 * k)
        points[:, 2] = 2 * np.sin(points[:, 0] / 3) * np.cos(points[:, 1] / 4)
        tiles.append(mesh_of(points, quads, f"tile{k}"))
    scenes.select(*tiles)
    assert bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.3, keep_border=True
    ) == {"FINISHED"}
    for tile in tiles:
        before, after = (
            scenes.positions(tile),
            scenes.positions(bpy.data.objects[tile.name + "_simplified"]),
        )
        border = (before[:, :2] % 24 == 0).any(axis=1)
        assert border.sum() == 96
        left = {tuple(row) for row in after.tolist()}
        assert {tuple(row) for row in before[border].tolist()} <= left
        assert len(after) == round(0.3 * len(before))


def test_a_target_in_triangles():
    obj = block(12)
    for wanted in (300, 77):
        result = simplified(obj, target="FACES", faces=wanted)
        found = len(triangles(result)[0])
        assert wanted - 2 <= found <= wanted
        assert figures().faces_after == found
        assert figures().faces_before == len(triangles(obj)[0])
        bpy.data.objects.remove(result)


def leaves(count=60):
    """Return a block, and so many small leaves of two triangles round it."""
    obj = block(4)
    points, faces = scenes.positions(obj).astype(float), [p.vertices[:] for p in obj.data.polygons]
    bpy.data.objects.remove(obj)
    rng = np.random.default_rng(5)
    for _ in range(count):
        start = len(points)
        leaf = (
            5 + rng.random(3) * 10 + np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])
        )
        points = np.concatenate([points, leaf])
        faces.append((start, start + 1, start + 2, start + 3))
    data = bpy.data.meshes.new("tree")
    data.from_pydata(points.tolist(), [], faces)
    return scenes.link(data, "tree")


def reports(capfd, call):
    """Return the warnings that a call reports."""
    capfd.readouterr()
    assert call() == {"FINISHED"}
    out = capfd.readouterr().out
    return [
        line.removeprefix("Warning: ") for line in out.splitlines() if line.startswith("Warning: ")
    ]


def test_what_had_to_be_given_up_is_a_warning(capfd):
    obj = leaves()
    told = reports(
        capfd,
        lambda: bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.1),
    )
    assert told
    assert all(line.startswith(f"{obj.name}: ") for line in told)
    assert any("parts" in line for line in told)
    assert figures().notes == "\n".join(told)
    bpy.data.objects.remove(bpy.data.objects["tree_simplified"])
    told = reports(
        capfd,
        lambda: bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=0.1, keep_topology=True
        ),
    )
    assert len(bpy.data.objects["tree_simplified"].data.vertices) > 0.3 * len(obj.data.vertices)
    assert told


def test_alpha_on_a_mesh_and_too_few_points_are_said(capfd):
    block()
    told = reports(
        capfd,
        lambda: bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", target="ALPHA", alpha=5.0
        ),
    )
    assert any("gives points, and no faces" in line for line in told)
    told = reports(
        capfd,
        lambda: bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", target="COUNT", count=2
        ),
    )
    assert any("No face is left" in line or "face" in line for line in told)
    told = reports(
        capfd,
        lambda: bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", target="COUNT", count=10**6
        ),
    )
    assert any("fewer than asked for" in line for line in told)


def test_measuring_can_be_left_out():
    block()
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.1, measure=False
    )
    assert not figures().measured
    assert figures().points_after > 0


def test_one_bad_object_does_not_spoil_a_selection(capfd):
    good, small = scenes.torus(), scenes.points_mesh(scenes.relief(40))
    empty = scenes.link(bpy.data.meshes.new("empty"), "empty")
    broken = scenes.points_mesh(np.full((30, 3), np.nan))
    broken.name = "broken"
    scenes.select(good, small, empty, broken)
    told = reports(
        capfd,
        lambda: bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", target="COUNT", count=100
        ),
    )
    assert any(line.startswith("empty is left out: has no points") for line in told)
    assert any(line.startswith("broken is left out: ") for line in told)
    made = {obj.name: len(obj.data.vertices) for obj in bpy.data.objects if "_simpl" in obj.name}
    assert made == {"Torus_simplified": 100, "points_simplified": 40}
    scenes.select(empty)
    with pytest.raises(RuntimeError, match="empty: has no points"):
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", target="COUNT", count=100
        )


def test_a_scale_of_0_is_refused():
    obj = scenes.torus()
    obj.scale = (1.0, 0.0, 1.0)
    for call in (bpy.ops.object.salient_simplify, bpy.ops.object.salient_show_saliency):
        with pytest.raises(RuntimeError, match="Torus: its scale is 0 along an axis"):
            call()
    assert len(bpy.data.objects) == 1


@pytest.mark.parametrize(("offset", "said"), [(0.0, False), (5e5, True), (-5e5, True)])
def test_coordinates_that_single_precision_cannot_hold_are_said(capfd, offset, said):
    points = scenes.relief(2000)
    points[:, 0] += offset
    scenes.points_mesh(points)
    told = reports(capfd, lambda: bpy.ops.object.salient_simplify(ratio=0.5))
    assert any("in steps of 0.0312" in line for line in told) == said
    assert said or not told


@pytest.mark.parametrize("kind", ["mesh", "points", "cloud"])
def test_colours_of_points_count_on_a_flat_sheet(kind):
    points, quads = grid_of(40)
    obj = mesh_of(points, quads) if kind == "mesh" else None
    if obj is None:
        obj = {"points": scenes.points_mesh, "cloud": scenes.cloud}[kind](points)
    red = (points[:, 0] - 20) ** 2 + (points[:, 1] - 20) ** 2 < 150
    rgba = np.where(red[:, None], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]).astype("f4")
    was_red = {tuple(row): value for row, value in zip(points.tolist(), red, strict=True)}

    def wrong():
        """Return the share of points whose nearest kept one has the other colour."""
        options = {"attribute_weight": 1.0, "measure": False, "hide_source": False}
        result = simplified(obj, ratio=0.1, placement="original", **options)
        kept = scenes.positions(result).astype(float)
        bpy.data.objects.remove(result)
        nearest = np.linalg.norm(points[:, None] - kept[None], axis=2).argmin(axis=1)
        colors = np.array([was_red[tuple(row)] for row in kept.tolist()])
        return (colors[nearest] != red).mean()

    plain = wrong()
    color = obj.data.attributes.new("Saliency Color", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", rgba.ravel())
    assert wrong() == plain  # what Show Saliency stores is no colour of the object
    color = obj.data.attributes.new("paint", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", rgba.ravel())
    assert wrong() < 0.8 * plain
