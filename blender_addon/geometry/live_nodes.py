# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups that cut a geometry at a rank: the live modifier's inside, and its inputs.

On clouds and loose points the points beyond the rank are deleted. On meshes every one of them
moves to its nearest living ancestor and is merged there, so the slider gives the very mesh that
Simplify gives.
"""

from __future__ import annotations

from typing import Any

import bpy

RANK, PARENT, ANCESTOR = "salient_rank", "salient_parent", "salient_ancestor"
GROUPS = {False: "Salient Live Points", True: "Salient Live Mesh"}
ROW = 4096.0
"""Points in a row of the grid on which points of one ancestor meet."""
VERSION = 1
"""Of the node groups; one of another version is left alone and a new one made."""


def set_input(modifier: Any, name: str, value: Any) -> None:
    """Set an input of a nodes modifier by the name of its socket."""
    if hasattr(modifier, "properties"):  # from Blender 5.2 on
        getattr(modifier.properties.inputs, _identifier(modifier, name)).value = value
    else:
        modifier[_identifier(modifier, name)] = value


def input_path(modifier: Any, name: str) -> str:
    """Return the data path of an input, for keyframes and drivers."""
    start, socket = f'modifiers["{modifier.name}"]', _identifier(modifier, name)
    if hasattr(modifier, "properties"):
        return f"{start}.properties.inputs.{socket}.value"
    return f'{start}["{socket}"]'


def _identifier(modifier: Any, name: str) -> str:
    items = modifier.node_group.interface.items_tree
    return next(i.identifier for i in items if i.name == name and i.in_out == "INPUT")


def node_group(faces: bool) -> Any:
    """Return the node group for meshes with faces, or for points; made where it is missing."""
    name = GROUPS[faces]
    for group in bpy.data.node_groups:
        if group.name.startswith(name) and group.get("salient_version") == VERSION:
            return group
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group["salient_version"] = VERSION
    group.is_modifier = True
    _Builder(group).build(faces)
    return group


class _Builder:
    """Builds the node groups."""

    def __init__(self, group: Any) -> None:
        self.group = group
        self.place = 0

    def build(self, faces: bool) -> None:
        """Fill the group: keep the first ranks, and delete or merge the rest."""
        sockets = self.group.interface
        sockets.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
        ratio = sockets.new_socket("Ratio", in_out="INPUT", socket_type="NodeSocketFloat")
        ratio.subtype, ratio.min_value, ratio.max_value = "FACTOR", 0.0, 1.0
        ratio.default_value = 0.1
        ratio.description = "Share of the points that stay"
        if faces:
            steps = sockets.new_socket("Steps", in_out="INPUT", socket_type="NodeSocketInt")
            steps.min_value, steps.default_value = 0, 24
            steps.description = "Doublings that lead every point to its last ancestor"
            steps.hide_in_modifier = True
        sockets.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        inputs, outputs = self.node("NodeGroupInput"), self.node("NodeGroupOutput")
        gone = self.gone(inputs.outputs["Geometry"], inputs.outputs["Ratio"], faces)
        if faces:
            end = self.merge(inputs.outputs["Geometry"], inputs.outputs["Steps"], gone)
        else:
            delete = self.node("GeometryNodeDeleteGeometry")
            self.link(inputs.outputs["Geometry"], delete.inputs["Geometry"])
            self.link(gone, delete.inputs["Selection"])
            end = delete.outputs["Geometry"]
        outputs.location.x = 200.0 * self.place
        self.link(end, outputs.inputs["Geometry"])

    def gone(self, geometry: Any, ratio: Any, faces: bool) -> Any:
        """Return the field of points whose rank is beyond the ratio: rank > max(share, 1) - 1/2."""
        size = self.node("GeometryNodeAttributeDomainSize")
        self.link(geometry, size.inputs["Geometry"])
        if not faces:
            # One group serves clouds and loose vertices: the component that is there counts.
            cloud = self.node("GeometryNodeAttributeDomainSize")
            cloud.component = "POINTCLOUD"
            self.link(geometry, cloud.inputs["Geometry"])
            count = self.math("ADD", size.outputs["Point Count"], cloud.outputs["Point Count"])
        else:
            count = size.outputs["Point Count"]
        share = self.math("ROUND", self.math("MULTIPLY", count, ratio))
        limit = self.math("SUBTRACT", self.math("MAXIMUM", share, 1.0), 0.5)
        return self.math("GREATER_THAN", self.named(RANK), limit)

    def merge(self, geometry: Any, steps: Any, gone: Any) -> Any:
        """Return the mesh whose points that are gone have moved into their last ancestors."""
        index = self.node("GeometryNodeInputIndex").outputs["Index"]
        first = self.switch(gone, index, self.named(PARENT))
        stored = self.store(geometry, first)
        begin, end = self.node("GeometryNodeRepeatInput"), self.node("GeometryNodeRepeatOutput")
        begin.pair_with_output(end)
        self.link(steps, begin.inputs["Iterations"])
        self.link(stored, begin.inputs["Geometry"])
        further = self.at_index(self.named(ANCESTOR), self.named(ANCESTOR))
        self.link(self.store(begin.outputs["Geometry"], further), end.inputs["Geometry"])
        # Points merge by distance, which depends on the scale. So they meet on a grid of whole
        # numbers, one place for every ancestor, and take its position afterwards.
        ancestor = self.named(ANCESTOR)
        grid = self.node("ShaderNodeCombineXYZ")
        self.link(self.math("MODULO", ancestor, ROW), grid.inputs["X"])
        row = self.math("FLOOR", self.math("DIVIDE", ancestor, ROW))
        self.link(row, grid.inputs["Y"])
        merge = self.node("GeometryNodeMergeByDistance")
        merge.inputs["Distance"].default_value = 0.1
        self.link(self.move(end.outputs["Geometry"], grid.outputs["Vector"]), merge.inputs[0])
        there = self.node("GeometryNodeSampleIndex")
        there.data_type, there.domain = "FLOAT_VECTOR", "POINT"
        self.link(geometry, there.inputs["Geometry"])
        self.link(self.node("GeometryNodeInputPosition").outputs[0], there.inputs["Value"])
        self.link(self.named(ANCESTOR), there.inputs["Index"])
        clean = self.node("GeometryNodeRemoveAttribute")
        clean.inputs["Name"].default_value = ANCESTOR
        self.link(self.move(merge.outputs[0], there.outputs["Value"]), clean.inputs["Geometry"])
        return clean.outputs["Geometry"]

    def move(self, geometry: Any, position: Any) -> Any:
        """Return the geometry with other positions."""
        node = self.node("GeometryNodeSetPosition")
        self.link(geometry, node.inputs["Geometry"])
        self.link(position, node.inputs["Position"])
        return node.outputs["Geometry"]

    def node(self, kind: str) -> Any:
        """Add a node, to the right of the last one."""
        node = self.group.nodes.new(kind)
        node.location.x = 200.0 * self.place
        self.place += 1
        return node

    def link(self, start: Any, end: Any) -> None:
        """Connect two sockets."""
        self.group.links.new(start, end)

    def math(self, operation: str, *operands: Any) -> Any:
        """Return the output of a calculation with sockets and numbers."""
        node = self.node("ShaderNodeMath")
        node.operation = operation
        for socket, operand in zip(node.inputs, operands, strict=False):
            if isinstance(operand, float):
                socket.default_value = operand
            else:
                self.link(operand, socket)
        return node.outputs[0]

    def named(self, name: str) -> Any:
        """Return the field of an integer attribute."""
        node = self.node("GeometryNodeInputNamedAttribute")
        node.data_type = "INT"
        node.inputs["Name"].default_value = name
        return node.outputs["Attribute"]

    def switch(self, condition: Any, otherwise: Any, then: Any) -> Any:
        """Return one of two integer fields."""
        node = self.node("GeometryNodeSwitch")
        node.input_type = "INT"
        self.link(condition, node.inputs["Switch"])
        self.link(otherwise, node.inputs["False"])
        self.link(then, node.inputs["True"])
        return node.outputs["Output"]

    def at_index(self, value: Any, index: Any) -> Any:
        """Return the field of an integer at another point."""
        node = self.node("GeometryNodeFieldAtIndex")
        node.data_type, node.domain = "INT", "POINT"
        self.link(value, node.inputs["Value"])
        self.link(index, node.inputs["Index"])
        return node.outputs["Value"]

    def store(self, geometry: Any, value: Any) -> Any:
        """Return the geometry with the ancestors stored."""
        node = self.node("GeometryNodeStoreNamedAttribute")
        node.data_type, node.domain = "INT", "POINT"
        node.inputs["Name"].default_value = ANCESTOR
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Value"])
        return node.outputs["Geometry"]
