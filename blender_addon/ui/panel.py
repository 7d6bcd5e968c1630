# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab "Salient", the entries of the Object menu, and the presets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..geometry import findings
from ..operators import import_cloud, levels, live, measure, pick, preview, show, simplify, work
from ..settings import properties
from ..settings.figures import figures
from ..settings.layout import draw_clean, draw_kept, draw_output, draw_target

PRESETS = "salient_simplify"
"""Folder of the presets, in Blender's preset folders."""
SHOWN_ABOVE = ("placement", *properties.QUALITY)
"""Parameters that other panels draw."""
NO_FIGURE = "\N{EN DASH}"
PRESET_PATH = str(Path(__file__).parents[1])


class _Panel:
    """Place of all panels."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Salient"


class VIEW3D_PT_salient(_Panel, bpy.types.Panel):
    """Simplify"""

    bl_label = "Salient Simplify"

    def draw(self, context: Any) -> None:
        """Draw target, button and figures."""
        work.warm_up()
        layout, settings = self.layout, context.scene.salient_simplify
        busy = bool(figures.stage)
        column = layout.column()
        column.enabled = not busy
        draw_target(column, settings)
        row = layout.row()
        row.scale_y = 1.4  # for both, so that nothing moves when work begins or ends
        if busy:
            row.progress(factor=figures.fraction, text=f"{figures.stage} (Esc: cancel)")
        elif figures.preview:
            end = preview.OBJECT_OT_salient_preview_end.bl_idname
            row.operator(end, text="Apply").apply = True
            row.operator(end, text="Discard").apply = False
        else:
            row.operator(simplify.OBJECT_OT_salient_simplify.bl_idname, text="Simplify")
            row.operator(preview.OBJECT_OT_salient_preview.bl_idname, text="Preview")
        column = layout.column()
        column.enabled = not figures.busy
        column.use_property_split = True
        column.use_property_decorate = False
        draw_output(column, settings)
        _draw_figures(layout.box().column(align=True), context)


class VIEW3D_PT_salient_quality(_Panel, bpy.types.Panel):
    """What has to stay, and where points matter more"""

    bl_label = "Quality"
    bl_parent_id = "VIEW3D_PT_salient"

    def draw(self, context: Any) -> None:
        """Draw switches, weights and the parameters that anyone may want to turn."""
        layout, settings = self.layout, context.scene.salient_simplify
        layout.enabled = not figures.busy
        layout.use_property_split = True
        layout.use_property_decorate = False
        draw_clean(layout, settings, findings.look(context.object))
        draw_kept(layout, settings)
        for name in ("protect", "importance"):
            layout.prop(settings, name)
        if settings.importance:
            layout.prop(settings, "importance_factor")
        for name in properties.QUALITY:
            layout.prop(settings, name)


def _draw_figures(column: Any, context: Any) -> None:
    """Draw the figures of the last result, always in as many lines: no button below them moves."""
    units = context.scene.unit_settings

    def length(value: float) -> str:
        if not figures.measured:
            return NO_FIGURE
        if units.system == "NONE":
            return f"{value:.5g}"
        return bpy.utils.units.to_string(
            units.system, "LENGTH", value * units.scale_length, precision=5
        )

    before, after = figures.points_before, figures.points_after
    points = f"{after:,} of {before:,} points" if before else f"Points: {NO_FIGURE}"
    column.label(text=figures.title or "No result yet")
    column.label(text=points)
    faces = f"{figures.faces_after:,} of {figures.faces_before:,} triangles"
    column.label(text=faces if figures.faces_before else f"Triangles: {NO_FIGURE}")
    rate = f"{1.0 - after / before:.2%} removed" if before else NO_FIGURE
    column.label(text=f"Rate: {rate}")
    column.label(text=f"Largest error: {length(figures.max_error)}")
    column.label(text=f"Mean error: {length(figures.mean_error)}")
    seconds = f"{figures.seconds:.2f} s" if figures.seconds else NO_FIGURE
    column.label(text=f"Time: {seconds}")


class VIEW3D_PT_salient_more(_Panel, bpy.types.Panel):
    """See, slide and measure"""

    bl_label = "Show and More"
    bl_parent_id = "VIEW3D_PT_salient"

    def draw(self, context: Any) -> None:
        """Draw the other operators."""
        self.layout.enabled = not figures.busy
        column = self.layout.column(align=True)
        for kind in show.CLASSES:
            column.operator(kind.bl_idname, text=_short(kind))
        settings = context.scene.salient_simplify
        column = self.layout.column()
        column.prop(settings, "by_saliency")
        column.prop(settings, "regions")
        column.prop(settings, "into")
        column.operator(pick.OBJECT_OT_salient_pick_regions.bl_idname, text="Pick Regions")
        column = self.layout.column()
        column.operator(live.OBJECT_OT_salient_live.bl_idname, text="Live Simplify")
        column.label(text="Live results are not refined")
        for name in ("levels_by", "ratios", "arrange"):
            column.prop(settings, name)
        column.operator(levels.OBJECT_OT_salient_levels.bl_idname, text="Levels of Detail")
        column.operator(import_cloud.IMPORT_OT_salient_cloud.bl_idname, text="Import Cloud")
        column.operator(measure.OBJECT_OT_salient_measure.bl_idname, text="Measure Error")


class VIEW3D_PT_salient_presets(PresetPanel, bpy.types.Panel):
    """Presets"""

    bl_label = "Salient Presets"
    preset_subdir = PRESETS
    preset_operator = "script.execute_preset"
    preset_add_operator = "object.salient_preset_add"


class OBJECT_OT_salient_preset_add(AddPresetBase, bpy.types.Operator):
    """Add or remove a preset of the analysis"""

    bl_idname = "object.salient_preset_add"
    bl_label = "Add Salient Preset"
    preset_menu = "VIEW3D_PT_salient_presets"
    preset_subdir = PRESETS
    preset_defines = ("settings = bpy.context.scene.salient_simplify",)
    preset_values = tuple(f"settings.{row.name}" for row in properties.ROWS)


class VIEW3D_PT_salient_advanced(_Panel, bpy.types.Panel):
    """All other parameters, in the paper's order"""

    bl_label = "More Parameters"
    bl_parent_id = "VIEW3D_PT_salient"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - Blender reads the class attribute

    def draw_header_preset(self, context: Any) -> None:
        """Draw the menu of presets."""
        VIEW3D_PT_salient_presets.draw_panel_header(self.layout)

    def draw(self, context: Any) -> None:
        """Draw the parameters, grouped."""
        layout, settings = self.layout, context.scene.salient_simplify
        layout.enabled = not figures.busy
        layout.use_property_split = True
        layout.use_property_decorate = False
        for group in properties.GROUPS:
            header, body = layout.panel(f"salient_{group}", default_closed=True)
            header.label(text=group)
            if body is not None:
                for row in properties.ROWS:
                    if row.group == group and row.name not in SHOWN_ABOVE:
                        body.prop(settings, row.name)


class VIEW3D_MT_salient(bpy.types.Menu):
    """Simplify, show, slide and measure"""

    bl_label = "Salient"

    def draw(self, context: Any) -> None:
        """Draw all operators."""
        for kind in OPERATORS:
            self.layout.operator(kind.bl_idname, text=_short(kind))


OPERATORS = (
    *simplify.CLASSES,
    *levels.CLASSES,
    *live.CLASSES,
    *show.CLASSES,
    *pick.CLASSES,
    *measure.CLASSES,
)


def _short(kind: Any) -> str:
    """Return an operator's name, without the word that the place already says."""
    return kind.bl_label.removeprefix("Salient ")


def _draw_menu(self: Any, context: Any) -> None:
    self.layout.menu("VIEW3D_MT_salient")
    self.layout.separator()


CLASSES: tuple[Any, ...] = (
    VIEW3D_PT_salient,
    VIEW3D_PT_salient_quality,
    VIEW3D_PT_salient_more,
    VIEW3D_PT_salient_presets,
    OBJECT_OT_salient_preset_add,
    VIEW3D_PT_salient_advanced,
    VIEW3D_MT_salient,
)


def register() -> None:
    """Add the menu and the presets."""
    bpy.types.VIEW3D_MT_object.prepend(_draw_menu)  # its end lies outside small windows
    bpy.types.TOPBAR_MT_file_import.append(import_cloud.draw_import)
    bpy.utils.register_preset_path(PRESET_PATH)


def unregister() -> None:
    """Take them away."""
    bpy.types.TOPBAR_MT_file_import.remove(import_cloud.draw_import)
    bpy.utils.unregister_preset_path(PRESET_PATH)
    bpy.types.VIEW3D_MT_object.remove(_draw_menu)
