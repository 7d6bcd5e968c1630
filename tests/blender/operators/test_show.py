# SPDX-License-Identifier: GPL-3.0-or-later
"""Saliency, regions and interest points as attributes, colours and weights."""

import bpy
import numpy as np
import pytest
import scenes


def values(obj, name, width=1):
    attribute = obj.data.attributes[name]
    field, dtype = {
        "FLOAT": ("value", "f4"), "INT": ("value", "i4"), "BOOLEAN": ("value", "?"),
        "FLOAT_COLOR": ("color", "f4"),
    }[attribute.data_type]  # fmt: skip
    flat = np.empty(len(attribute.data) * width, dtype=dtype)
    attribute.data.foreach_get(field, flat)
    return flat if width == 1 else flat.reshape(-1, width)


def cube(subdivisions=16):
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.active_object
    scenes.select(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=subdivisions)
    bpy.ops.object.mode_set(mode="OBJECT")
    return obj


@pytest.mark.parametrize("as_cloud", [False, True])
def test_saliency(as_cloud):
    obj = cube()
    if as_cloud:
        obj = scenes.cloud(scenes.positions(obj))
    assert bpy.ops.object.salient_show_saliency() == {"FINISHED"}
    saliency, colors = values(obj, "saliency"), values(obj, "Saliency Color", 4)
    points = scenes.positions(obj)
    edge = (np.abs(points) > 0.999).sum(axis=1) >= 2
    middle = (np.abs(points) < 0.6).sum(axis=1) >= 2
    assert saliency[edge].min() > saliency[middle].max()
    assert (colors[edge, 0] > colors[edge, 2]).all()  # red
    assert (colors[middle, 2] > colors[middle, 0]).all()  # blue
    if as_cloud:
        slot = obj.material_slots[0]
        assert slot.link == "OBJECT"
        names = {
            node.attribute_name
            for node in slot.material.node_tree.nodes
            if node.type == "ATTRIBUTE"
        }
        assert names == {"Saliency Color"}
    else:
        assert obj.data.attributes.active_color_name == "Saliency Color"


def test_the_vertex_group_guides_blenders_own_decimation():
    obj = cube(24)
    bpy.ops.object.salient_show_saliency()
    group = obj.vertex_groups["Saliency"]
    saliency = values(obj, "saliency")
    weights = [group.weight(k) for k in range(len(saliency))]
    np.testing.assert_allclose(weights, saliency, atol=0.6 / 255)

    def left(**options):
        modifier = obj.modifiers.new("light", "DECIMATE")
        modifier.ratio = 0.2
        for name, value in options.items():
            setattr(modifier, name, value)
        mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        points = np.array([vertex.co for vertex in mesh.vertices])
        obj.modifiers.clear()
        return ((np.abs(points) > 0.999).sum(axis=1) >= 2).mean()

    guided = left(vertex_group="Saliency", vertex_group_factor=10.0, invert_vertex_group=True)
    assert guided > 1.5 * left()


def test_regions_have_colours_of_their_own():
    obj = cube()
    bpy.ops.object.salient_show_regions()
    regions, colors = values(obj, "saliency_region"), values(obj, "Region Color", 4)
    assert regions.min() == 0
    first = {
        region: tuple(color) for region, color in zip(regions[::-1], colors[::-1], strict=True)
    }
    assert all(first[region] == tuple(color) for region, color in zip(regions, colors, strict=True))
    assert len(set(first.values())) == len(first) > 1


def test_interest_points():
    obj = cube()
    bpy.ops.object.salient_show_interest(alpha=5.0)
    few = values(obj, "interest_point").copy()
    bpy.ops.object.salient_simplify(target="ALPHA", alpha=5.0)
    (result,) = (other for other in bpy.data.objects if other is not obj)
    assert few.sum() == len(result.data.vertices)
    bpy.ops.object.salient_show_interest(alpha=0.0)
    assert values(obj, "interest_point").sum() > few.sum()
