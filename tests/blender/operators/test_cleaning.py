# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that lie on another are joined first, and loose ones removed, where that is asked for."""

import bmesh
import bpy
import numpy as np
import pytest
import scenes


def simplify(**options):
    before = set(bpy.data.objects)
    options = {"hide_source": False, "placement": "original", "measure": False} | options
    assert bpy.ops.object.salient_simplify(**options) == {"FINISHED"}
    (made,) = set(bpy.data.objects) - before
    return made


def in_pieces(loose=0):
    """Return a torus each of whose 800 quads has four points of its own, and some loose points."""
    obj = scenes.torus()
    work = bmesh.new()
    work.from_mesh(obj.data)
    bmesh.ops.split_edges(work, edges=work.edges[:])
    for k in range(loose):
        work.verts.new((5.0 + k, 0.0, 0.0))
    work.to_mesh(obj.data)
    work.free()
    assert len(obj.data.vertices) == 3200 + loose
    return obj


def open_edges(obj):
    work = bmesh.new()
    work.from_mesh(obj.data)
    count = sum(edge.is_boundary for edge in work.edges)
    work.free()
    return count


def notes():
    return bpy.context.window_manager.salient_simplify.notes


@pytest.mark.parametrize("placement", ["original", "optimal"])
def test_a_surface_in_pieces_becomes_one(placement):
    obj = in_pieces(loose=5)
    uv = np.empty(2 * len(obj.data.loops), dtype=np.float32)
    obj.data.uv_layers.active.uv.foreach_get("vector", uv)
    group = obj.vertex_groups.new(name="keep")
    group.add([3100], 1.0, "REPLACE")  # one of four points at its place
    place = tuple(obj.data.vertices[3100].co)
    obj.data.edges[7].use_seam = True
    made = simplify(weld=True, remove_loose=True, ratio=0.25, protect="keep", placement=placement)
    assert "2,400 points that lay on another were joined to it" in notes()
    assert "5 loose points were removed" in notes()
    assert len(made.data.vertices) == 200
    assert open_edges(made) == 0
    kept = [tuple(v.co) for v in made.data.vertices]
    assert place in kept
    assert max(p[0] for p in kept) < 2.0
    assert len(made.data.uv_layers) == 1
    taken = np.empty(2 * len(made.data.loops), dtype=np.float32)
    made.data.uv_layers.active.uv.foreach_get("vector", taken)
    assert np.isfinite(taken).all()
    assert taken.min() >= uv.min()
    assert taken.max() <= uv.max()


def test_without_the_switches_all_is_as_before():
    in_pieces(loose=5)
    made = simplify(ratio=1.0)
    # One point for each place and chart, as ever, and the loose ones.
    assert len(made.data.vertices) == 800 + 61 + 5
    assert max(v.co.x for v in made.data.vertices) == 9.0
    assert not notes()


def test_only_loose_points_go():
    obj = scenes.torus()
    work = bmesh.new()
    work.from_mesh(obj.data)
    ends = [work.verts.new((4.0, k, 0.0)) for k in range(5)]
    work.edges.new(ends[:2])  # a wire: not loose
    work.to_mesh(obj.data)
    work.free()
    color = obj.data.attributes.new("color", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", np.linspace(0, 1, 4 * 805, dtype=np.float32))
    made = simplify(remove_loose=True, ratio=1.0)
    assert "3 loose points were removed" in notes()
    assert len(made.data.vertices) == 802
    assert len(made.data.polygons) == 800
    values = np.empty(4 * 802, dtype=np.float32)
    made.data.attributes["color"].data.foreach_get("color", values)
    assert values == pytest.approx(np.linspace(0, 1, 4 * 805, dtype=np.float32)[: 4 * 802])


def test_doubles_of_a_cloud():
    points = scenes.relief()
    for make in (scenes.cloud, scenes.points_mesh):
        obj = make(np.concatenate([points, points[:100]]))
        made = simplify(weld=True, remove_loose=True, ratio=1.0)
        assert "100 points that lay on another" in notes()
        assert len(made.data.attributes["position"].data) == 600
        for each in (obj, made):
            bpy.data.objects.remove(each)


def test_weights_shape_keys_and_levels_go_along():
    obj = in_pieces(loose=1)
    obj.vertex_groups.new(name="all").add(list(range(3201)), 0.5, "REPLACE")
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="up").data[0].co.z += 1.0
    made = simplify(weld=True, remove_loose=True, ratio=0.5)
    assert len(made.data.vertices) == 400
    assert {g.weight for v in made.data.vertices for g in v.groups} == {0.5}
    assert len(made.data.shape_keys.key_blocks["up"].data) == 400
    obj.shape_key_clear()
    scenes.select(obj)
    bpy.ops.object.salient_levels(weld=True, remove_loose=True, ratios="0.5 0.1")
    counts = [len(bpy.data.objects[f"{obj.name}_LOD{k}"].data.vertices) for k in (1, 2)]
    assert counts == [400, 80]


def test_a_preview_cleans_too(module, work):
    in_pieces(loose=2)
    scene = bpy.context.scene.salient_simplify
    scene.weld = scene.remove_loose = True
    scene.ratio = 0.5
    preview = module("operators.preview").Preview(bpy.context, scene, work.host)
    for ratio, count in ((0.5, 400), (0.1, 80)):
        scene.ratio = ratio
        while preview.advance(bpy.context) != "changed":
            work.host.wait(0.05)
        assert len(preview.copies[0][0].data.vertices) == count
    preview.discard(bpy.context)


def test_the_panel_counts_them(module):
    look = module("geometry.findings").look
    obj = in_pieces(loose=5)
    assert look(obj) == (2400, 5)
    assert look(obj).sentence == "2,400 points lie on another, 5 are loose"
    obj.data.vertices[0].co.x += 0.25
    assert look(obj) == (2399, 5)
    assert look(scenes.torus()) == (0, 0)
    points = scenes.relief()
    points[5], points[6] = (0.0, 1.0, 2.0), (-0.0, 1.0, 2.0)
    assert look(scenes.cloud(points)) == (1, 0)
    assert look(None) is None
    assert look(bpy.data.objects.new("empty", None)) is None
