# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far the active object is from another selected one."""

from __future__ import annotations

from typing import Any

import bpy

from ..geometry import sources
from ..geometry.sources import Source
from ..settings.figures import figures
from .base import ModalOperator


class OBJECT_OT_salient_measure(ModalOperator, bpy.types.Operator):
    """Measure the error of the active object against the other selected one, as the original"""

    bl_idname = "object.salient_measure"
    bl_label = "Salient Measure Error"
    bl_options = {"REGISTER"}  # noqa: RUF012 - it changes nothing to undo
    fewest = 2

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

    def find(self, context: Any) -> list[Source]:
        """Return both, with modifiers applied: the active one comes first."""
        return sources.evaluated(context)

    def requests(self) -> list[Any]:
        """Ask once, about both."""
        return [self._compare]

    def _compare(self) -> dict[str, Any]:
        simplified, original = map(sources.geometry, self._sources)
        return {"task": "compare", "original": original, "simplified": simplified}

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Show the figures; nothing changes."""
        (errors,) = answers
        simplified, original = (source.object.name for source in self._sources)
        there, back = errors["surface"], errors["surface_back"]
        figures.show(
            title=f"{simplified} against {original}",
            points_before=errors["points_before"],
            points_after=errors["points_after"],
            max_error=there["max"],
            mean_error=there["mean"],
            measured=True,
        )
        self._message = (
            f"{figures.title}: largest error {there['max']:.4g}, mean {there['mean']:.4g}, root "
            f"mean square {there['rms']:.4g}; back: {back['max']:.4g}, {back['mean']:.4g}"
        )

    def conclude(self, context: Any) -> None:
        """Tell the figures."""
        self.report({"INFO"}, self._message)


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_measure,)
