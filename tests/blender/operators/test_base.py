# SPDX-License-Identifier: GPL-3.0-or-later
"""While work goes on little is drawn, and its figures stay."""

import bpy
import pytest
import scenes


def test_only_sidebars_are_drawn_again(module):
    windows = bpy.context.window_manager.windows
    found = module("operators.base").sidebars(windows)
    views = [area for window in windows for area in window.screen.areas if area.type == "VIEW_3D"]
    assert len(found) == len(views) > 0
    assert {region.type for region in found} == {"UI"}


def test_progress_is_told_where_the_stage_or_the_whole_per_cent_is_another(module):
    told = module("settings.figures").Figures()
    steps = [
        ("Graph", 0.0),
        ("Graph", 0.004),
        ("Graph", 0.01),
        ("Graph", 0.019),
        ("Saliency", 0.019),
    ]
    assert [told.tell(*step) for step in steps] == [True, False, True, False, True]
    assert (told.stage, told.fraction) == ("Saliency", 0.01)
    assert told.tell("", 0.0)


def test_figures_cannot_be_set_through_blender_which_would_draw_all_windows():
    shown = bpy.context.window_manager.salient_simplify
    for name, value in (("stage", "Graph"), ("fraction", 0.5), ("title", "x")):
        with pytest.raises((AttributeError, TypeError)):
            setattr(shown, name, value)


def test_figures_outlive_an_undo():
    scenes.torus()
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_simplify("EXEC_DEFAULT", True, ratio=0.5)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo()
    assert "Torus_simplified" not in bpy.data.objects
    shown = bpy.context.window_manager.salient_simplify
    assert (shown.title, shown.points_before, shown.points_after) == ("Torus", 800, 400)
    assert shown.measured
    assert 0 < shown.mean_error < shown.max_error
