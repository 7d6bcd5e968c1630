# SPDX-License-Identifier: GPL-3.0-or-later
"""F9: Blender undoes the operator and executes it again with other properties."""

import bpy
import pytest
import scenes


def redo(**values):
    """Do what F9 does when a value is changed."""
    for name, value in values.items():
        setattr(bpy.context.window_manager.operators[-1].properties, name, value)
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        assert bpy.ops.ed.undo_redo() == {"FINISHED"}


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.0, 5.0, 9.0)])
def test_again_with_another_ratio(scale):
    obj = scenes.points_mesh(scenes.relief())
    obj.scale = scale
    bpy.context.view_layer.update()
    bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.3)
    expected = scenes.positions(bpy.data.objects["points_simplified"]).copy()
    bpy.data.objects.remove(bpy.data.objects["points_simplified"])
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_simplify(
        "EXEC_DEFAULT", True, hide_source=False, placement="original", ratio=0.1
    )
    redo(ratio=0.3)
    result = bpy.data.objects["points_simplified"]
    assert len(bpy.data.objects) == 2
    # The order of removal depends on the scale: without it others would be kept.
    assert scenes.positions(result).tolist() == expected.tolist()
    assert tuple(result.matrix_world.to_scale()) == pytest.approx(scale)


def test_errors_and_targets_are_in_scene_units_and_the_analysis_is_kept(module):
    obj = scenes.torus()
    obj.scale = (100.0, 100.0, 100.0)
    bpy.context.view_layer.update()
    requests = module("worker.requests")
    requests.forget()
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_simplify("EXEC_DEFAULT", True, target="MAX_ERROR", max_error=5.0)
    figures = bpy.context.window_manager.salient_simplify
    first = figures.points_after
    assert 1.0 < figures.max_error <= 5.0
    redo(max_error=10.0)
    assert 5.0 < figures.max_error <= 10.0
    assert 20 < figures.points_after < first
    assert module("worker.analyses").count() == 1


def test_of_a_large_scan_errors_are_measured_while_nobody_waits(module, work, monkeypatch):
    scenes.torus()
    monkeypatch.setattr(module("operators.base"), "LARGE", 500)
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_simplify("EXEC_DEFAULT", True, ratio=0.5)
    figures = bpy.context.window_manager.salient_simplify
    assert figures.measured
    known = figures.max_error
    redo(ratio=0.1)
    assert figures.points_after == 80
    assert not figures.measured
    while work.look_later() is not None:
        work.host.wait(0.1)
    assert figures.measured
    assert figures.max_error > known
    assert figures.points_after == 80


def test_measuring_that_nobody_waits_for_gives_way_to_other_work(module, work, monkeypatch):
    scenes.torus()
    monkeypatch.setattr(module("operators.base"), "LARGE", 500)
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_simplify("EXEC_DEFAULT", True, ratio=0.5)
    redo(ratio=0.1)
    assert bpy.ops.object.salient_show_saliency() == {"FINISHED"}
    assert work.look_later() is None
    assert not bpy.context.window_manager.salient_simplify.measured
