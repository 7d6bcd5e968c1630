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
