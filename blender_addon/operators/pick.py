# SPDX-License-Identifier: GPL-3.0-or-later
"""Salient regions become a vertex group, an attribute or a selection: no clicking on them."""

from __future__ import annotations

import re
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..geometry import attributes, read, sources
from ..geometry.attributes import Layer
from ..geometry.read import HostError
from ..geometry.sources import Source
from ..settings import properties
from .base import SKIP_SAVE, ModalOperator

GROUP = "Salient Regions"


class OBJECT_OT_salient_pick_regions(ModalOperator, bpy.types.Operator):
    """Turn salient regions, chosen by number, into a vertex group or a selection"""

    bl_idname = "object.salient_pick_regions"
    bl_label = "Salient Pick Regions"
    __annotations__ = {
        **properties.region_annotations(SKIP_SAVE),
        **properties.parameter_annotations(SKIP_SAVE),
    }

    def find(self, context: Any) -> list[Source]:
        """Return the selected objects' own geometries."""
        self._chosen = read_numbers(self.regions)
        return sources.originals(context)

    def check(self, source: Source) -> None:
        """Refuse what must not be changed, or cannot be selected."""
        source.require_editable()
        if self.into == "SELECTION" and not read.is_mesh(source.data):
            raise HostError(
                f"{source.object.name}: vertices of a point cloud cannot be selected here; choose "
                "Vertex Group, which makes an attribute"
            )

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for the region of every point."""
        parameters = properties.parameters(self).as_dict()
        return {"task": "regions", "parameters": parameters, **sources.geometry(source)}

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Mark the points of the regions chosen."""
        told = []
        for source, answer in zip(self._sources, answers, strict=True):
            inside = np.isin(answer["values"], self._chosen)
            missing = [number for number in self._chosen if number >= answer["count"]]
            if missing:
                self.warn(source, [f"it has only {answer['count']} regions"])
            if not read.is_mesh(source.data):
                attributes.write_layer(source.data, Layer(GROUP, "BOOLEAN", "POINT", inside))
            elif self.into == "SELECTION":
                _select(source.data, inside)
            else:
                obj = source.object
                old = obj.vertex_groups.get(GROUP)
                if old is not None:
                    obj.vertex_groups.remove(old)
                group = obj.vertex_groups.new(name=GROUP)
                group.add(np.flatnonzero(inside).tolist(), 1.0, "REPLACE")
            source.data.update_tag()
            told.append(f"{source.object.name}: {int(inside.sum()):,} points")
        place = "the selection" if self.into == "SELECTION" else repr(GROUP)
        self._message = f"{', '.join(told)} in {place}"

    def conclude(self, context: Any) -> None:
        """Tell how many points there are."""
        self.report({"INFO"}, self._message)

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        self.layout.prop(self, "regions")
        self.layout.prop(self, "into")


def _select(mesh: Any, chosen: NDArray[np.bool_]) -> None:
    """Select vertices of a mesh, and the edges and polygons between them; nothing else."""
    edges = chosen[attributes.topology(mesh, ".edge_verts")].all(axis=1)
    corner = chosen[attributes.topology(mesh, ".corner_vert")]
    first = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", first)
    polygons = np.logical_and.reduceat(corner, first) if len(first) else first.astype(bool)
    mesh.vertices.foreach_set("select", chosen)
    mesh.edges.foreach_set("select", edges)
    mesh.polygons.foreach_set("select", polygons)


def read_numbers(text: str) -> list[int]:
    """Return the numbers in a text of numbers and ranges, such as "0-4, 7".

    Raises
    ------
    HostError
        If it holds anything else, or nothing.
    """
    words = re.sub(r"\s*-\s*", "-", text).replace(",", " ").replace(";", " ").split()
    numbers: list[int] = []
    for word in words:
        found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", word)
        if found is None:
            numbers = []
            break
        low, high = int(found[1]), int(found[2] or found[1])
        numbers += range(low, min(high, low + MAX_REGIONS) + 1)
    if not numbers:
        raise HostError(f"regions {text!r}: give numbers or ranges of regions, such as 0-4 or 0 2")
    return numbers


MAX_REGIONS = 1_000_000
"""Longest range."""

CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_pick_regions,)
