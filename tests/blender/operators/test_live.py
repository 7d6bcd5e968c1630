# SPDX-License-Identifier: GPL-3.0-or-later
"""The live modifier gives what Simplify gives, at any position of its slider."""

import bpy
import numpy as np
import pytest
import scenes
from models import model_path


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
    bpy.ops.object.salient_simplify(ratio=0.1)
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
        bpy.ops.object.salient_simplify(ratio=ratio)
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
    bpy.ops.wm.ply_import(filepath=str(model_path("bun_zipper.ply")))
    obj = bpy.context.active_object
    scenes.select(obj)
    bpy.ops.object.salient_live(ratio=0.1)
    live = evaluated(obj).data
    bpy.ops.object.salient_simplify(ratio=0.1)
    result = bpy.data.objects[obj.name + "_simplified"]
    assert points_of(live) >= points_of(result.data)
    assert abs(len(live.polygons) - len(result.data.polygons)) <= 0.01 * len(result.data.polygons)
