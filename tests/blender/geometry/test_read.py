# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects to arrays."""

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix


def test_points_and_normals_are_in_world_space(module):
    read = module("geometry.read")
    obj = scenes.cloud(scenes.relief())
    layer = module("geometry.attributes").Layer(
        "normal", "FLOAT_VECTOR", "POINT", np.tile(np.float32([0, 0.6, 0.8]), (600, 1))
    )
    module("geometry.attributes").write_layer(obj.data, layer)
    matrix = Matrix.LocRotScale((1, 2, 3), None, (1, 1, 4))
    arrays = read.arrays(obj.data, matrix)
    np.testing.assert_allclose(
        arrays.points, scenes.positions(obj) * [1, 1, 4] + [1, 2, 3], rtol=1e-6
    )
    assert arrays.faces is None
    normal = arrays.normals[0] / np.linalg.norm(arrays.normals[0])
    # The plane y = -z 0.8/0.6 is now y = -z 0.8/2.4: its normal leans towards y.
    np.testing.assert_allclose(normal, np.array([0, 2.4, 0.8]) / np.hypot(2.4, 0.8), rtol=1e-6)


def test_polygons_are_triangulated(module):
    read = module("geometry.read")
    obj = scenes.torus()
    arrays = read.arrays(obj.data, Matrix())
    assert arrays.faces.shape == (1600, 3)
    assert arrays.points.dtype == np.float64
    assert arrays.normals is None
    vertices, corners, polygons = read.triangles(obj.data)
    loops = np.array([loop.vertex_index for loop in obj.data.loops])
    np.testing.assert_array_equal(loops[corners], vertices)
    np.testing.assert_array_equal(np.bincount(polygons), np.full(800, 2))


def test_weights(module):
    read, error = module("geometry.read"), module("geometry.read").HostError
    obj = scenes.torus()
    obj.vertex_groups.new(name="other").add([0, 1], 1.0, "REPLACE")
    obj.vertex_groups.new(name="group").add([1, 5], 0.25, "REPLACE")
    found = read.weights(obj, obj.data, "group")
    assert np.flatnonzero(found).tolist() == [1, 5]
    assert found[5] == 0.25
    obj.data.attributes.new("edge", "FLOAT", "EDGE")
    with pytest.raises(error, match="no vertex group"):
        read.weights(obj, obj.data, "edge")


def test_what_modifiers_make(module):
    sources = module("geometry.sources")
    cloud = scenes.cloud(scenes.relief())
    torus = scenes.torus()
    torus.modifiers.new("sub", "SUBSURF").levels = 1
    scenes.select(torus, cloud)
    before = len(bpy.data.meshes), len(bpy.data.pointclouds)
    found = sources.evaluated(bpy.context)
    assert [source.object for source in found] == [torus, cloud]
    assert len(found[0].data.vertices) == 3200
    assert len(found[1].data.points) == 600
    for source in found:
        source.discard()
    assert (len(bpy.data.meshes), len(bpy.data.pointclouds)) == before


def test_what_can_protect_points_is_offered_and_understood(module):
    read = module("geometry.read")
    obj = scenes.torus()
    obj.vertex_groups.new(name="group").add([3, 4], 0.5, "REPLACE")
    for name, kind, domain in (
        (".sculpt_mask", "FLOAT", "POINT"),
        ("painted", "FLOAT", "POINT"),
        ("faces", "BOOLEAN", "FACE"),
        ("color", "FLOAT_COLOR", "POINT"),
        ("edges", "FLOAT", "EDGE"),
        (".hidden", "FLOAT", "POINT"),
    ):
        obj.data.attributes.new(name, kind, domain)
    assert {"group", ".sculpt_mask", "painted", "faces"} <= set(read.weight_names(obj))
    assert not {"color", "edges", ".hidden"} & set(read.weight_names(obj))
    obj.data.attributes["faces"].data[7].value = True
    obj.data.attributes[".sculpt_mask"].data[9].value = 0.25
    found = read.weights(obj, obj.data, "faces")
    assert set(np.flatnonzero(found)) == set(obj.data.polygons[7].vertices)
    assert np.flatnonzero(read.weights(obj, obj.data, ".sculpt_mask")).tolist() == [9]
    assert read.weights(obj, obj.data, "group")[[2, 3, 4]].tolist() == [0.0, 0.5, 0.5]
    assert read.weight_names(None) == []


def test_face_sets_and_the_sculpt_mask_protect():
    obj = scenes.torus()
    mesh = obj.data
    sets = np.ones(800, dtype=np.int32)
    sets[100:140], sets[300:310] = 3, 7
    mesh.attributes.new(".sculpt_face_set", "INT", "FACE").data.foreach_set("value", sets)
    mask = mesh.attributes.new(".sculpt_mask", "FLOAT", "POINT")
    mask.data[9].value, mask.data[11].value = 1.0, 0.01
    values = np.zeros(800, dtype=np.float32)
    values[40:50] = 0.5
    mesh.attributes.new("soft", "FLOAT", "FACE").data.foreach_set("value", values)
    mesh.attributes.new("hard", "BOOLEAN", "FACE").data.foreach_set("value", values > 0)

    def corners(polygons):
        return {v for k in polygons for v in mesh.polygons[int(k)].vertices}

    expected = {
        ".sculpt_face_set": corners(np.flatnonzero(sets != 1)),
        "Face Set 3": corners(range(100, 140)),
        "Face Set 7": corners(range(300, 310)),
        ".sculpt_mask": {9, 11},
        "soft": corners(range(40, 50)),
        "hard": corners(range(40, 50)),
    }
    places = scenes.positions(obj)
    for name, points in expected.items():
        scenes.select(obj)
        bpy.ops.object.salient_simplify(
            protect=name, ratio=0.15, hide_source=False, placement="optimal", measure=False
        )
        made = bpy.data.objects["Torus_simplified"]
        left = {tuple(p) for p in scenes.positions(made).tolist()}
        assert {tuple(p) for p in places[sorted(points)].tolist()} <= left, name
        assert len(left) == 120
        bpy.data.objects.remove(made)


def test_face_sets_are_offered_and_missing_ones_refused(module):
    read = module("geometry.read")
    obj = scenes.torus()
    assert ".sculpt_face_set" not in read.weight_names(obj)
    sets = obj.data.attributes.new(".sculpt_face_set", "INT", "FACE")
    sets.data.foreach_set("value", np.arange(800, dtype=np.int32) // 400 + 1)
    assert {".sculpt_face_set", "Face Set 1", "Face Set 2"} <= set(read.weight_names(obj))
    assert read.weights(obj, obj.data, "Face Set 1").sum() == 420
    for name in ("Face Set 9", "Face Set x", "face"):
        with pytest.raises(module("geometry.read").HostError, match="clear the field"):
            read.weights(obj, obj.data, name)


def test_importance_keeps_more_points_where_it_is_painted():
    obj = scenes.points_mesh(scenes.relief(2000))
    left = scenes.positions(obj)[:, 0] < 2.0
    obj.data.attributes.new("painted", "FLOAT", "POINT").data.foreach_set(
        "value", left.astype("f4")
    )
    options = {"ratio": 0.1, "hide_source": False, "placement": "original"}

    def share():
        result = bpy.data.objects["points_simplified"]
        found = (scenes.positions(result)[:, 0] < 2.0).mean()
        bpy.data.objects.remove(result)
        return found

    bpy.ops.object.salient_simplify(**options)
    plain = share()
    bpy.ops.object.salient_simplify(importance="painted", importance_factor=20.0, **options)
    assert share() > plain + 0.1
    obj.data.attributes["painted"].data[0].value = -1.0
    with pytest.raises(RuntimeError, match="importance wants values from 0 on"):
        bpy.ops.object.salient_simplify(importance="painted", **options)
