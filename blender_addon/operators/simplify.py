# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplify objects."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import bpy

from ..geometry import results, sources
from ..geometry.sources import Source
from ..geometry.topology import Reduced
from ..settings import properties
from ..settings.figures import figures
from ..settings.layout import draw_clean, draw_kept, draw_output, draw_target
from .base import LARGE, SKIP_SAVE, ModalOperator, show_errors, whole_errors


class OBJECT_OT_salient_simplify(ModalOperator, bpy.types.Operator):
    """Cut the selected meshes and point clouds down to their salient points"""

    bl_idname = "object.salient_simplify"
    bl_label = "Salient Simplify"
    __annotations__ = {
        **properties.target_annotations(SKIP_SAVE),
        **properties.input_annotations(SKIP_SAVE),
        **properties.output_annotations(SKIP_SAVE),
        **properties.parameter_annotations(SKIP_SAVE),
    }

    def find(self, context: Any) -> list[Source]:
        """Return the selected geometries, with or without modifiers."""
        self._begun = time.perf_counter()
        self._errors: dict[str, Any] = {}
        return sources.selected(context, self.source)

    def check(self, source: Source) -> None:
        """Refuse what a result cannot replace."""
        if self.output == "IN_PLACE":
            results.require_replaceable(source)

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for one target."""
        return {
            "task": "simplify",
            "parameters": properties.parameters(self).as_dict(),
            "targets": [properties.target(self)],
            "number": number,
            "original_normals": self.original_normals,
            **sources.to_simplify(source, self),
        }

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Put the results into the scene."""
        self._names = ", ".join(source.object.name for source in self._sources)
        self._counts, self._triangles = [0, 0], [0, 0]
        for source, answer in zip(self._sources, answers, strict=True):
            result = Reduced.from_dict(answer["levels"][0])
            self.warn(source, result.notes)
            self._triangles[0] += answer["triangles"]
            self._triangles[1] += result.triangles
            self._counts[0] += source.count
            self._counts[1] += len(result.indices)
            if self.output == "IN_PLACE":
                results.replace(source, result)
                continue
            copies = results.add(source, result, "_simplified")
            if self.hide_source:
                results.hide(context, source.objects, copies)
        self._seconds = time.perf_counter() - self._begun

    def measuring(self) -> dict[str, Any] | None:
        """Ask for the errors."""
        if not self.measure:
            return None
        failed = self._task.failures
        numbers = [k for k in range(len(self._task.results)) if k not in failed]
        return {"task": "measure", "numbers": numbers}

    def measured(self, errors: list[dict[str, float]]) -> None:
        """Take the errors of each geometry."""
        self._errors = whole_errors(errors)

    def later(self) -> Any:
        """Add the errors to the figures that are shown by then."""
        return partial(show_errors, self._figures())

    def _figures(self) -> dict[str, Any]:
        """Return the figures but for the errors."""
        return {
            "title": self._names,
            "points_before": self._counts[0],
            "points_after": self._counts[1],
            "faces_before": self._triangles[0],
            "faces_after": self._triangles[1],
            "notes": "\n".join(self._warnings),
            "seconds": self._seconds,
        }

    def conclude(self, context: Any) -> None:
        """Show the figures."""
        before, after = self._counts
        text = f"{self._names}: {after:,} of {before:,} points ({after / before:.1%})"
        if self._triangles[0]:
            text += ", {1:,} of {0:,} triangles".format(*self._triangles)
        if self._errors:
            text += ", largest error {max_error:.4g}, mean {mean_error:.4g}".format(**self._errors)
        figures.show(**self._figures(), **self._errors)
        self.report({"INFO"}, text)

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation: of large objects only what takes no time."""
        large = self._points > LARGE
        if large and self.target == "MAX_ERROR":
            self.layout.label(text="Set the error in the sidebar, and press Simplify")
            return
        draw_target(self.layout, self)
        if large:
            self.layout.prop(self, "hide_source")
            return
        draw_output(self.layout, self)
        draw_clean(self.layout, self, None)
        draw_kept(self.layout, self)


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_simplify,)
