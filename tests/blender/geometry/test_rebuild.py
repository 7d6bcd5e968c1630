# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh carries besides plain attributes survives, too."""

import bpy
import numpy as np
import pytest
import scenes


def simplified(**options):
    """Simplify the active object and return the new one."""
    before = set(bpy.data.objects)
    assert bpy.ops.object.salient_simplify(
        **{"hide_source": False, "placement": "original"} | options
    ) == {"FINISHED"}
    (result,) = set(bpy.data.objects) - before
    return result


def origins(obj, result):
    """Return the original point that each point of the result is."""
    place = {tuple(row): k for k, row in enumerate(scenes.positions(obj).tolist())}
    return [place[tuple(row)] for row in scenes.positions(result).tolist()]


def corners(mesh):
    """Return points, uv and normal of every corner, by polygon."""
    uv = mesh.uv_layers.active
    return [
        [(mesh.loops[k].vertex_index, tuple(uv.uv[k].vector)) for k in polygon.loop_indices]
        for polygon in mesh.polygons
    ]


def test_keeping_all_changes_nothing_and_quads_stay_quads():
    obj = scenes.torus()
    result = simplified(ratio=1.0)
    assert corners(result.data) == corners(obj.data)
    assert all(len(polygon.vertices) == 4 for polygon in result.data.polygons)
    assert [tuple(e.vertices) for e in result.data.edges] != []
    assert not result.data.validate(verbose=True)


@pytest.mark.parametrize("ratio", [0.9, 0.5, 0.1, 0.02])
def test_meshes_are_valid_and_closed(ratio):
    obj = scenes.torus()
    result = simplified(ratio=ratio)
    mesh = result.data
    assert not mesh.validate(verbose=True)
    assert len(mesh.vertices) == round(ratio * len(obj.data.vertices))
    uses = np.bincount([k for polygon in mesh.polygons for k in edges_of(mesh, polygon)])
    assert set(uses) == {2}
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == 0  # a torus


def edges_of(mesh, polygon):
    return [mesh.loops[k].edge_index for k in polygon.loop_indices]


def test_quads_without_loss_stay_quads_and_the_rest_are_triangles():
    scenes.torus()
    sizes = [len(polygon.vertices) for polygon in simplified(ratio=0.9).data.polygons]
    assert set(sizes) == {3, 4}
    assert sizes.count(4) > len(sizes) / 3


def test_texture_coordinates_stay_in_their_charts():
    obj = scenes.torus()
    given = {}
    for polygon in corners(obj.data):
        for vertex, uv in polygon:
            given.setdefault(vertex, set()).add(uv)
    result = simplified(ratio=0.3)
    place = origins(obj, result)
    for polygon in corners(result.data):
        u, v = np.array([uv for _, uv in polygon]).T
        # On the other side of the seam a face would run across the whole map.
        assert max(np.ptp(u), np.ptp(v)) < 0.6
        assert all(uv in given[place[vertex]] for vertex, uv in polygon)


def test_seams_and_sharp_edges_go_with_what_is_left_of_them():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20)
    obj = bpy.context.active_object
    scenes.select(obj)
    mesh = obj.data
    for vertex in mesh.vertices:  # a roof with its ridge at x = 0
        vertex.co.z = -abs(vertex.co.x)
    ridge = [
        edge.index
        for edge in mesh.edges
        if all(abs(mesh.vertices[k].co.x) < 1e-6 for k in edge.vertices)
    ]
    assert len(ridge) == 20
    for k in ridge:
        mesh.edges[k].use_seam = mesh.edges[k].use_edge_sharp = True
    small = simplified(ratio=0.2).data
    on_ridge = [all(abs(small.vertices[k].co.x) < 1e-6 for k in e.vertices) for e in small.edges]
    assert 1 < sum(on_ridge) < 20
    assert [edge.use_seam for edge in small.edges] == on_ridge
    assert [edge.use_edge_sharp for edge in small.edges] == on_ridge


def test_materials_and_their_faces():
    obj = scenes.torus()
    for name in ("red", "blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    for polygon in obj.data.polygons:
        polygon.material_index = int(polygon.center.x > 0)
    mesh = simplified(ratio=0.3).data
    assert [material.name for material in mesh.materials] == ["red", "blue"]
    for polygon in mesh.polygons:
        if abs(polygon.center.x) > 0.4:
            assert polygon.material_index == int(polygon.center.x > 0)


def test_custom_normals():
    obj = scenes.torus()
    mesh = obj.data
    up = np.tile([0.0, 0.6, 0.8], (len(mesh.loops), 1))
    mesh.normals_split_custom_set(up)
    small = simplified(ratio=0.3).data
    assert small.has_custom_normals
    normals = np.array([tuple(item.vector) for item in small.corner_normals])
    np.testing.assert_allclose(normals, up[: len(normals)], atol=0.02)


def test_vertex_groups():
    obj = scenes.torus()
    rng = np.random.default_rng(0)
    weights = {}
    for name in ("a", "b"):
        group = obj.vertex_groups.new(name=name)
        for k in rng.permutation(800)[:500].tolist():
            weights[name, k] = float(np.float32(rng.random()))
            group.add([k], weights[name, k], "REPLACE")
    result = simplified(ratio=0.4)
    names = [group.name for group in result.vertex_groups]
    assert names == ["a", "b"]
    place = origins(obj, result)
    seen = {
        (names[element.group], place[vertex.index]): element.weight
        for vertex in result.data.vertices
        for element in vertex.groups
    }
    assert seen == {key: value for key, value in weights.items() if key[1] in set(place)}
    assert len(obj.data.vertices) == 800
    assert not bpy.data.node_groups
    assert "salient_removed" not in result.data.attributes


@pytest.mark.parametrize("output", ["NEW", "IN_PLACE"])
def test_vertex_groups_of_hidden_and_mirrored_objects(output):
    """Weights are carried by a node of an object of its own: the object's state must not matter."""
    obj = scenes.torus()
    obj.vertex_groups.new(name="a").add(list(range(0, 800, 2)), 0.5, "REPLACE")
    obj.modifiers.new("mirror", "MIRROR")
    obj.hide_render = True
    obj.scale = (-0.5, 1.0, 1.0)
    other = scenes.torus()
    scenes.select(obj)
    before = scenes.positions(obj).copy()
    if output == "NEW":
        result = simplified(ratio=0.3)
    else:
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=0.3, output=output
        )
        result = obj
    place = {tuple(row): k for k, row in enumerate(before.tolist())}
    weighted = [bool(len(vertex.groups)) for vertex in result.data.vertices]
    expected = [place[tuple(row)] % 2 == 0 for row in scenes.positions(result).tolist()]
    assert weighted == expected
    assert len(weighted) == 240
    assert len(other.data.vertices) == 800


@pytest.mark.parametrize("output", ["NEW", "IN_PLACE"])
def test_shape_keys(output):
    obj = scenes.torus()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="up")
    key.value, key.slider_max = 0.25, 2.0
    for k, point in enumerate(key.data):
        point.co.z += 0.001 * k
    driver = key.driver_add("value").driver
    driver.expression = "0.5"
    before = scenes.positions(obj).copy()
    key_before = [tuple(point.co) for point in key.data]
    if output == "NEW":
        result = simplified(ratio=0.25)
        assert len(obj.data.shape_keys.key_blocks["up"].data) == 800
    else:
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=0.25, output=output
        )
        result = obj
    place = {tuple(row): k for k, row in enumerate(before.tolist())}
    origin = [place[tuple(row)] for row in scenes.positions(result).tolist()]
    keys = result.data.shape_keys
    assert [block.name for block in keys.key_blocks] == ["Basis", "up"]
    up = keys.key_blocks["up"]
    assert [tuple(point.co) for point in up.data] == [key_before[k] for k in origin]
    assert up.slider_max == 2.0
    assert len(keys.animation_data.drivers) == 1
    assert len(result.data.polygons) > 100


def test_optimal_placement_moves_points_and_their_shape_keys():
    obj = scenes.torus()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="up")
    for point in key.data:
        point.co.z += 1.0
    obj.scale = (1.0, 2.0, 3.0)
    plain, moved = simplified(ratio=0.2), simplified(ratio=0.2, placement="optimal")
    offset = scenes.positions(moved) - scenes.positions(plain)
    assert 1e-3 < np.abs(offset).max() < 0.3
    up = np.array([tuple(point.co) for point in moved.data.shape_keys.key_blocks["up"].data])
    np.testing.assert_allclose(up - [0, 0, 1], scenes.positions(moved), atol=1e-6)


def test_active_maps_and_colours():
    obj = scenes.torus()
    mesh = obj.data
    for name in ("second", "third"):
        mesh.uv_layers.new(name=name)
    mesh.uv_layers["second"].active = True
    mesh.uv_layers["third"].active_render = True
    for name, kind, domain in (("c1", "BYTE_COLOR", "CORNER"), ("c2", "FLOAT_COLOR", "POINT")):
        mesh.color_attributes.new(name, kind, domain)
    mesh.attributes.active_color_name, mesh.attributes.default_color_name = "c2", "c1"
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.5, output="IN_PLACE"
    )
    assert [layer.name for layer in mesh.uv_layers] == ["UVMap", "second", "third"]
    assert mesh.uv_layers.active.name == "second"
    assert [layer.active_render for layer in mesh.uv_layers] == [False, False, True]
    assert mesh.attributes.active_color_name == "c2"
    assert mesh.attributes.default_color_name == "c1"


def test_loose_edges_follow_their_ends():
    mesh = bpy.data.meshes.new("wire")
    turns = np.linspace(0, 6 * np.pi, 200)
    points = np.column_stack([np.cos(turns), np.sin(turns), 0.1 * turns])
    mesh.from_pydata(points.tolist(), [(k, k + 1) for k in range(199)], [])
    obj = scenes.link(mesh)
    result = simplified(target="COUNT", count=50)
    assert len(result.data.vertices) == 50
    assert 0 < len(result.data.edges) <= 60
    assert not result.data.validate(verbose=True)
    assert len(obj.data.edges) == 199


def test_flat_and_smooth_faces():
    obj = scenes.torus()
    for polygon in obj.data.polygons:
        polygon.use_smooth = polygon.center.z > 0
    mesh = simplified(ratio=0.4).data
    smooth = [polygon.use_smooth for polygon in mesh.polygons if abs(polygon.center.z) > 0.2]
    up = [polygon.center.z > 0 for polygon in mesh.polygons if abs(polygon.center.z) > 0.2]
    assert smooth == up


def test_n_gons_and_duplicate_points_are_no_error():
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, end_fill_type="NGON")
    obj = bpy.context.active_object
    scenes.select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.edge_split(type="EDGE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.vertices) > 128
    result = simplified(target="COUNT", count=60)
    assert not result.data.validate(verbose=True)
    assert len(np.unique(scenes.positions(result), axis=0)) == 60  # places, some of them split


def test_empty_and_tiny_meshes():
    for points, faces in (
        ([], []),
        ([(0, 0, 0)], []),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
    ):
        mesh = bpy.data.meshes.new("tiny")
        mesh.from_pydata(points, [], faces)
        obj = scenes.link(mesh)
        if not points:
            with pytest.raises(RuntimeError, match="has no points"):
                bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.5)
            continue
        assert len(simplified(ratio=1.0).data.vertices) == len(points)
        bpy.data.objects.remove(obj)


def test_values_of_moved_points_are_those_of_their_new_places():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=40, size=2)
    obj = bpy.context.object
    places = scenes.positions(obj)
    height = 0.2 * np.sin(4 * places[:, 0]) * np.cos(3 * places[:, 1])
    places[:, 2] = height
    obj.data.attributes["position"].data.foreach_set("vector", places.ravel())
    east = obj.data.attributes.new("east", "FLOAT", "POINT")
    east.data.foreach_set("value", places[:, 0].copy())
    result = simplified(ratio=0.1, placement="optimal").data
    moved = np.empty(3 * len(result.vertices), dtype=np.float32)
    result.attributes["position"].data.foreach_get("vector", moved)
    moved = moved.reshape(-1, 3)
    assert not np.isin(moved[:, 0], places[:, 0]).all()
    values = np.empty(len(result.vertices), dtype=np.float32)
    result.attributes["east"].data.foreach_get("value", values)
    assert np.abs(values - moved[:, 0]).max() < 0.02
    # The grid's texture lies as its points do, from 0 to 1.
    loops = np.empty(len(result.loops), dtype=np.int32)
    result.attributes[".corner_vert"].data.foreach_get("value", loops)
    texture = np.array([tuple(corner.vector) for corner in result.uv_layers.active.uv])
    assert np.abs(2 * texture - 1 - moved[loops, :2]).max() < 0.02
