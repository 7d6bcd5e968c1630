# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose vertices shown as points: Blender draws them in no colour, and not at all when rendered.

The modifier gives points alone: vertices beside them would be drawn over them.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import attributes, live_nodes, read
from .attributes import Layer
from .node_builder import NodeBuilder

MODIFIER = "Salient Points"
KEY = "salient_points"
VERSION = 2
RADIUS = "radius"


def show(obj: Any, material: Any, radius: float) -> None:
    """Have an object of loose vertices, or a point cloud, shown as points of a colour and size.

    Parameters
    ----------
    obj : bpy.types.Object
    material : bpy.types.Material
    radius : float
        In the scene; a point cloud that has a radius of its own keeps it.
    """
    scale = abs(np.linalg.det(np.array(obj.matrix_world)[:3, :3])) ** (1.0 / 3.0)
    radius /= scale or 1.0
    if not read.is_mesh(obj.data):
        count = len(obj.data.points)
        if RADIUS not in obj.data.attributes:
            sizes = np.full(count, radius, dtype=np.float32)
            attributes.write_layer(obj.data, Layer(RADIUS, "FLOAT", "POINT", sizes))
        return
    modifier = obj.modifiers.get(MODIFIER)
    if modifier is None or modifier.type != "NODES":
        modifier = obj.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = _node_group()
    live_nodes.set_input(modifier, "Radius", radius)
    live_nodes.set_input(modifier, "Material", material)
    obj.update_tag()


def _node_group() -> Any:
    """Return the node group that makes points of vertices; made where it is missing."""
    for group in bpy.data.node_groups:
        if group.get(KEY) == VERSION and group.library is None:
            return group
    group = bpy.data.node_groups.new(MODIFIER, "GeometryNodeTree")
    group[KEY] = VERSION
    group.is_modifier = True
    nodes = NodeBuilder(group)
    nodes.input("Geometry", "Geometry")
    nodes.input(
        "Radius", "Float", subtype="DISTANCE", min_value=0.0, default_value=0.01,
        description="Of the points, in the object's own unit",
    )  # fmt: skip
    nodes.input("Material", "Material")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    inputs = nodes.node("NodeGroupInput").outputs
    points = nodes.node("GeometryNodeMeshToPoints")
    nodes.link(inputs["Geometry"], points.inputs["Mesh"])
    nodes.link(inputs["Radius"], points.inputs["Radius"])
    colored = nodes.node("GeometryNodeSetMaterial")
    nodes.link(points.outputs["Points"], colored.inputs["Geometry"])
    nodes.link(inputs["Material"], colored.inputs["Material"])
    nodes.link(colored.outputs["Geometry"], nodes.node("NodeGroupOutput").inputs["Geometry"])
    return group
