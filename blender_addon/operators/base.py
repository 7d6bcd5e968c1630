# SPDX-License-Identifier: GPL-3.0-or-later
"""What all operators share: settings, work in the child process, messages."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import bpy

from ..geometry import read, sources
from ..geometry.read import HostError
from ..geometry.sources import Source
from ..salcore import SalcoreError
from ..settings import properties
from ..settings.figures import figures
from . import work
from .work import Task

TICK = 0.1
"""Seconds between two looks at the child's messages."""
LARGE = 100_000
"""Points of a selection up to which all is done at once when Blender repeats an operator."""
NAVIGATION = {
    "MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "WHEELINMOUSE", "WHEELOUTMOUSE", "MOUSEMOVE",
    "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "NDOF_MOTION",
}  # fmt: skip
"""Events that work under way lets through: nothing that could change what is worked on."""
SKIP_SAVE = {"SKIP_SAVE"}
"""Operators remember nothing: the panel's settings hold, or what a script says."""

_told: set[str] = set()
"""Reasons why there is no child that have been told."""


class ModalOperator:
    """An operator whose work is done elsewhere: `execute` waits for it, `invoke` does not.

    Subclasses define `find`, `request` and `commit`; `measuring` may ask for more once the scene
    has changed, and `conclude` tells what has been done.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender reads the class attribute
    bl_label: str
    layout: Any
    options: Any
    properties: Any
    report: Any
    poll_message_set: Any
    _sources: list[Source]
    _warnings: list[str]
    _task: Task
    _committed: bool
    _timer: Any = None
    _points = 0
    fewest = 1
    """Geometries that it takes; with fewer that can be worked on it refuses."""

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Say what is missing where the operator cannot run."""
        if figures.stage:
            cls.poll_message_set("Work is under way; Esc cancels it")
            return False
        if figures.preview:
            cls.poll_message_set("A preview is shown: apply it, or remove it with Esc")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the mode of editing or painting: works in Object Mode")
            return False
        if not any(sources.eligible(context.selected_objects)):
            cls.poll_message_set("Select a mesh or a point cloud")
            return False
        return True

    def find(self, context: Any) -> list[Source]:
        """Return the geometries to work on."""
        raise NotImplementedError

    def check(self, source: Source) -> None:
        """Raise `HostError` if a geometry cannot be worked on."""

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Return what to ask about the geometry of this number: arrays and plain values."""
        raise NotImplementedError

    def requests(self) -> list[Any]:
        """Return functions that make the requests: one for each geometry."""
        return [partial(self.request, source, k) for k, source in enumerate(self._sources)]

    def commit(self, context: Any, results: list[Any]) -> None:
        """Change the scene by the answers, in the order of the requests."""
        raise NotImplementedError

    def measuring(self) -> dict[str, Any] | None:
        """Return a request that remains once the scene has changed."""
        return None

    def measured(self, result: Any) -> None:
        """Take the answer to it."""

    def later(self) -> Callable[[Any], None]:
        """Return a function that takes the answer when the operator is over."""
        raise NotImplementedError

    def is_large_repeat(self) -> bool:
        """Return whether Blender repeats the operator, with other values, on large objects.

        Then it waits: what takes long is left for later.
        """
        return bool(self.options.is_repeat) and self._points > LARGE

    def conclude(self, context: Any) -> None:
        """Tell what has been done."""

    def execute(self, context: Any) -> set[str]:
        """Do everything at once, from the operator's properties."""
        try:
            self._begin(context, work.spare_host())
            while not self._step(context, wait=True):
                pass
        except (SalcoreError, MemoryError) as error:
            return self._fail(context, error)
        finally:
            self._release()
        self._finish(context)
        return {"FINISHED"}

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Take what is not given from the panel's settings, and let the child work."""
        properties.fill_unset(self.properties, context.scene.salient_simplify)
        if bpy.app.background or context.window is None:
            return self.execute(context)
        manager = context.window_manager
        try:
            self._begin(context, work.host)
            if not self._task.in_process:
                self._task.advance()
        except BaseException as error:
            self._release()
            if isinstance(error, (SalcoreError, MemoryError)):
                return self._fail(context, error)
            raise
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.modal_handler_add(self)
        self._show(context, self._task.stage, 0.0)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Read the child's messages at every tick; Esc cancels."""
        if event.type == "ESC" and event.value == "PRESS":
            return self._cancel(context)
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in NAVIGATION else {"RUNNING_MODAL"}
        try:
            if not self._step(context, wait=False):
                self._show(context, self._task.stage, self._task.fraction)
                return {"RUNNING_MODAL"}
        except BaseException as error:
            self._end(context)
            if isinstance(error, (SalcoreError, MemoryError)):
                return self._fail(context, error)
            raise
        self._end(context)
        self._finish(context)
        self._tell_why_it_waited()
        return {"FINISHED"}

    def cancel(self, context: Any) -> None:
        """Clean up when Blender itself ends the operator, as on loading another file."""
        self._task.cancel()
        self._end(context)

    def _begin(self, context: Any, host: Any) -> None:
        """Find what to work on, and make its requests."""
        work.drop_later()
        self._committed = False
        self._sources, self._warnings = [], []
        self._points = 0
        context.view_layer.update()  # after the undo of F9 all matrices are still the identity
        self._sources = self.find(context)
        problems = self._leave_out({k: self._problem(s) for k, s in enumerate(self._sources)})
        if len(self._sources) < self.fewest:
            raise problems[0]
        for source in self._sources:
            self._points += source.count
            note = read.precision_note(source.data)
            self.warn(source, [note] if note else [])
        self._task = Task(self.requests(), host)

    def _problem(self, source: Source) -> SalcoreError | None:
        """Return why a geometry cannot be worked on, or None."""
        try:
            source.require_present()
            self.check(source)
        except HostError as error:
            return error
        return None

    def _leave_out(self, problems: dict[int, Any]) -> list[Any]:
        """Go on without sources that have a problem, and return the problems."""
        found = [error for error in problems.values() if error is not None]
        bad = [source for k, source in enumerate(self._sources) if problems.get(k) is not None]
        for source, error in zip(bad, found, strict=True):
            self._sources.remove(source)
            name = source.object.name
            text = _sentence(error).removeprefix(f"{name}: ")
            self._warnings.append(f"{name} is left out: {text}")
            source.discard()
        return found

    def warn(self, source: Source, notes: list[str]) -> None:
        """Remember what had to be given up, to be told in the end."""
        self._warnings += [f"{source.object.name}: {note}" for note in notes]

    def _finish(self, context: Any) -> None:
        """Tell what has been done, and then what could not be."""
        self.conclude(context)
        for text in self._warnings:
            self.report({"WARNING"}, text)

    def _step(self, context: Any, wait: bool) -> bool:
        """Go on with the task, commit it when it is done; return whether nothing remains."""
        if wait:
            self._task.finish()
        elif not self._advance(context):
            return False
        if self._committed:
            self.measured(self._task.results[0])
            return True
        results = self._task.results
        if self._task.failures:
            problems = self._leave_out(self._task.failures)
            if len(self._sources) < self.fewest:
                raise problems[0]
            results = [result for result in results if result is not None]
        self.commit(context, results)
        self._committed = True
        more = self.measuring()
        if more is None:
            return True
        if self.is_large_repeat():
            work.begin_later(more, self.later())
            return True
        self._task = Task([lambda: more], self._task.host)
        return False

    def _cancel(self, context: Any) -> set[str]:
        """Answer Esc at once; the child is looked after until it has stopped."""
        self._task.cancel()
        self._end(context)
        if not bpy.app.timers.is_registered(work.settle):
            bpy.app.timers.register(work.settle, first_interval=TICK)
        if self._committed:
            self._finish(context)
            return {"FINISHED"}
        self.report({"INFO"}, "Cancelled: nothing was changed")
        return {"CANCELLED"}

    def _fail(self, context: Any, error: BaseException) -> set[str]:
        """Tell a mistake in a sentence; after the commit there is a result all the same."""
        text = _sentence(error)
        if self._committed:
            self._finish(context)
            self.report({"WARNING"}, f"The error was not measured: {text}")
            return {"FINISHED"}
        self.report({"ERROR"}, text)
        return {"CANCELLED"}

    def _advance(self, context: Any) -> bool:
        """Go on with the task; where this process has to do it, show that its window waits."""
        if not self._task.in_process:
            return self._task.advance()
        context.window.cursor_modal_set("WAIT")
        try:
            return self._task.advance()
        finally:
            context.window.cursor_modal_restore()

    def _tell_why_it_waited(self) -> None:
        """Say once for each reason why the work was done in this process."""
        reason = work.host.reason
        if reason and reason not in _told:
            _told.add(reason)
            text = "Blender waited for this work, as no worker process could be started"
            self.report({"WARNING"}, f"{text}: {reason}")

    def _show(self, context: Any, stage: str, fraction: float) -> None:
        """Tell how far the work is, where that can be read."""
        if not figures.tell(stage, fraction):
            return
        if context.workspace is not None:
            text = f"{self.bl_label}: {text_of_status(stage, fraction)}" if stage else None
            context.workspace.status_text_set(text)
        for region in sidebars(context.window_manager.windows):
            region.tag_redraw()

    def _end(self, context: Any) -> None:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        self._show(context, "", 0.0)
        self._release()

    def _release(self) -> None:
        """Remove copies made for the work that are not used."""
        while self._sources:
            self._sources.pop().discard()


def _sentence(error: BaseException) -> str:
    return str(error) if isinstance(error, SalcoreError) else "not enough memory for this object"


def show_errors(shown: dict[str, Any], errors: list[dict[str, float]]) -> None:
    """Show figures again, with errors that have been measured by now."""
    figures.show(**shown, **whole_errors(errors))
    for region in sidebars(bpy.context.window_manager.windows):
        region.tag_redraw()


def whole_errors(errors: list[dict[str, float]]) -> dict[str, Any]:
    """Return the errors of several geometries as figures of all their points."""
    points = sum(error["points"] for error in errors)
    return {
        "max_error": max(error["max"] for error in errors),
        "mean_error": sum(error["mean"] * error["points"] for error in errors) / points,
        "measured": True,
    }


def text_of_status(stage: str, fraction: float) -> str:
    """Return what the status bar tells about work under way."""
    return f"{stage} {fraction:.0%}   |   Esc: cancel"


def sidebars(windows: Any) -> list[Any]:
    """Return the sidebars of all 3D views; the views themselves may take long to draw."""
    return [
        region
        for window in windows
        for area in window.screen.areas
        if area.type == "VIEW_3D"
        for region in area.regions
        if region.type == "UI"
    ]
