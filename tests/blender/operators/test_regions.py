# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions: shown by number or saliency, and turned into groups, attributes and selections."""

import json

import bpy
import numpy as np
import pytest
import scenes


def bumps():
    """Return a flat sheet with two bumps, the second one half as high."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=40, size=4)
    obj = bpy.context.active_object
    places = scenes.positions(obj).copy()
    for centre, height in ((-1.0, 0.5), (1.0, 0.25)):
        away = np.hypot(places[:, 0] - centre, places[:, 1])
        places[:, 2] += height * (away < 0.4)
    obj.data.attributes["position"].data.foreach_set("vector", places.ravel())
    obj.data.update()
    scenes.select(obj)
    return obj


def labels(obj):
    found = np.empty(len(obj.data.attributes["saliency_region"].data), dtype=np.int32)
    obj.data.attributes["saliency_region"].data.foreach_get("value", found)
    return found


def colors(obj):
    attribute = obj.data.attributes["Region Color"]
    values = np.empty(4 * len(attribute.data), dtype="f4")
    attribute.data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def test_regions_are_numbered_by_saliency_and_tell_their_figures():
    obj = bumps()
    bpy.ops.object.salient_show_regions()
    table = json.loads(obj.data["salient_regions"])
    assert [row["region"] for row in table] == list(range(len(table)))
    means = np.array([row["mean"] for row in table])
    assert (np.diff(means) <= 1e-6).all()  # equal ones but for rounding
    region = labels(obj)
    for row in table:
        assert row["points"] == (region == row["region"]).sum()


def test_colours_by_saliency_run_from_blue_to_red():
    obj = bumps()
    bpy.ops.object.salient_show_regions(by_saliency=True)
    region, rgb = labels(obj), colors(obj)
    first, last = rgb[region == 0][0], rgb[region == region.max()][0]
    assert first[0] - first[2] > last[0] - last[2]
    by_saliency = rgb.copy()
    bpy.ops.object.salient_show_regions(by_saliency=False)
    assert not np.array_equal(colors(obj), by_saliency)
    assert np.array_equal(labels(obj), region)


def test_regions_become_a_vertex_group_that_protects():
    obj = bumps()
    bpy.ops.object.salient_show_regions()
    region = labels(obj)
    assert bpy.ops.object.salient_pick_regions(regions="0") == {"FINISHED"}
    group = obj.vertex_groups["Salient Regions"]
    inside = [any(g.group == group.index for g in v.groups) for v in obj.data.vertices]
    np.testing.assert_array_equal(inside, region == 0)
    bpy.ops.object.salient_pick_regions(regions="0-1")  # takes the place of the first
    assert len(obj.vertex_groups) == 1
    chosen = np.isin(region, [0, 1])
    bpy.ops.object.salient_simplify(
        target="COUNT",
        count=int(chosen.sum()) + 50,
        protect="Salient Regions",
        hide_source=False,
        placement="original",
    )
    left = {tuple(row) for row in scenes.positions(bpy.data.objects["Grid_simplified"]).tolist()}
    assert {tuple(row) for row in scenes.positions(obj)[chosen].tolist()} <= left


def test_regions_become_a_selection():
    obj = bumps()
    bpy.ops.object.salient_show_regions()
    region = labels(obj)
    bpy.ops.object.salient_pick_regions(regions="0, 1", into="SELECTION")
    chosen = np.array([vertex.select for vertex in obj.data.vertices])
    np.testing.assert_array_equal(chosen, np.isin(region, [0, 1]))
    for polygon in obj.data.polygons:
        assert polygon.select == chosen[list(polygon.vertices)].all()
    assert not obj.vertex_groups


def test_regions_of_a_cloud_become_an_attribute():
    obj = scenes.cloud(scenes.positions(bumps()))
    bpy.ops.object.salient_show_regions()
    bpy.ops.object.salient_pick_regions(regions="0")
    values = np.array([item.value for item in obj.data.attributes["Salient Regions"].data])
    np.testing.assert_array_equal(values, labels(obj) == 0)
    with pytest.raises(RuntimeError, match="choose Vertex Group"):
        bpy.ops.object.salient_pick_regions(regions="0", into="SELECTION")


@pytest.mark.parametrize(
    ("text", "expected"),
    [("0", [0]), ("0-3", [0, 1, 2, 3]), ("0, 2;7", [0, 2, 7]), (" 1 - 2 5 ", [1, 2, 5])],
)
def test_how_regions_may_be_written(module, text, expected):
    assert module("operators.pick").read_numbers(text) == expected


@pytest.mark.parametrize("text", ["", "all", "-1", "3-", "1.5"])
def test_what_is_no_region(text):
    bumps()
    with pytest.raises(RuntimeError, match="give numbers or ranges"):
        bpy.ops.object.salient_pick_regions(regions=text)
