# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetry: what is the same on both sides of an object's origin stays so."""

import bpy
import numpy as np
import pytest
import scenes
from scipy.spatial import cKDTree


def simplify(**options):
    before = set(bpy.data.objects)
    assert bpy.ops.object.salient_simplify(**{"hide_source": False} | options) == {"FINISHED"}
    (made,) = set(bpy.data.objects) - before
    return made


def monkey():
    """Return Suzanne, finer: exactly symmetrical, of quads and triangles, with a UV map."""
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.active_object
    obj.modifiers.new("fine", "SUBSURF").levels = 1
    bpy.ops.object.modifier_apply(modifier="fine")
    at = scenes.positions(obj)
    # Subdivision rounds: the twins are made exact again.
    image = at * np.float32([-1, 1, 1])
    away, twin = cKDTree(at).query(image)
    assert away.max() < 1e-5
    right = at[:, 0] > 1e-6
    at[twin[right]] = at[right] * np.float32([-1, 1, 1])
    at[twin == np.arange(len(twin)), 0] = 0.0
    obj.data.attributes["position"].data.foreach_set("vector", at.ravel())
    obj.data.update()
    scenes.select(obj)
    return obj


def require_symmetrical(obj, axis=0):
    """Compare an object with its mirror image: places and polygons, exactly."""
    at = scenes.positions(obj)
    image = at.copy()
    image[:, axis] *= -1
    away, twin = cKDTree(at).query(image)
    assert away.max() == 0.0
    polygons = {frozenset(p.vertices) for p in obj.data.polygons}
    assert {frozenset(int(twin[v]) for v in polygon) for polygon in polygons} == polygons
    assert len(polygons) == len(obj.data.polygons)
    normal = obj.data.polygons[0].normal
    assert normal.length > 0


@pytest.mark.parametrize("placement", ["original", "optimal"])
@pytest.mark.parametrize("ratio", [0.9, 0.3, 0.05])
def test_a_model_stays_symmetrical_wherever_it_stands(placement, ratio):
    obj = monkey()
    obj.rotation_euler, obj.location, obj.scale = (0.4, 0.5, 0.6), (3, 4, 5), (1.0, 1.0, 2.0)
    made = simplify(symmetry="X", ratio=ratio, placement=placement)
    require_symmetrical(made)
    count = len(obj.data.vertices)
    assert 0 <= round(ratio * count) - len(made.data.vertices) <= 1 + 0.02 * count * (ratio < 0.1)
    assert tuple(made.scale) == pytest.approx((1, 1, 2))
    quads = sum(len(p.vertices) == 4 for p in made.data.polygons)
    assert quads > 1000 if ratio == 0.9 else quads < 200  # what lost nothing is as it was
    # Where it was: each vertex lies near the surface of the original.
    distance = [(obj.closest_point_on_mesh(v.co)[1] - v.co).length for v in made.data.vertices]
    assert max(distance) < (0.12 if ratio == 0.05 else 0.04)


def test_without_it_sides_differ():
    obj = monkey()
    made = simplify(ratio=0.3)
    with pytest.raises(AssertionError):
        require_symmetrical(made)
    assert len(made.data.vertices) == round(0.3 * len(obj.data.vertices))


def test_triangles_and_another_axis():
    obj = scenes.torus()
    made = simplify(symmetry="Z", target="FACES", faces=401, placement="original")
    assert len(made.data.polygons) <= 400
    triangles = sum(len(p.vertices) - 2 for p in made.data.polygons)
    assert 380 <= triangles <= 400
    at = np.round(scenes.positions(made), 5) + 0.0
    assert {*map(tuple, at)} == {*map(tuple, at * [1, 1, -1] + 0.0)}
    assert "faces come in twins" in bpy.context.window_manager.salient_simplify.notes
    assert obj.data.uv_layers.active.name == made.data.uv_layers.active.name


def test_a_crooked_model_is_left_as_it_is_and_counted():
    obj = monkey()
    obj.data.vertices[7].co.x += 0.1
    before = scenes.positions(obj).copy()
    with pytest.raises(RuntimeError, match="2 of 2,012 points have no twin"):
        bpy.ops.object.salient_simplify(symmetry="X", output="IN_PLACE", ratio=0.3)
    assert (scenes.positions(obj) == before).all()
    other = monkey()
    scenes.select(other, obj)
    bpy.ops.object.salient_simplify(symmetry="X", output="IN_PLACE", ratio=0.3)
    assert (scenes.positions(obj) == before).all()
    require_symmetrical(other)


def test_a_sheared_object_and_a_cloud_are_refused():
    obj = monkey()
    parent = bpy.data.objects.new("parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale = (1, 1, 3)
    obj.parent, obj.rotation_euler = parent, (0.5, 0.5, 0)
    scenes.select(obj)
    with pytest.raises(RuntimeError, match="is sheared"):
        bpy.ops.object.salient_simplify(symmetry="X", ratio=0.3)
    scenes.cloud(scenes.relief())
    with pytest.raises(RuntimeError, match="there are no faces"):
        bpy.ops.object.salient_simplify(symmetry="X", ratio=0.3)


def test_levels_preview_and_again(module, work):
    obj = monkey()
    bpy.ops.object.salient_levels(symmetry="X", ratios="0.5 0.1")
    for name in ("LOD1", "LOD2"):
        require_symmetrical(bpy.data.objects[f"{obj.name}_{name}"])
    scenes.select(obj)
    scene = bpy.context.scene.salient_simplify
    scene.symmetry, scene.ratio = "X", 0.2
    preview = module("operators.preview").Preview(bpy.context, scene, work.host)
    for ratio in (0.2, 0.4):
        scene.ratio = ratio
        while preview.advance(bpy.context) != "changed":
            work.host.wait(0.05)
        require_symmetrical(preview.copies[0][0])
    preview.finish()
    while preview.advance(bpy.context) != "changed":
        work.host.wait(0.05)
    require_symmetrical(preview.copies[0][0])
    preview.discard(bpy.context)
