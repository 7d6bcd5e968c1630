# SPDX-License-Identifier: GPL-3.0-or-later
"""Make chains of levels of detail."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..geometry import results, sources
from ..geometry.read import HostError
from ..geometry.sources import Source
from ..geometry.topology import Reduced
from ..settings import properties
from .base import SKIP_SAVE, ModalOperator


class OBJECT_OT_salient_levels(ModalOperator, bpy.types.Operator):
    """Make levels of detail of the selected objects, from one analysis each"""

    bl_idname = "object.salient_levels"
    bl_label = "Salient Levels of Detail"
    __annotations__ = {
        "ratios": StringProperty(
            name="Ratios",
            description="Shares of the points to keep, one for each level",
            default="0.5 0.25 0.1 0.02",
            options=SKIP_SAVE,
        ),
        **properties.input_annotations(SKIP_SAVE),
        **properties.parameter_annotations(SKIP_SAVE),
    }

    def find(self, context: Any) -> list[Source]:
        """Return the selected geometries, with or without modifiers."""
        self._ratios = _numbers(self.ratios)
        return sources.selected(context, self.source)

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for all levels."""
        return {
            "task": "simplify",
            "parameters": properties.parameters(self).as_dict(),
            "targets": [{"ratio": ratio} for ratio in self._ratios],
            "measurable": None,
            **sources.geometry_with_mesh(source, self),
        }

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Put the levels into a collection for each source."""
        self._count = 0
        for source, answer in zip(self._sources, answers, strict=True):
            collection = bpy.data.collections.new(f"{source.object.name}_LODs")
            context.scene.collection.children.link(collection)
            for k, level in enumerate(answer["levels"]):
                result = Reduced.from_dict(level)
                self.warn(source, [f"level {k}: {note}" for note in result.notes])
                self._count += len(results.add(source, result, f"_LOD{k}", collection))

    def conclude(self, context: Any) -> None:
        """Tell what was made."""
        self.report({"INFO"}, f"{self._count} levels of detail made")

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        self.layout.prop(self, "ratios")


def _numbers(text: str) -> list[float]:
    """Return the numbers in a text, falling: the first level is the finest."""
    try:
        numbers = sorted((float(word) for word in text.replace(",", " ").split()), reverse=True)
    except ValueError:
        numbers = []
    if not numbers or not all(0.0 < number <= 1.0 for number in numbers):
        raise HostError(f"ratios={text!r}: give numbers above 0 and up to 1, such as 0.5 0.1")
    return numbers


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_levels,)
