# SPDX-License-Identifier: GPL-3.0-or-later
"""The live modifier gives what Simplify gives, at any position of its slider."""

import bmesh
import bpy
import numpy as np
import pytest
import scenes


def evaluated(obj):
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get())


def points_of(data):
    attribute = data.attributes["position"]
    flat = np.empty(3 * len(attribute.data), dtype="f4")
    attribute.data.foreach_get("vector", flat)
    return {tuple(row) for row in flat.reshape(-1, 3).tolist()}


def faces_of(mesh):
    points = [tuple(vertex.co) for vertex in mesh.vertices]
    return sorted(tuple(sorted(points[k] for k in polygon.vertices)) for polygon in mesh.polygons)


def slide(module, obj, ratio):
    module("geometry.live_nodes").set_input(obj.modifiers["Salient Live"], "Ratio", ratio)
    obj.update_tag()
    bpy.context.view_layer.update()


@pytest.mark.parametrize("make", [scenes.points_mesh, scenes.cloud])
def test_points(module, make):
    obj = make(scenes.relief())
    assert bpy.ops.object.salient_live(ratio=0.5) == {"FINISHED"}
    for ratio in (0.5, 0.1, 1.0, 0.02, 0.0):
        slide(module, obj, ratio)
        there = points_of(evaluated(obj).data)
        assert len(there) == max(round(600 * ratio), 1)
    bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.1)
    (result,) = (other for other in bpy.data.objects if other.name.endswith("_simplified"))
    slide(module, obj, 0.1)
    assert points_of(evaluated(obj).data) == points_of(result.data)
    assert len(obj.data.attributes["position"].data) == 600


def triangulated_torus():
    obj = scenes.torus()
    modifier = obj.modifiers.new("triangles", "TRIANGULATE")
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    return obj


def test_meshes(module):
    obj = triangulated_torus()
    bpy.ops.object.salient_live()
    for ratio in (0.1, 0.5, 0.9, 0.03):
        slide(module, obj, ratio)
        live = evaluated(obj).data
        live.update()
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=ratio, refine=False
        )
        result = bpy.data.objects["Torus_simplified"]
        assert points_of(live) == points_of(result.data)
        assert faces_of(live) == faces_of(result.data)
        bpy.data.objects.remove(result)
        assert "salient_ancestor" not in live.attributes


def test_quads_are_cut_too(module):
    obj = scenes.torus()
    bpy.ops.object.salient_live(ratio=0.2)
    live = evaluated(obj).data
    assert len(live.vertices) == 160
    assert not live.validate(verbose=True)
    slide(module, obj, 1.0)
    assert len(evaluated(obj).data.polygons) == 800


def test_the_slider_can_be_animated(module):
    obj = scenes.cloud(scenes.relief())
    bpy.ops.object.salient_live()
    live, scene = module("geometry.live_nodes"), bpy.context.scene
    modifier = obj.modifiers["Salient Live"]
    path = live.input_path(modifier, "Ratio")
    for frame, ratio in ((1, 1.0), (11, 0.5)):
        live.set_input(modifier, "Ratio", ratio)
        assert obj.keyframe_insert(path, frame=frame)
    counts = []
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        counts.append(len(points_of(evaluated(obj).data)))
    assert counts[0] == 600
    assert counts[2] == 300
    assert 300 < counts[1] < 600


def test_one_group_serves_all(module):
    for _ in range(2):
        scenes.cloud(scenes.relief())
        bpy.ops.object.salient_live()
        bpy.ops.object.salient_live()
        assert len(bpy.context.active_object.modifiers) == 1
    assert [group.name for group in bpy.data.node_groups] == ["Salient Live Points"]


def test_a_scan(module):
    obj = scenes.scan(12_000)
    bpy.ops.object.salient_live(ratio=0.1)
    live = evaluated(obj).data
    bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.1)
    result = bpy.data.objects[obj.name + "_simplified"]
    assert points_of(live) >= points_of(result.data)
    assert abs(len(live.polygons) - len(result.data.polygons)) <= 0.01 * len(result.data.polygons)


def passes_through(obj):
    """Return whether the modifier leaves the geometry as it is, and says so."""
    shown = evaluated(obj)
    warnings = [item.message for item in obj.modifiers["Salient Live"].node_warnings]
    same = len(points_of(shown.data)) == len(points_of(obj.data))
    assert same == any("another than the one" in text for text in warnings)
    return same


def edit(obj, change):
    work = bmesh.new()
    work.from_mesh(obj.data)
    work.verts.ensure_lookup_table()
    work.faces.ensure_lookup_table()
    change(work)
    work.to_mesh(obj.data)
    work.free()
    obj.data.update()
    bpy.context.view_layer.update()


def delete_some(work):
    bmesh.ops.delete(work, geom=work.verts[100:107], context="VERTS")


def reorder(work):
    work.verts[3].index, work.verts[700].index = 700, 3
    work.verts.sort()


def delete_and_add(work):
    bmesh.ops.delete(work, geom=work.verts[100:107], context="VERTS")
    for k in range(7):
        work.verts.new((k, 0, 5))


def poke(work):
    bmesh.ops.triangulate(work, faces=work.faces[:5])


@pytest.mark.parametrize("change", [delete_some, reorder, delete_and_add, poke])
def test_a_mesh_that_was_changed_passes_through(module, change):
    obj = scenes.torus()
    bpy.ops.object.salient_live(ratio=0.2)
    assert len(evaluated(obj).data.vertices) == 160
    edit(obj, change)
    assert passes_through(obj)
    bpy.ops.object.salient_live(ratio=0.2)
    assert len(evaluated(obj).data.vertices) == round(0.2 * len(obj.data.vertices))


def test_points_that_were_moved_are_followed():
    obj = scenes.torus()
    bpy.ops.object.salient_live(ratio=0.2)
    before = points_of(evaluated(obj).data)
    edit(obj, lambda work: bmesh.ops.translate(work, verts=work.verts, vec=(0, 0, 2)))
    after = points_of(evaluated(obj).data)
    assert {(x, y, round(z - 2, 4)) for x, y, z in after} == {
        (x, y, round(z, 4)) for x, y, z in before
    }


@pytest.mark.parametrize("make", [scenes.points_mesh, scenes.cloud])
def test_points_that_were_changed_pass_through(make):
    obj = make(scenes.relief())
    bpy.ops.object.salient_live(ratio=0.5)
    assert len(points_of(evaluated(obj).data)) == 300
    obj.data.attributes["salient_index"].data[5].value = 17
    obj.data.update_tag()
    assert passes_through(obj)


@pytest.mark.parametrize("kind", ["MIRROR", "SUBSURF", "ARRAY", "SOLIDIFY"])
def test_it_stands_above_modifiers_that_make_geometry(kind):
    obj = scenes.torus()
    obj.modifiers.new("bend", "SIMPLE_DEFORM")
    obj.modifiers.new("more", kind)
    bpy.ops.object.salient_live(ratio=0.2)
    assert [modifier.name for modifier in obj.modifiers] == ["bend", "Salient Live", "more"]
    cut = evaluated(obj).data
    assert not cut.validate(verbose=True)
    left = len(cut.vertices)
    obj.modifiers["Salient Live"].show_viewport = False
    bpy.context.view_layer.update()
    whole = len(evaluated(obj).data.vertices)
    assert 0.1 < left / whole < 0.35
    obj.modifiers["Salient Live"].show_viewport = True
    obj.modifiers.move(1, 2)
    bpy.context.view_layer.update()
    assert len(evaluated(obj).data.vertices) == whole


def corner_values(mesh, name="UVMap"):
    """Return positions (c, 3) and values (c, d) of all corners."""
    attribute = mesh.attributes[name]
    width = {"FLOAT2": 2, "FLOAT_COLOR": 4, "FLOAT_VECTOR": 3, "FLOAT": 1}[attribute.data_type]
    field = {4: "color", 1: "value"}.get(width, "vector")
    values = np.empty(len(attribute.data) * width, dtype="f4")
    attribute.data.foreach_get(field, values)
    places = np.array([tuple(vertex.co) for vertex in mesh.vertices])
    vertex = [loop.vertex_index for loop in mesh.loops]
    return places[vertex], values.reshape(-1, width)


@pytest.mark.parametrize("triangles", [False, True])
def test_uv_maps_and_corner_values_stay_where_they_were(module, triangles):
    obj = triangulated_torus() if triangles else scenes.torus()
    layer = obj.data.attributes.new("mine", "FLOAT_VECTOR", "CORNER")
    places, _ = corner_values(obj.data)
    layer.data.foreach_set("vector", places.astype("f4").ravel())
    color = obj.data.attributes.new("heat", "FLOAT", "POINT")
    color.data.foreach_set("value", np.array([v.co.x for v in obj.data.vertices], dtype="f4"))
    bpy.ops.object.salient_live()
    known = {}
    for place, uv in zip(*corner_values(obj.data), strict=True):
        known.setdefault(tuple(place), set()).add(tuple(uv))
    for ratio in (0.5, 0.2, 0.05):
        slide(module, obj, ratio)
        live = evaluated(obj).data
        assert len(live.vertices) == round(800 * ratio)
        places, uv = corner_values(live)
        assert all(tuple(b) in known[tuple(a)] for a, b in zip(places, uv, strict=True))
        places, mine = corner_values(live, "mine")
        np.testing.assert_array_equal(mine, places.astype("f4"))
        heat = [item.value for item in live.attributes["heat"].data]
        assert heat == [vertex.co.x for vertex in live.vertices]
        # No face reaches across a chart: its texture is as large as its shape.
        for polygon in live.polygons:
            own = uv[list(polygon.loop_indices)]
            assert np.ptp(own, axis=0).max() < 0.9


def test_parts_that_are_not_joined(module):
    """Loose points, and copies at one place, merge or go as they do in Simplify."""
    obj = triangulated_torus()
    bpy.ops.object.duplicate()
    other = bpy.context.active_object
    other.location.x = 5
    scenes.select(obj, other)
    bpy.ops.object.join()
    edit(obj, lambda work: [work.verts.new((k / 7, 3, 0)) for k in range(40)])
    bpy.ops.object.salient_live()
    assert "connected=True" in obj.modifiers["Salient Live"].node_group["salient_kind"]
    compare_cuts(module, obj)
    edit(obj, lambda work: bmesh.ops.split_edges(work, edges=work.edges))
    bpy.ops.object.salient_live()
    assert "connected=False" in obj.modifiers["Salient Live"].node_group["salient_kind"]
    slide(module, obj, 0.2)
    assert len(evaluated(obj).data.vertices) == round(0.2 * len(obj.data.vertices))


def compare_cuts(module, obj):
    for ratio in (0.5, 0.1, 0.02):
        slide(module, obj, ratio)
        live = points_of(evaluated(obj).data)
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=ratio, refine=False
        )
        result = bpy.data.objects[obj.name + "_simplified"]
        assert live == points_of(result.data)
        bpy.data.objects.remove(result)
