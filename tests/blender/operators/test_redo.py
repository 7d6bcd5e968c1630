# SPDX-License-Identifier: GPL-3.0-or-later
"""F9: Blender undoes the operator and executes it again with other properties."""

import bpy
import pytest
import scenes


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.0, 5.0, 9.0)])
def test_again_with_another_ratio(scale):
    obj = scenes.points_mesh(scenes.relief())
    obj.scale = scale
    bpy.context.view_layer.update()
    bpy.ops.object.salient_simplify(hide_source=False, ratio=0.3)
    expected = scenes.positions(bpy.data.objects["points_simplified"]).copy()
    bpy.data.objects.remove(bpy.data.objects["points_simplified"])
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_simplify("EXEC_DEFAULT", True, hide_source=False, ratio=0.1)
    bpy.context.window_manager.operators[-1].properties.ratio = 0.3
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        assert bpy.ops.ed.undo_redo() == {"FINISHED"}
    result = bpy.data.objects["points_simplified"]
    assert len(bpy.data.objects) == 2
    # The order of removal depends on the scale: without it others would be kept.
    assert scenes.positions(result).tolist() == expected.tolist()
    assert tuple(result.matrix_world.to_scale()) == pytest.approx(scale)
