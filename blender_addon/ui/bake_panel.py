# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that bakes the original's normals for a light mesh."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators import bake
from ..settings import baking
from ..settings.figures import figures
from .panel import VIEW3D_PT_salient


class VIEW3D_PT_salient_bake(bpy.types.Panel):
    """The original's detail as an image, for a light mesh that looks like it"""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Salient"
    bl_label = "Normal Map"
    bl_parent_id = VIEW3D_PT_salient.__name__
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - Blender reads the class attribute

    def draw(self, context: Any) -> None:
        """Draw the settings and the button."""
        layout = self.layout
        layout.enabled = not figures.busy
        layout.use_property_split = True
        layout.use_property_decorate = False
        for name in baking.bake_annotations(set()):
            layout.prop(context.scene.salient_simplify, name)
        layout.operator(bake.OBJECT_OT_salient_bake.bl_idname, text="Bake Normal Map")


CLASSES: tuple[Any, ...] = (VIEW3D_PT_salient_bake,)
