# SPDX-License-Identifier: GPL-3.0-or-later
"""Saliency, regions and interest points, stored on the objects and shown in colour."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..geometry import attributes, point_nodes, read, sources
from ..geometry.attributes import Layer
from ..geometry.read import HostError
from ..geometry.sources import Source
from ..settings import properties
from .base import SKIP_SAVE, ModalOperator

MATERIAL = "Salient Colors"
TABLE_OF_REGIONS = "salient_regions"
"""Custom property of data: rows of the most salient regions, as JSON."""
GROUP = "Saliency"
LEVELS = 255
"""Steps of the weights in the vertex group: Blender is told one weight for many at once."""


class Shown(NamedTuple):
    """What one operator stores about every point."""

    task: str
    """Of the worker's requests."""
    attribute: str
    type: str
    color: str
    """Name of the colour attribute."""
    label: str
    description: str
    option: str = ""
    """Of `OPTIONS`, what else it depends on."""


TABLE = (
    Shown("saliency", "saliency", "FLOAT", "Saliency Color", "Salient Show Saliency",
        "Store the saliency of every point, and show it in colour, from blue to red"),
    Shown("regions", "saliency_region", "INT", "Region Color", "Salient Show Regions",
        "Store the region of every point, numbered by falling saliency, and show each in colour",
        option="by_saliency"),
    Shown("interest", "interest_point", "BOOLEAN", "Interest Color", "Salient Show Interest Points",
        "Mark the points that a threshold keeps, and show them in red", option="alpha"),
)  # fmt: skip


class ShowAttribute(ModalOperator):
    """An operator that stores something about every point and shows it."""

    shown: Shown

    def find(self, context: Any) -> list[Source]:
        """Return the selected objects' own geometries."""
        return sources.originals(context)

    def check(self, source: Source) -> None:
        """Refuse what must not be changed."""
        source.require_editable()

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for values and colours of every point."""
        request = {
            "task": self.shown.task,
            "parameters": properties.parameters(self).as_dict(),
            **sources.geometry(source),
        }
        option = self.shown.option
        return request | {option: getattr(self, option)} if option else request

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Store the attributes and have the view show them."""
        shown = self.shown
        for source, answer in zip(self._sources, answers, strict=True):
            data, values = source.data, answer["values"]
            attributes.write_layer(data, Layer(shown.attribute, shown.type, "POINT", values))
            colors = Layer(shown.color, "FLOAT_COLOR", "POINT", answer["colors"])
            attributes.write_layer(data, colors)
            if read.is_mesh(data):
                data.attributes.active_color_name = shown.color
            if not _has_faces(data):
                for obj in source.objects:
                    show_points(obj, shown.color, answer["radius"])
            if "table" in answer:
                data[TABLE_OF_REGIONS] = json.dumps(answer["table"])
            data.update_tag()
        show_colors(context, all(_has_faces(source.data) for source in self._sources))
        names = ", ".join(source.object.name for source in self._sources)
        self._message = f"{names}: see the attribute {shown.color!r}"
        loose = [read.is_mesh(s.data) and not _has_faces(s.data) for s in self._sources]
        if any(loose):
            modifier = point_nodes.MODIFIER
            self._message += f"; turn the modifier {modifier!r} off for an export of the vertices"
        if shown.task == "regions":
            counts = ", ".join(str(answer["count"]) for answer in answers)
            self._message = f"{names}: {counts} regions, number 0 is the most salient"

    def conclude(self, context: Any) -> None:
        """Tell where it is."""
        self.report({"INFO"}, self._message)

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        if self.shown.option:
            self.layout.prop(self, self.shown.option)


class OBJECT_OT_salient_vertex_group(ModalOperator, bpy.types.Operator):
    """Store the saliency of every vertex as a vertex group, which Decimate and others understand"""

    bl_idname = "object.salient_vertex_group"
    bl_label = "Salient Vertex Group for Decimate"
    __annotations__ = properties.parameter_annotations(SKIP_SAVE)

    def find(self, context: Any) -> list[Source]:
        """Return the selected objects' own geometries."""
        return sources.originals(context)

    def check(self, source: Source) -> None:
        """Refuse what must not be changed, or has no groups."""
        source.require_editable()
        if not read.is_mesh(source.data):
            raise HostError(
                f"{source.object.name}: point clouds have no vertex groups; Show Saliency stores "
                "an attribute"
            )

    def request(self, source: Source, number: int) -> dict[str, Any]:
        """Ask for the saliency of every point."""
        parameters = properties.parameters(self).as_dict()
        return {"task": "saliency", "parameters": parameters, **sources.geometry(source)}

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Set the weights."""
        for source, answer in zip(self._sources, answers, strict=True):
            _set_group(source.object, answer["values"])

    def conclude(self, context: Any) -> None:
        """Tell how to use it."""
        self.report({"INFO"}, f"Give Decimate the vertex group {GROUP!r}, inverted")

    def draw(self, context: Any) -> None:
        """Draw nothing."""


def _operator(shown: Shown) -> Any:
    """Return the operator of one row of the table."""
    options = properties.parameter_annotations(SKIP_SAVE)
    if shown.option:
        options = {shown.option: properties.show_annotations(SKIP_SAVE)[shown.option], **options}
    return type(
        f"OBJECT_OT_salient_show_{shown.task}",
        (ShowAttribute, bpy.types.Operator),
        {
            "__doc__": shown.description,
            "__annotations__": options,
            "bl_idname": f"object.salient_show_{shown.task}",
            "bl_label": shown.label,
            "shown": shown,
        },
    )


def _set_group(obj: Any, weights: NDArray[Any]) -> None:
    """Set the vertex group of saliency."""
    group = obj.vertex_groups.get(GROUP) or obj.vertex_groups.new(name=GROUP)
    levels = np.rint(weights * LEVELS).astype(np.int64)
    order = np.argsort(levels, kind="stable")
    bounds = np.searchsorted(levels[order], np.arange(LEVELS + 2))
    for level in range(LEVELS + 1):
        members = order[bounds[level] : bounds[level + 1]]
        if len(members):
            group.add(members.tolist(), level / LEVELS, "REPLACE")


def _has_faces(data: Any) -> bool:
    return read.is_mesh(data) and len(data.polygons) > 0


def show_points(obj: Any, attribute: str, radius: float) -> None:
    """Show the points of an object in the colours of an attribute; its data keep their material."""
    if not obj.material_slots:
        obj.data.materials.append(None)
    slot = obj.material_slots[0]
    slot.link = "OBJECT"
    slot.material = material(attribute)
    point_nodes.show(obj, slot.material, radius)


def material(attribute: str) -> Any:
    """Return a material that shows a colour attribute, made where it is missing."""
    name = f"{MATERIAL}: {attribute}"
    found = bpy.data.materials.get(name)
    if found is None:
        found = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0):
            found.use_nodes = True
        nodes = found.node_tree.nodes
        shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
        color = nodes.new("ShaderNodeAttribute")
        color.attribute_name = attribute
        color.location.x = shader.location.x - 300.0
        shader.inputs["Roughness"].default_value = 0.7
        found.node_tree.links.new(color.outputs["Color"], shader.inputs["Base Color"])
    return found


def show_colors(context: Any, solid: bool) -> None:
    """Have the 3D views show colour attributes: Solid can for meshes, only materials for clouds."""
    screen = context.screen
    for area in screen.areas if screen is not None else ():
        if area.type == "VIEW_3D":
            shading = area.spaces.active.shading
            if not solid:  # the outline of something selected goes round each single point
                area.spaces.active.overlay.show_outline_selected = False
            if not solid and shading.type in {"SOLID", "WIREFRAME"}:
                shading.type = "MATERIAL"
            elif shading.type == "SOLID":
                shading.color_type = "VERTEX"


CLASSES: tuple[Any, ...] = (*map(_operator, TABLE), OBJECT_OT_salient_vertex_group)
