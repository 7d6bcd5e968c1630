# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplify objects, and make chains of levels of detail."""

from __future__ import annotations

import time
from collections.abc import Generator
from functools import partial
from typing import Any

import bpy
from bpy.props import StringProperty

from . import properties, results, sources
from .bridge import HostError
from .drawing import draw_output, draw_target
from .operators import Worker
from .salcore import Deviation, Progress, Simplification
from .salcore.progress import part, staged
from .sources import Source

NOT_KEPT = {"SKIP_SAVE"}
"""Operators remember nothing: the panel's settings hold, or what a script says."""


def find_sources(operator: Any, context: Any) -> list[Source]:
    """Return the selected geometries, with or without modifiers as the operator says."""
    if operator.source == "EVALUATED":
        return sources.evaluated(context)
    return sources.originals(context)


class OBJECT_OT_salient_simplify(Worker, bpy.types.Operator):
    """Cut the selected meshes and point clouds down to their salient points"""

    bl_idname = "object.salient_simplify"
    bl_label = "Salient Simplify"
    __annotations__ = {
        **properties.target_annotations(NOT_KEPT),
        **properties.input_annotations(NOT_KEPT),
        **properties.output_annotations(NOT_KEPT),
        **properties.parameter_annotations(NOT_KEPT),
    }

    def work(self, context: Any) -> Generator[Progress, None, Any]:
        """Simplify every selected geometry."""
        self._begun = time.perf_counter()
        parameters, target = properties.parameters(self), properties.target(self)
        found = find_sources(self, context)
        steps = partial(
            sources.simplification_steps,
            parameters=parameters,
            target=target,
            protect=self.protect,
            keep_seams=self.keep_seams,
        )
        check = results.require_replaceable if self.output == "IN_PLACE" else None
        return (yield from sources.each(found, steps, check))

    def commit(self, context: Any, outcome: list[tuple[Source, Simplification]]) -> None:
        """Put the results into the scene."""
        self._outcome = outcome
        self._errors: list[Deviation] = []
        for source, result in outcome:
            if self.output == "IN_PLACE":
                results.replace(source, result)
                continue
            twins = results.add(source, result, "_simplified")
            if self.hide_source:
                results.hide(context, source.objects, twins)
            source.discard()
        self._seconds = time.perf_counter() - self._begun

    def afterwards(self, context: Any) -> Generator[Progress, None, None] | None:
        """Measure the errors."""
        return self._measure() if self.measure else None

    def _measure(self) -> Generator[Progress, None, None]:
        count = len(self._outcome)
        for k, (_, result) in enumerate(self._outcome):
            steps = staged("Error", k / count, (k + 1) / count, result.errors_steps())
            self._errors.append((yield from steps).surface)

    def conclude(self, context: Any) -> None:
        """Show the figures."""
        before = sum(len(result.source) for _, result in self._outcome)
        after = sum(len(result.indices) for _, result in self._outcome)
        figures = context.window_manager.salient_simplify
        figures.title = ", ".join(source.object.name for source, _ in self._outcome)
        figures.points_before, figures.points_after = before, after
        figures.seconds, figures.measured = self._seconds, bool(self._errors)
        text = f"{figures.title}: {after:,} of {before:,} points ({after / before:.1%})"
        if self._errors:
            figures.max_error = max(error.max for error in self._errors)
            total = sum(
                error.mean * len(result.source)
                for error, (_, result) in zip(self._errors, self._outcome, strict=True)
            )
            figures.mean_error = total / before
            text += f", largest error {figures.max_error:.4g}, mean {figures.mean_error:.4g}"
        self.report({"INFO"}, text)

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        draw_target(self.layout, self)
        draw_output(self.layout, self)


class OBJECT_OT_salient_levels(Worker, bpy.types.Operator):
    """Make levels of detail of the selected objects, from one analysis each"""

    bl_idname = "object.salient_levels"
    bl_label = "Salient Levels of Detail"
    __annotations__ = {
        "ratios": StringProperty(
            name="Ratios",
            description="Shares of the points to keep, one for each level",
            default="0.5 0.25 0.1 0.02",
            options=NOT_KEPT,
        ),
        **properties.input_annotations(NOT_KEPT),
        **properties.parameter_annotations(NOT_KEPT),
    }

    def work(self, context: Any) -> Generator[Progress, None, Any]:
        """Work out all levels of every selected geometry."""
        parameters, ratios = properties.parameters(self), _ratios(self.ratios)

        def levels(source: Source) -> Generator[Progress, None, list[Simplification]]:
            done = []
            for k, ratio in enumerate(ratios):
                steps = sources.simplification_steps(
                    source, parameters, {"ratio": ratio}, self.protect, self.keep_seams
                )
                begin = 0.0 if k == 0 else 0.9 + 0.1 * k / len(ratios)
                end = 0.9 + 0.1 * (k + 1) / len(ratios)
                done.append((yield from part(begin, end, steps)))
            return done

        return (yield from sources.each(find_sources(self, context), levels))

    def commit(self, context: Any, outcome: list[tuple[Source, list[Simplification]]]) -> None:
        """Put the levels into a collection for each source."""
        self._count = 0
        for source, levels in outcome:
            collection = bpy.data.collections.new(f"{source.object.name}_LODs")
            context.scene.collection.children.link(collection)
            for k, result in enumerate(levels):
                self._count += len(results.add(source, result, f"_LOD{k}", collection))
            source.discard()

    def conclude(self, context: Any) -> None:
        """Tell what was made."""
        self.report({"INFO"}, f"{self._count} levels of detail made")

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        self.layout.prop(self, "ratios")


def _ratios(text: str) -> list[float]:
    """Return the numbers in a text, falling: the first level is the finest."""
    try:
        numbers = sorted((float(word) for word in text.replace(",", " ").split()), reverse=True)
    except ValueError:
        numbers = []
    if not numbers or not all(0.0 < number <= 1.0 for number in numbers):
        raise HostError(f"ratios={text!r}: give numbers above 0 and up to 1, such as 0.5 0.1")
    return numbers


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_simplify, OBJECT_OT_salient_levels)
