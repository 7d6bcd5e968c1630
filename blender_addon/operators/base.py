# SPDX-License-Identifier: GPL-3.0-or-later
"""What all operators share: settings, work in slices, messages; and the plain ones themselves."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import bpy

from . import properties, sources
from .jobs import SLICE, Job
from .salcore import Progress, SalcoreError

NAVIGATION = {
    "MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "WHEELINMOUSE", "WHEELOUTMOUSE", "MOUSEMOVE",
    "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "NDOF_MOTION",
}  # fmt: skip
"""Events that work under way lets through: nothing that could change what is worked on."""


class Worker:
    """An operator whose work is a generator: `execute` runs it through, `invoke` in slices.

    Subclasses define `work`, a generator that changes nothing in the scene, and `commit`, which
    takes what it returns and changes the scene at once; `afterwards` may go on to measure.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender reads the class attribute
    bl_label: str
    layout: Any
    properties: Any
    report: Any
    poll_message_set: Any
    _job: Job
    _timer: Any = None

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Say what is missing where the operator cannot run."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the mode of editing or painting: works in Object Mode")
            return False
        if not any(sources.eligible(context.selected_objects)):
            cls.poll_message_set("Select a mesh or a point cloud")
            return False
        return True

    def work(self, context: Any) -> Generator[Progress, None, Any]:
        """Yield progress and return what `commit` needs; leave the scene alone."""
        raise NotImplementedError

    def commit(self, context: Any, outcome: Any) -> None:
        """Change the scene."""
        raise NotImplementedError

    def afterwards(self, context: Any) -> Generator[Progress, None, None] | None:
        """Return work that remains once the scene has changed; it may be cancelled without loss."""
        return None

    def execute(self, context: Any) -> set[str]:
        """Do everything at once, from the operator's properties."""
        try:
            self.commit(context, Job(self.work(context)).finish())
            rest = self.afterwards(context)
            if rest is not None:
                Job(rest).finish()
        except (SalcoreError, MemoryError) as error:
            return self._fail(error)
        self.conclude(context)
        return {"FINISHED"}

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Take what is not given from the panel's settings, and work in slices."""
        properties.adopt(self.properties, context.scene.salient_simplify)
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            self._job = Job(self.work(context))
        except (SalcoreError, MemoryError) as error:
            return self._fail(error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.01, window=context.window)
        self._committed = False
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Work for a slice at every tick; Esc cancels."""
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
            self._end(context)
            if self._committed:
                self.conclude(context)
                return {"FINISHED"}
            self.report({"INFO"}, "Cancelled: nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in NAVIGATION else {"RUNNING_MODAL"}
        try:
            if not self._job.advance(SLICE):
                self._show(context, self._job.stage, self._job.fraction)
                return {"RUNNING_MODAL"}
            if not self._committed:
                self.commit(context, self._job.result)
                self._committed = True
                rest = self.afterwards(context)
                if rest is not None:
                    self._job = Job(rest)
                    return {"RUNNING_MODAL"}
        except (SalcoreError, MemoryError) as error:
            self._end(context)
            return self._fail(error)
        except BaseException:
            self._end(context)
            raise
        self._end(context)
        self.conclude(context)
        return {"FINISHED"}

    def cancel(self, context: Any) -> None:
        """Clean up when Blender itself ends the operator, as on loading another file."""
        self._job.cancel()
        self._end(context)

    def conclude(self, context: Any) -> None:
        """Tell what has been done."""

    def _fail(self, error: BaseException) -> set[str]:
        text = (
            str(error) if isinstance(error, SalcoreError) else "not enough memory for this object"
        )
        self.report({"ERROR"}, text)
        return {"CANCELLED"}

    def _show(self, context: Any, stage: str, fraction: float) -> None:
        figures = context.window_manager.salient_simplify
        figures.stage, figures.fraction = stage, fraction
        if context.workspace is not None:
            text = f"{self.bl_label}: {stage} {fraction:.0%}   |   Esc: cancel" if stage else None
            context.workspace.status_text_set(text)
        _redraw(context)

    def _end(self, context: Any) -> None:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        self._show(context, "", 0.0)


def _redraw(context: Any) -> None:
    """Have the sidebars drawn again."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
