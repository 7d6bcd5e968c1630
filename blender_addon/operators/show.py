# SPDX-License-Identifier: GPL-3.0-or-later
"""Saliency, regions and interest points, stored on the objects and shown in colour."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import attributes, bridge, properties, sources
from .attributes import Layer
from .operators import Worker
from .salcore import Progress, region_colors, saliency_colors
from .sources import Source

NOT_KEPT = {"SKIP_SAVE"}
MATERIAL = "Salient Colors"
GROUP = "Saliency"
LEVELS = 255
"""Steps of the weights in the vertex group: Blender is told one weight for many at once."""
INTEREST_COLOR, OTHER_COLOR = (0.9, 0.1, 0.05), (0.35, 0.35, 0.38)


class Shower(Worker):
    """An operator that stores something about every point and shows it."""

    color = ""
    """Name of the colour attribute."""

    def steps(self, source: Source) -> Generator[Progress, None, list[Layer]]:
        """Yield progress and return the attributes to store, the colours (n, 3) last."""
        raise NotImplementedError

    def work(self, context: Any) -> Generator[Progress, None, Any]:
        """Work out what to show for every selected geometry."""
        found = sources.originals(context)
        return (yield from sources.each(found, self.steps, Source.require_editable))

    def commit(self, context: Any, outcome: list[tuple[Source, list[Layer]]]) -> None:
        """Store the attributes and have the view show them."""
        for source, layers in outcome:
            for layer in layers:
                attributes.write_layer(source.data, layer)
            if bridge.is_mesh(source.data):
                source.data.attributes.active_color_name = self.color
            else:
                for obj in source.objects:
                    _show_material(obj, self.color)
            source.data.update_tag()
        _show_colors(context, all(bridge.is_mesh(source.data) for source, _ in outcome))
        names = ", ".join(source.object.name for source, _ in outcome)
        self._said = f"{names}: see the attribute {self.color!r}"

    def conclude(self, context: Any) -> None:
        """Tell where it is."""
        self.report({"INFO"}, self._said)

    def draw(self, context: Any) -> None:
        """Draw the panel of the last operation."""
        self.layout.use_property_split = True
        if "alpha" in self.__annotations__:
            self.layout.prop(self, "alpha")


def layers_of(name: str, kind: str, values: NDArray[Any], color: str, rgb: Any) -> list[Layer]:
    """Return an attribute and its colours."""
    rgba = np.ones((len(values), 4), dtype=np.float32)
    rgba[:, :3] = rgb
    return [Layer(name, kind, "POINT", values), Layer(color, "FLOAT_COLOR", "POINT", rgba)]


class OBJECT_OT_salient_show_saliency(Shower, bpy.types.Operator):
    """Store the saliency of every point, also as a vertex group, and show it in colour"""

    bl_idname = "object.salient_show_saliency"
    bl_label = "Salient Show Saliency"
    color = "Saliency Color"
    __annotations__ = properties.parameter_annotations(NOT_KEPT)

    def steps(self, source: Source) -> Generator[Progress, None, list[Layer]]:
        """Return saliency, blue to red."""
        analysis = yield from sources.analysis_steps(source, properties.parameters(self))
        saliency = analysis.saliency
        return layers_of("saliency", "FLOAT", saliency, self.color, saliency_colors(saliency))

    def commit(self, context: Any, outcome: list[tuple[Source, list[Layer]]]) -> None:
        """Store also the vertex group that Blender's own modifiers understand."""
        super().commit(context, outcome)
        for source, layers in outcome:
            if bridge.is_mesh(source.data):
                _set_group(source.object, np.asarray(layers[0].values))


class OBJECT_OT_salient_show_regions(Shower, bpy.types.Operator):
    """Store the region of like saliency of every point, and show each in a colour of its own"""

    bl_idname = "object.salient_show_regions"
    bl_label = "Salient Show Regions"
    color = "Region Color"
    __annotations__ = properties.parameter_annotations(NOT_KEPT)

    def steps(self, source: Source) -> Generator[Progress, None, list[Layer]]:
        """Return regions."""
        analysis = yield from sources.analysis_steps(source, properties.parameters(self))
        regions = analysis.regions
        return layers_of("saliency_region", "INT", regions, self.color, region_colors(regions))


class OBJECT_OT_salient_show_interest(Shower, bpy.types.Operator):
    """Mark the points that a threshold keeps, and show them in red"""

    bl_idname = "object.salient_show_interest"
    bl_label = "Salient Show Interest Points"
    color = "Interest Color"
    __annotations__ = {
        "alpha": properties.target_annotations(NOT_KEPT)["alpha"],
        **properties.parameter_annotations(NOT_KEPT),
    }

    def steps(self, source: Source) -> Generator[Progress, None, list[Layer]]:
        """Return interest points, red."""
        result = yield from sources.simplification_steps(
            source, properties.parameters(self), {"alpha": self.alpha}
        )
        kept = np.zeros(len(result.source), dtype=bool)
        kept[result.indices] = True
        rgb = np.where(kept[:, None], INTEREST_COLOR, OTHER_COLOR)
        return layers_of("interest_point", "BOOLEAN", kept, self.color, rgb)


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


def _show_material(obj: Any, attribute: str) -> None:
    """Give a point cloud's object a material that shows an attribute; its data keeps its own."""
    if not obj.material_slots:
        obj.data.materials.append(None)
    slot = obj.material_slots[0]
    slot.link = "OBJECT"
    slot.material = material(attribute)


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


def _show_colors(context: Any, solid: bool) -> None:
    """Have the 3D views show colour attributes: Solid can for meshes, only materials for clouds."""
    screen = context.screen
    for area in screen.areas if screen is not None else ():
        if area.type == "VIEW_3D":
            shading = area.spaces.active.shading
            if not solid and shading.type in {"SOLID", "WIREFRAME"}:
                shading.type = "MATERIAL"
            elif shading.type == "SOLID":
                shading.color_type = "VERTEX"


CLASSES: tuple[Any, ...] = (
    OBJECT_OT_salient_show_saliency,
    OBJECT_OT_salient_show_regions,
    OBJECT_OT_salient_show_interest,
)
