# SPDX-License-Identifier: GPL-3.0-or-later
"""Make chains of levels of detail."""

from __future__ import annotations

import re
from typing import Any

import bpy

from ..geometry import results, sources
from ..geometry.read import HostError
from ..geometry.sources import Source
from ..geometry.topology import Reduced
from ..settings import properties
from .base import SKIP_SAVE, ModalOperator

ORIGINAL = "salient_original"
"""Custom property of a collection of levels: the object that they are levels of."""
GAP = 1.2
"""Distance between levels side by side, in widths of the original."""


class OBJECT_OT_salient_levels(ModalOperator, bpy.types.Operator):
    """Make levels of detail below the selected objects, from one analysis each"""

    bl_idname = "object.salient_levels"
    bl_label = "Salient Levels of Detail"
    __annotations__ = {
        **properties.level_annotations(SKIP_SAVE),
        **properties.input_annotations(SKIP_SAVE),
        **properties.parameter_annotations(SKIP_SAVE),
    }

    def find(self, context: Any) -> list[Source]:
        """Return the selected geometries, with or without modifiers."""
        self._targets = read_levels(self.ratios, self.levels_by.lower())
        return sources.selected(context, self.source)

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for all levels."""
        return {
            "task": "simplify",
            "parameters": properties.parameters(self).as_dict(),
            "targets": self._targets,
            "number": number,
            **sources.to_simplify(source, self),
        }

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Put the levels into a collection for each source, in the place of earlier ones."""
        self._count = 0
        for source, answer in zip(self._sources, answers, strict=True):
            collection = _emptied_collection(context, source.object)
            for k, level in enumerate(answer["levels"], 1):
                result = Reduced.from_dict(level)
                self.warn(source, [f"LOD{k}: {note}" for note in result.notes])
                copies = results.add(source, result, f"_LOD{k}", collection)
                context.view_layer.update()
                for obj, copy in zip(source.objects, copies, strict=True):
                    self._place(obj, copy, k)
                self._count += len(copies)

    def _place(self, obj: Any, copy: Any, number: int) -> None:
        """Hide a level, or let it stand beside the original."""
        if self.arrange == "BESIDE":
            width = max(obj.dimensions.x, 1e-6)
            place = obj.matrix_world.copy()
            place.translation.x += GAP * number * width
            copy.matrix_world = place
        else:
            copy.hide_set(True)
            copy.hide_render = True

    def conclude(self, context: Any) -> None:
        """Tell what was made."""
        self.report({"INFO"}, f"{self._count} levels of detail made; the original is level 0")

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        for name in ("levels_by", "ratios", "arrange"):
            self.layout.prop(self, name)


def _emptied_collection(context: Any, obj: Any) -> Any:
    """Return a collection with an object alone; levels that an earlier run put there are removed.

    The object stays in its own collections, too.
    """
    found = next((c for c in bpy.data.collections if c.get(ORIGINAL) == obj), None)
    if found is None:
        found = bpy.data.collections.new(f"{obj.name}_LODs")
        found[ORIGINAL] = obj
        context.scene.collection.children.link(found)
        found.objects.link(obj)
    old = [other for other in found.objects if re.search(r"_LOD[1-9]\d*(\.\d+)?$", other.name)]
    data = {other.data for other in old}
    bpy.data.batch_remove(old)
    bpy.data.batch_remove([block for block in data if not block.users])
    return found


def read_levels(text: str, by: str) -> list[dict[str, float]]:
    """Return the targets in a text, the finest first.

    Parameters
    ----------
    text : str
        Numbers between spaces, semicolons or commas; "50%" is 0.5, and with semicolons "0,5" is.
    by : str
        "ratio", "faces" or "max_error".

    Raises
    ------
    HostError
        If a number cannot be read or means nothing.
    """
    plain = text.replace(",", ".").replace(";", " ") if ";" in text else text.replace(",", " ")
    words = re.sub(r"\s+%", "%", plain).split()
    try:
        numbers = [float(w.removesuffix("%")) * (0.01 if w.endswith("%") else 1.0) for w in words]
    except ValueError:
        numbers = []
    limits = {"ratio": (0.0, 1.0), "faces": (0.0, 2**31 - 1), "max_error": (0.0, 1e30)}
    low, high = limits[by]
    if not numbers or not all(low < number <= high for number in numbers):
        wanted = {
            "ratio": "numbers above 0 and up to 1, such as 0.5 0.1, or 50% 10%",
            "faces": "numbers of triangles above 0, such as 20000 5000",
            "max_error": "lengths above 0, such as 0.001 0.01",
        }
        raise HostError(f"levels {text!r}: give {wanted[by]}")
    if by == "faces":
        numbers = [max(round(number), 1) for number in numbers]
    return [{by: number} for number in sorted(numbers, reverse=by != "max_error")]


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_levels,)
