# SPDX-License-Identifier: GPL-3.0-or-later
"""Marked edges stay as lines: sharp ones, creases, bevel weights, Freestyle marks, seams."""

import bpy
import numpy as np
import pytest
import scenes

MARKS = {
    "sharp_edge": "BOOLEAN",
    "crease_edge": "FLOAT",
    "bevel_weight_edge": "FLOAT",
    "freestyle_edge": "BOOLEAN",
    "uv_seam": "BOOLEAN",
}


def sheet(mark, kind, size=60):
    """Return a wavy sheet of quads whose middle row of edges is marked."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=size, y_subdivisions=size)
    obj = bpy.context.active_object
    for vertex in obj.data.vertices:
        vertex.co.z = 0.05 * np.sin(6 * vertex.co.x) * np.cos(5 * vertex.co.y)
    places = np.array([vertex.co[:2] for vertex in obj.data.vertices])
    ends = np.array([edge.vertices[:] for edge in obj.data.edges])
    row = np.isclose(places[ends][:, :, 0], 0.0, atol=1e-4).all(axis=1)
    assert row.sum() == size
    attribute = obj.data.attributes.new(mark, kind, "EDGE")
    values = row if kind == "BOOLEAN" else np.where(row, 0.75, 0.0).astype("f4")
    attribute.data.foreach_set("value", values)
    obj.data.update()
    scenes.select(obj)
    return obj


def line_of(obj, mark):
    """Return the length of the marked edges along the line, and whether all lie in it."""
    places = np.array([vertex.co[:2] for vertex in obj.data.vertices])
    ends = np.array([edge.vertices[:] for edge in obj.data.edges])
    marked = np.array([item.value for item in obj.data.attributes[mark].data]) != 0
    found = places[ends[marked]]
    inside = np.isclose(found[:, :, 0], 0.0, atol=1e-4).all()
    return float(np.abs(np.diff(found[:, :, 1], axis=1)).sum()), bool(inside)


@pytest.mark.parametrize("mark", MARKS)
def test_at_five_per_cent_a_marked_line_is_whole(mark):
    if mark == "freestyle_edge" and bpy.app.version < (5, 0):
        pytest.skip("Freestyle marks are no attribute before Blender 5.0")
    obj = sheet(mark, MARKS[mark])
    switch = {"keep_seams": False} if mark == "uv_seam" else {"keep_sharp": False}
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.05, measure=False
    )
    kept = bpy.data.objects["Grid_simplified"]
    length, inside = line_of(kept, mark)
    assert inside
    assert length == pytest.approx(2.0, rel=1e-4)
    bpy.data.objects.remove(kept)
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.05, measure=False, **switch
    )
    length, _ = line_of(bpy.data.objects["Grid_simplified"], mark)
    assert length < 1.9
    assert line_of(obj, mark)[0] == pytest.approx(2.0, rel=1e-4)


def test_values_of_creases_go_along():
    sheet("crease_edge", "FLOAT")
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.05, measure=False
    )
    values = {
        item.value
        for item in bpy.data.objects["Grid_simplified"].data.attributes["crease_edge"].data
    }
    assert values == {0.0, 0.75}
