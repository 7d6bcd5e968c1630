# SPDX-License-Identifier: GPL-3.0-or-later
"""A preview: one result that follows the target in the panel, until it is applied or discarded."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import bpy

from ..geometry import read, rebuild, results, sources
from ..geometry.read import HostError
from ..geometry.sources import Source
from ..geometry.topology import Reduced
from ..salcore import SalcoreError
from ..settings import properties
from ..settings.figures import figures
from . import work
from .base import TICK, ModalOperator, show_errors, sidebars, text_of_status
from .work import Task

WAIT, CHANGED = "wait", "changed"


class Preview:
    """Results of the selected objects that follow the target of some settings.

    A timer, or a test, calls `advance`. What it shows are drafts, until `finish` asks for the
    results that Simplify gives.

    Parameters
    ----------
    context : bpy.types.Context
    settings : SalientSettings
        Its target may change at any time; what else it says is taken once.
    host : Host or None
        Of the child that does the work.

    Raises
    ------
    HostError
        If there is nothing to work on.
    """

    def __init__(self, context: Any, settings: Any, host: Any) -> None:
        self.settings, self.host = settings, host
        self.sources: list[Source] = sources.selected(context, settings.source)
        for source in self.sources:
            source.require_present()
        self.copies: list[list[Any]] = []
        self._state = _ViewState(context, self.sources)
        self._wanted = properties.target(settings)
        self.finishing = False
        makers = [partial(self._request, k) for k in range(len(self.sources))]
        self.task: Task | None = Task(makers, host)

    def _request(self, number: int) -> dict[str, Any]:
        return {
            "task": "simplify",
            "parameters": properties.parameters(self.settings).as_dict(),
            "targets": [self._wanted],
            "number": number,
            "original_normals": self.settings.original_normals,
            "draft": True,
            **sources.to_simplify(self.sources[number], self.settings),
        }

    def advance(self, context: Any) -> str:
        """Go on; return whether the result is another one now, or `WAIT`.

        Raises
        ------
        SalcoreError, MemoryError
            If a target cannot be reached; another one may be.
        """
        if self.task is None:
            target = properties.target(self.settings)
            if target == self._wanted:
                return WAIT
            self._cut(target)
        assert self.task is not None
        try:
            if not self.task.advance():
                return WAIT
        except BaseException:
            self.task = None
            raise
        answers, self.task = self.task.results, None
        self._show(context, [answer for answer in answers if answer is not None])
        return CHANGED

    def _cut(self, target: dict[str, float]) -> None:
        """Ask for another target."""
        self._wanted = target
        words: dict[str, Any] = {"task": "cut", "targets": [target], "draft": not self.finishing}
        makers: list[Callable[[], Any]] = [
            partial(dict, words, number=k) for k in range(len(self.sources))
        ]
        self.task = Task(makers, self.host)

    def finish(self) -> None:
        """Ask for the results themselves, in the place of drafts."""
        self.finishing = True
        self._cut(properties.target(self.settings))

    def _show(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Make the result objects, or give them other data."""
        if len(answers) < len(self.sources):
            raise HostError("not all objects of the selection can be simplified like this")
        found = [Reduced.from_dict(answer["levels"][0]) for answer in answers]
        if not self.copies:
            pairs = zip(self.sources, found, strict=True)
            self.copies = [results.add(source, result, "_simplified") for source, result in pairs]
            if self.settings.hide_source:
                for source, copies in zip(self.sources, self.copies, strict=True):
                    results.hide(context, source.objects, copies)
        else:
            for source, copies, result in zip(self.sources, self.copies, found, strict=True):
                _exchange(source, copies, result)
        names = ", ".join(source.object.name for source in self.sources)
        figures.show(
            title=names if self.finishing else f"{names}: a draft, refined by Apply",
            points_before=sum(source.count for source in self.sources),
            points_after=sum(len(result.indices) for result in found),
            faces_before=sum(answer["triangles"] for answer in answers),
            faces_after=sum(result.triangles for result in found),
            notes="\n".join(note for result in found for note in result.notes),
        )

    def apply(self) -> None:
        """Keep what is shown."""
        self._stop()

    def discard(self, context: Any) -> None:
        """Remove the results, and leave all as it was."""
        self._stop()
        objects = [obj for copies in self.copies for obj in copies]
        data = {obj.data for obj in objects}
        bpy.data.batch_remove(objects)
        bpy.data.batch_remove([block for block in data if not block.users])
        self.copies = []
        self._state.restore(context)
        figures.show()

    def _stop(self) -> None:
        if self.task is not None:
            self.task.cancel()
            self.task = None
        for source in self.sources:
            source.discard()


class _ViewState:
    """What is selected, active and hidden."""

    def __init__(self, context: Any, found: list[Source]) -> None:
        self.active = context.view_layer.objects.active
        objects = [obj for source in found for obj in source.objects]
        self.objects = [(o, o.select_get(), o.hide_get(), o.hide_render) for o in objects]

    def restore(self, context: Any) -> None:
        """Bring it back."""
        for obj, selected, hidden, unrendered in self.objects:
            obj.hide_set(hidden)
            obj.hide_render = unrendered
            obj.select_set(selected)
        context.view_layer.objects.active = self.active


def _exchange(source: Source, copies: list[Any], result: Reduced) -> None:
    """Let result objects show another result of their source."""
    old = copies[0].data
    name = old.name
    data = source.data.copy()
    data = rebuild.shrink(data, result, source.matrix, weighted=source.weighted)
    for obj in copies:
        obj.data = data
    (bpy.data.meshes if read.is_mesh(old) else bpy.data.pointclouds).remove(old)
    data.name = name


class OBJECT_OT_salient_preview(bpy.types.Operator):
    """Show a draft that follows the target in the panel; Apply refines it, Esc removes it"""

    bl_idname = "object.salient_preview"
    bl_label = "Salient Preview"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender reads the class attribute

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Ask for what Simplify asks for."""
        return bool(ModalOperator.poll.__func__(cls, context))  # type: ignore[attr-defined]

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Begin, and stay until the preview is applied or discarded."""
        work.drop_later()
        context.view_layer.update()
        try:
            self.preview = Preview(context, context.scene.salient_simplify, work.host)
        except SalcoreError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        figures.preview = "shown"
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Follow the target; Esc discards."""
        escape = event.type == "ESC" and event.value == "PRESS"
        try:
            if escape or figures.preview == "discard":
                self.preview.discard(context)
                return self._end(context, {"CANCELLED"}, "Preview removed: nothing was changed")
            if figures.preview == "apply" and self.preview.task is None:
                self.preview.finish()
            if event.type == "TIMER":
                finishing = self.preview.finishing
                changed = self.preview.advance(context) == CHANGED
                if changed and finishing:
                    return self._apply(context)
                self._tell(context)
                for region in sidebars(context.window_manager.windows) if changed else ():
                    region.tag_redraw()
        except (SalcoreError, MemoryError) as error:
            self.report({"WARNING"}, str(error) or "not enough memory for this object")
            if not self.preview.copies or self.preview.finishing:
                self.preview.discard(context)
                return self._end(context, {"CANCELLED"}, "")
        except ReferenceError:  # an undo has taken the objects away
            return self._end(context, {"CANCELLED"}, "The preview is gone")
        return {"PASS_THROUGH"}

    def cancel(self, context: Any) -> None:
        """Clean up when Blender itself ends the operator, as on loading another file."""
        self.preview.apply()
        self._end(context, set(), "")

    def _apply(self, context: Any) -> set[str]:
        settings = context.scene.salient_simplify
        self.preview.apply()
        for note in filter(None, figures.notes.split("\n")):
            self.report({"WARNING"}, note)
        if settings.measure:
            shown = dict(vars(figures)) | {"preview": ""}
            request = {"task": "measure", "numbers": list(range(len(self.preview.sources)))}
            work.begin_later(request, partial(show_errors, shown))
        text = f"{figures.title}: {figures.points_after:,} of {figures.points_before:,} points"
        return self._end(context, {"FINISHED"}, text)

    def _tell(self, context: Any) -> None:
        task = self.preview.task
        if task is None or (self.preview.copies and not self.preview.finishing):  # too short
            stage, fraction, text = "", 0.0, "drag the target in the sidebar   |   Esc: remove it"
        else:
            stage, fraction = task.stage, task.fraction
            text = text_of_status(stage, fraction)
        if figures.tell(stage, fraction):
            context.workspace.status_text_set(f"{self.bl_label}: {text}")
            for region in sidebars(context.window_manager.windows):
                region.tag_redraw()

    def _end(self, context: Any, result: set[str], text: str) -> set[str]:
        context.window_manager.event_timer_remove(self._timer)
        figures.preview = ""
        figures.tell("", 0.0)
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        for region in sidebars(context.window_manager.windows):
            region.tag_redraw()
        if text:
            self.report({"INFO"}, text)
        return result


class OBJECT_OT_salient_preview_end(bpy.types.Operator):
    """Keep the result that is shown, or remove it"""

    bl_idname = "object.salient_preview_end"
    bl_label = "End Salient Preview"
    bl_options = {"INTERNAL"}  # noqa: RUF012 - Blender reads the class attribute
    __annotations__ = {"apply": bpy.props.BoolProperty(default=True)}

    @classmethod
    def poll(cls, context: Any) -> bool:
        """There must be a preview."""
        return bool(figures.preview)

    def execute(self, context: Any) -> set[str]:
        """Tell the preview, which looks at the next tick."""
        figures.preview = "apply" if self.apply else "discard"
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_preview, OBJECT_OT_salient_preview_end)
