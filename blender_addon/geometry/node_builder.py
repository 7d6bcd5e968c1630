# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry nodes as calls: each method adds a node and returns the socket that matters."""

from __future__ import annotations

from typing import Any


class NodeBuilder:
    """Adds nodes to a group, from left to right.

    Parameters
    ----------
    group : bpy.types.GeometryNodeTree
    """

    def __init__(self, group: Any) -> None:
        self.group = group
        self.place = 0

    def input(self, name: str, kind: str, **settings: Any) -> None:
        """Add an input to the group: a name, the end of a socket's type, and its properties."""
        socket = self.group.interface.new_socket(
            name, in_out="INPUT", socket_type=f"NodeSocket{kind}"
        )
        for key, value in settings.items():
            setattr(socket, key, value)

    def node(self, kind: str, **settings: Any) -> Any:
        """Add a node with these properties."""
        node = self.group.nodes.new(kind)
        node.location.x = 200.0 * self.place
        self.place += 1
        for key, value in settings.items():
            setattr(node, key, value)
        return node

    def link(self, start: Any, end: Any) -> None:
        """Connect two sockets, or set the second to a number or text."""
        if isinstance(start, (bool, int, float, str)):
            end.default_value = start
        else:
            self.group.links.new(start, end)

    def math(self, operation: str, *operands: Any) -> Any:
        """Return the output of a calculation with sockets and numbers."""
        node = self.node("ShaderNodeMath", operation=operation)
        for socket, operand in zip(node.inputs, operands, strict=False):
            self.link(operand, socket)
        return node.outputs[0]

    def index(self) -> Any:
        """Return the field of every element's own number."""
        return self.node("GeometryNodeInputIndex").outputs["Index"]

    def named(self, name: str, kind: str = "INT") -> Any:
        """Return the field of an attribute."""
        node = self.node("GeometryNodeInputNamedAttribute", data_type=kind)
        node.inputs["Name"].default_value = name
        return node.outputs["Attribute"]

    def switch(self, condition: Any, otherwise: Any, then: Any, kind: str = "INT") -> Any:
        """Return one of two values."""
        node = self.node("GeometryNodeSwitch", input_type=kind)
        self.link(condition, node.inputs["Switch"])
        self.link(otherwise, node.inputs["False"])
        self.link(then, node.inputs["True"])
        return node.outputs["Output"]

    def at_index(self, value: Any, index: Any, domain: str, kind: str = "INT") -> Any:
        """Return the field of a value at another element."""
        node = self.node("GeometryNodeFieldAtIndex", data_type=kind, domain=domain)
        self.link(value, node.inputs["Value"])
        self.link(index, node.inputs["Index"])
        return node.outputs["Value"]

    def sample(self, geometry: Any, value: Any, index: Any, kind: str) -> Any:
        """Return the field of a value of a point of another geometry."""
        node = self.node("GeometryNodeSampleIndex", data_type=kind, domain="POINT")
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Value"])
        self.link(index, node.inputs["Index"])
        return node.outputs["Value"]

    def store(self, geometry: Any, name: str, kind: str, domain: str, value: Any) -> Any:
        """Return the geometry with an attribute."""
        node = self.node("GeometryNodeStoreNamedAttribute", data_type=kind, domain=domain)
        node.inputs["Name"].default_value = name
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Value"])
        return node.outputs["Geometry"]

    def remove(self, geometry: Any, name: str) -> Any:
        """Return the geometry without an attribute."""
        node = self.node("GeometryNodeRemoveAttribute")
        node.inputs["Name"].default_value = name
        self.link(geometry, node.inputs["Geometry"])
        return node.outputs["Geometry"]

    def delete(self, geometry: Any, selection: Any) -> Any:
        """Return the geometry without some of its points."""
        node = self.node("GeometryNodeDeleteGeometry")
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        return node.outputs["Geometry"]

    def move(self, geometry: Any, position: Any) -> Any:
        """Return the geometry with other positions."""
        node = self.node("GeometryNodeSetPosition")
        self.link(geometry, node.inputs["Geometry"])
        self.link(position, node.inputs["Position"])
        return node.outputs["Geometry"]

    def size(self, geometry: Any, component: str, output: str) -> Any:
        """Return how many elements a part of a geometry has."""
        node = self.node("GeometryNodeAttributeDomainSize", component=component)
        self.link(geometry, node.inputs["Geometry"])
        return node.outputs[output]

    def largest(self, geometry: Any, value: Any, domain: str) -> Any:
        """Return the largest value of a field; 0 where there is no element."""
        node = self.node("GeometryNodeAttributeStatistic", data_type="FLOAT", domain=domain)
        self.link(geometry, node.inputs["Geometry"])
        self.link(value, node.inputs["Attribute"])
        return node.outputs["Max"]

    def repeat(self, geometry: Any, steps: Any, body: Any) -> Any:
        """Return the geometry that `body`, a function from socket to socket, leaves in the end."""
        begin, end = self.node("GeometryNodeRepeatInput"), self.node("GeometryNodeRepeatOutput")
        begin.pair_with_output(end)
        self.link(steps, begin.inputs["Iterations"])
        self.link(geometry, begin.inputs["Geometry"])
        self.link(body(begin.outputs["Geometry"]), end.inputs["Geometry"])
        return end.outputs["Geometry"]

    def merge(self, geometry: Any, distance: float, connected: bool, selection: Any = True) -> Any:
        """Return the geometry with near points made one: all, or those along edges, at once."""
        node = self.node("GeometryNodeMergeByDistance")
        node.inputs["Distance"].default_value = distance
        if hasattr(node, "mode"):
            node.mode = "CONNECTED" if connected else "ALL"
        else:  # from Blender 5.0 on
            node.inputs["Mode"].default_value = "Connected" if connected else "All"
        self.link(geometry, node.inputs["Geometry"])
        self.link(selection, node.inputs["Selection"])
        return node.outputs["Geometry"]

    def warn(self, condition: Any, text: str) -> Any:
        """Show a warning on the modifier while a condition holds, and return the condition."""
        node = self.node("GeometryNodeWarning", warning_type="WARNING")
        self.link(condition, node.inputs["Show"])
        self.link(text, node.inputs["Message"])
        return node.outputs["Show"]
