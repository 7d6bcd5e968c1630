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
    assert not obj.vertex_groups  # it would make each later cut slower
    assert bpy.ops.object.salient_vertex_group() == {"FINISHED"}
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
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", target="ALPHA", alpha=5.0
    )
    (result,) = (other for other in bpy.data.objects if other is not obj)
    assert few.sum() == len(result.data.vertices)
    bpy.ops.object.salient_show_interest(alpha=0.0)
    assert values(obj, "interest_point").sum() > few.sum()


@pytest.mark.parametrize("make", [scenes.points_mesh, scenes.cloud])
@pytest.mark.parametrize("task", ["saliency", "regions", "interest"])
def test_points_are_shown_at_once(make, task):
    """As points of half the mean spacing, in the colours stored."""
    grid = np.stack(np.meshgrid(*[np.arange(20.0)] * 2), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.where(grid[:, 0] > 9, grid[:, 0] - 9, 0.0)]) * 1000.0
    obj = make(points)
    obj.scale = (0.5, 0.5, 0.5)
    assert getattr(bpy.ops.object, f"salient_show_{task}")() == {"FINISHED"}
    name = {"saliency": "Saliency", "regions": "Region", "interest": "Interest"}[task] + " Color"
    final = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    parts = final.evaluated_geometry()
    cloud = parts.pointcloud
    assert len(cloud.points) == 400
    radius = np.empty(400, dtype="f4")
    cloud.attributes["radius"].data.foreach_get("value", radius)
    # The flat half has a spacing of 1000, the other one of 1000 as well: its rows are parallel.
    np.testing.assert_allclose(radius, 500.0, rtol=1e-3)
    assert name in cloud.attributes
    if obj.type == "MESH":
        (material,) = [item for item in cloud.materials if item is not None]
    else:
        material = obj.material_slots[0].material
    nodes = material.node_tree.nodes
    assert {node.attribute_name for node in nodes if node.type == "ATTRIBUTE"} == {name}
    if obj.type == "MESH":
        assert parts.mesh is None or not len(parts.mesh.vertices)  # they would hide the points
        assert len(obj.data.vertices) == 400
        assert bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=0.5, source="EVALUATED"
        ) == {"FINISHED"}
        assert len(bpy.data.objects["points_simplified"].data.points) == 200


def test_a_clouds_own_radius_stays():
    obj = scenes.cloud(scenes.relief())
    if "radius" not in obj.data.attributes:
        obj.data.attributes.new("radius", "FLOAT", "POINT")
    obj.data.attributes["radius"].data.foreach_set("value", np.full(600, 0.25, dtype="f4"))
    bpy.ops.object.salient_show_saliency()
    assert values(obj, "radius").min() == 0.25
