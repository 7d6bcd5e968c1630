# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far the active object is from another selected one."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import bpy

from . import bridge, salcore, sources
from .operators import Worker
from .salcore import Errors, Progress
from .salcore.progress import staged


class OBJECT_OT_salient_measure(Worker, bpy.types.Operator):
    """Measure the error of the active object against the other selected one, as the original"""

    bl_idname = "object.salient_measure"
    bl_label = "Salient Measure Error"
    bl_options = {"REGISTER"}  # noqa: RUF012 - it changes nothing to undo

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Ask for two objects."""
        if not super().poll(context):
            return False
        chosen = list(sources.eligible(context.selected_objects))
        if len(chosen) != 2 or context.active_object not in chosen:
            cls.poll_message_set(
                "Select two meshes or point clouds: the original, and last the simplified one"
            )
            return False
        return True

    def work(self, context: Any) -> Generator[Progress, None, Errors]:
        """Measure both ways, in world space, with modifiers applied."""
        yield Progress("Read", 0.0)
        active = context.active_object
        found = {source.object: source for source in sources.evaluated(context)}
        try:
            surfaces = {
                obj: salcore.make_surface(*bridge.read(source.data, obj.matrix_world))
                for obj, source in found.items()
            }
        finally:
            for source in found.values():
                source.discard()
        (original,) = (obj for obj in found if obj != active)
        self._names = (original.name, active.name)
        self._counts = (len(surfaces[original].points), len(surfaces[active].points))
        steps = salcore.compare_steps(surfaces[original], surfaces[active])
        return (yield from staged("Error", 0.2, 1.0, steps))

    def commit(self, context: Any, outcome: Errors) -> None:
        """Show the figures; nothing changes."""
        figures = context.window_manager.salient_simplify
        figures.title = f"{self._names[1]} against {self._names[0]}"
        figures.points_before, figures.points_after = self._counts
        figures.max_error, figures.mean_error = outcome.surface.max, outcome.surface.mean
        figures.measured, figures.seconds = True, 0.0
        there, back = outcome.surface, outcome.surface_back
        self._said = (
            f"{figures.title}: largest error {there.max:.4g}, mean {there.mean:.4g}, root mean "
            f"square {there.rms:.4g}; back: {back.max:.4g}, {back.mean:.4g}"
        )

    def conclude(self, context: Any) -> None:
        """Tell the figures."""
        self.report({"INFO"}, self._said)


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_measure,)
