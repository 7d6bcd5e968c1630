# SPDX-License-Identifier: GPL-3.0-or-later
"""Live simplification: the order of removal as attributes, and a node group that cuts through it.

Every point knows its rank and its parent, the point it goes into. A slider says how many ranks
stay: continuous, without a level being stored. (Levels to switch between would cost memory for
each and jump from one to the next.)
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.props import FloatProperty

from ..geometry import attributes, live_nodes, read, sources
from ..geometry.attributes import Layer
from ..geometry.live_nodes import APART, CORNER, INDEX, PARENT, RANK, Kind
from ..geometry.sources import Source
from ..settings import properties
from .base import SKIP_SAVE, ModalOperator

MODIFIER = "Salient Live"
DEFORMING = {
    "ARMATURE", "CAST", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM",
    "LAPLACIANSMOOTH", "LATTICE", "MESH_CACHE", "MESH_DEFORM", "MESH_SEQUENCE_CACHE", "SHRINKWRAP",
    "SIMPLE_DEFORM", "SMOOTH", "SURFACE_DEFORM", "WARP", "WAVE", "NORMAL_EDIT", "WEIGHTED_NORMAL",
    "UV_PROJECT", "UV_WARP", "VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX",
    "VERTEX_WEIGHT_PROXIMITY", "DATA_TRANSFER",
}  # fmt: skip
"""Modifiers that leave points, edges and polygons as they are."""


class OBJECT_OT_salient_live(ModalOperator, bpy.types.Operator):
    """Store the order of removal, and add a modifier whose slider cuts at once, without refining"""

    bl_idname = "object.salient_live"
    bl_label = "Salient Live Simplify"
    __annotations__ = {
        "ratio": FloatProperty(
            name="Ratio",
            description="Share of the points that stay, to begin with",
            default=0.1,
            min=0.0,
            max=1.0,
            subtype="FACTOR",
            options=SKIP_SAVE,
        ),
        **properties.keep_annotations(SKIP_SAVE),
        **properties.parameter_annotations(SKIP_SAVE),
    }

    def find(self, context: Any) -> list[Source]:
        """Return the selected objects' own geometries."""
        return sources.originals(context)

    def check(self, source: Source) -> None:
        """Refuse what must not be changed."""
        source.require_editable()

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for the ranks of the points."""
        return {
            "task": "rank",
            "parameters": properties.parameters(self).as_dict(),
            **sources.geometry_with_mesh(source, self),
        }

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Store the ranks and add the modifiers."""
        for source, ranking in zip(self._sources, answers, strict=True):
            data = source.data
            faces = read.is_mesh(data) and len(data.polygons) > 0
            apart = ranking["apart"] if faces else np.empty(0)
            kind = live_nodes.kind_of(data, not apart.any()) if faces else Kind(False)
            numbers = np.arange(source.count, dtype=np.int32)
            for name, values in (
                (RANK, ranking["rank"]),
                (PARENT, ranking["parent"]),
                (INDEX, numbers),
            ):
                attributes.write_layer(data, Layer(name, "INT", "POINT", values))
            if apart.any():
                attributes.write_layer(data, Layer(APART, "FLOAT", "POINT", apart))
            inputs = {"Ratio": self.ratio, "Steps": ranking["generations"], "Points": source.count}
            inputs["Least"] = ranking["least"]
            if kind.corners:
                attributes.write_layer(data, Layer(CORNER, "INT", "CORNER", ranking["corner"]))
                inputs["Corners"] = len(data.loops)
            for obj in source.objects:
                modifier = _modifier(obj)
                modifier.node_group = live_nodes.node_group(kind)
                for name, value in inputs.items():
                    live_nodes.set_input(modifier, name, value)
                obj.update_tag()
            data.update_tag()
        names = ", ".join(obj.name for source in self._sources for obj in source.objects)
        self._message = (
            f"{names}: slide Ratio in the modifier {MODIFIER!r}, which shows the cut unrefined"
        )

    def conclude(self, context: Any) -> None:
        """Tell where the slider is."""
        self.report({"INFO"}, self._message)

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        self.layout.prop(self, "ratio")


def _modifier(obj: Any) -> Any:
    """Return the live modifier of an object, above all that add or remove geometry."""
    modifier = obj.modifiers.get(MODIFIER)
    if modifier is None or modifier.type != "NODES":
        modifier = obj.modifiers.new(MODIFIER, "NODES")
    own = obj.modifiers.find(modifier.name)
    first = next((k for k, m in enumerate(obj.modifiers) if m.type not in DEFORMING), own)
    if first < own:
        obj.modifiers.move(own, first)
    return modifier


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_live,)
