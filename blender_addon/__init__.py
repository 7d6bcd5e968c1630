# SPDX-License-Identifier: GPL-3.0-or-later
"""Salient Simplify for Blender: cut heavy meshes and point clouds down to what is salient."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.handlers import persistent

from . import command
from .operators import (
    bake,
    import_cloud,
    levels,
    live,
    measure,
    pick,
    preview,
    show,
    simplify,
    work,
)
from .settings import properties
from .settings.figures import figures
from .ui import bake_panel, panel

_MODULES = (
    properties,
    simplify,
    preview,
    levels,
    show,
    pick,
    live,
    measure,
    bake,
    import_cloud,
    panel,
    bake_panel,
)
_commands: list[Any] = []


@persistent
def _forget(*_: Any) -> None:
    """Let go of the analyses of a file that is closed, and of the process that holds them."""
    work.stop()
    figures.show()


def register() -> None:
    """Add everything to Blender."""
    for module in _MODULES:
        for kind in module.CLASSES:
            bpy.utils.register_class(kind)
    properties.register()
    panel.register()
    bpy.app.handlers.load_pre.append(_forget)
    _commands.append(bpy.utils.register_cli_command(command.NAME, command.main))


def unregister() -> None:
    """Take everything away again."""
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    bpy.app.handlers.load_pre.remove(_forget)
    panel.unregister()
    properties.unregister()
    for module in reversed(_MODULES):
        for kind in reversed(module.CLASSES):
            bpy.utils.unregister_class(kind)
    work.stop()
