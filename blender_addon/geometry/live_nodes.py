# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups that cut a geometry at a rank: the live modifier's inside, and its inputs.

On clouds and loose points the points beyond the rank are deleted. On meshes every one of them
moves to its nearest living ancestor and is merged there; points take the ancestor's values and
corners those of the ancestor's corner in the same chart.

Every point and corner knows the number it had when the order was made. Where one has another
number now the order does not fit, and the geometry passes through, with a warning.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy

from . import attributes
from .node_builder import NodeBuilder

RANK, PARENT, INDEX = "salient_rank", "salient_parent", "salient_index"
CORNER = "salient_corner"
"""The corner at the parent, in the same chart."""
ANCESTOR, CORNER_ANCESTOR = "salient_ancestor", "salient_corner_ancestor"
STAYS = "salient_stays"
"""Means of ones and zeros where points merge: above zero where one of them stays."""
APART = "salient_apart"
"""Ones where points may have to merge that no edges join."""
OWN = (APART, RANK, PARENT, INDEX, CORNER)
"""Attributes that the live modifier needs."""
ROW = 4096.0
"""Points in a row of the grid on which points of one ancestor meet."""
VERSION = 3
"""Of the node groups; one of another version is left alone and a new one made."""
UNFIT = (
    "The geometry is another than the one Live Simplify was made for: press Live Simplify again, "
    "and keep modifiers that add or remove geometry below"
)
CUSTOM_NORMALS = "custom_normal"

FIELDS = {
    "FLOAT": "FLOAT", "INT": "INT", "BOOLEAN": "BOOLEAN", "INT8": "INT", "FLOAT2": "FLOAT_VECTOR",
    "FLOAT_VECTOR": "FLOAT_VECTOR", "FLOAT_COLOR": "FLOAT_COLOR", "BYTE_COLOR": "FLOAT_COLOR",
    "QUATERNION": "QUATERNION", "FLOAT4X4": "FLOAT4X4",
}  # fmt: skip
"""Attribute types that nodes can read and store, and the type of their field."""


class Kind(NamedTuple):
    """What a node group depends on.

    Attributes
    ----------
    faces : bool
        Whether points are merged, or deleted.
    connected : bool
        Whether merging along edges is enough: see `topology.apart`.
    points, corners : tuple of (name, type)
        Attributes that take the values of ancestors.
    """

    faces: bool
    connected: bool = True
    points: tuple[tuple[str, str], ...] = ()
    corners: tuple[tuple[str, str], ...] = ()


def kind_of(mesh: Any, connected: bool) -> Kind:
    """Return the kind of a mesh with faces."""

    def layers(domain: str) -> tuple[tuple[str, str], ...]:
        return tuple(
            (item.name, item.data_type)
            for item in mesh.attributes
            if item.domain == domain
            and item.data_type in FIELDS
            and item.name not in (*attributes.TOPOLOGY, *OWN, CUSTOM_NORMALS)
            and not item.name.startswith(".")
        )

    return Kind(True, connected, layers("POINT"), layers("CORNER"))


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


def node_group(kind: Kind) -> Any:
    """Return the node group of a kind; made where it is missing."""
    key = f"{VERSION} {kind!r}"
    for group in bpy.data.node_groups:
        if group.get("salient_kind") == key and group.library is None:
            return group
    name = "Salient Live Mesh" if kind.faces else "Salient Live Points"
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group["salient_kind"] = key
    group.is_modifier = True
    _build(NodeBuilder(group), kind)
    return group


def _build(nodes: NodeBuilder, kind: Kind) -> None:
    """Fill the group: keep the first ranks, and delete or merge the rest, if the ranks fit."""
    nodes.input("Geometry", "Geometry")
    nodes.input(
        "Ratio", "Float", subtype="FACTOR", min_value=0.0, max_value=1.0, default_value=0.1,
        description="Share of the points that stay; what is left is not refined as by Simplify",
    )  # fmt: skip
    for name, text in (
        ("Steps", "Doublings that lead every point to its last ancestor"),
        ("Least", "Fewest points that keep what is to be kept"),
        ("Points", "Number of points that the order was made for"),
        ("Corners", "Number of corners that the order was made for"),
    ):
        nodes.input(name, "Int", min_value=0, description=text, hide_in_modifier=True)
    nodes.group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    inputs = nodes.node("NodeGroupInput").outputs
    geometry = inputs["Geometry"]
    count = nodes.size(geometry, "MESH", "Point Count")
    if not kind.faces:
        # One group serves clouds and loose vertices: the component that is there counts.
        cloud = nodes.size(geometry, "POINTCLOUD", "Point Count")
        count = nodes.math("ADD", count, cloud)
    unfit = _unfit(nodes, inputs, count, kind)
    share = nodes.math("ROUND", nodes.math("MULTIPLY", count, inputs["Ratio"]))
    limit = nodes.math("SUBTRACT", nodes.math("MAXIMUM", share, inputs["Least"]), 0.5)
    gone = nodes.math("GREATER_THAN", nodes.named(RANK), limit)
    if kind.faces:
        end = _merge(nodes, geometry, inputs["Steps"], gone, kind)
    else:
        end = nodes.delete(geometry, gone)
    for name in OWN:
        end = nodes.remove(end, name)
    end = nodes.switch(nodes.warn(unfit, UNFIT), end, geometry, "GEOMETRY")
    outputs = nodes.node("NodeGroupOutput")
    nodes.link(end, outputs.inputs["Geometry"])


def _unfit(nodes: NodeBuilder, inputs: Any, count: Any, kind: Kind) -> Any:
    """Return whether a point or corner is another one than when the order was made."""
    geometry = inputs["Geometry"]
    moved = nodes.math("COMPARE", nodes.index(), nodes.named(INDEX), 0.5)
    unlike = nodes.math("SUBTRACT", 1.0, moved)
    wrong = [
        nodes.math("ABSOLUTE", nodes.math("SUBTRACT", count, inputs["Points"])),
        nodes.largest(geometry, unlike, "POINT"),
    ]
    if kind.corners:
        corners = nodes.size(geometry, "MESH", "Face Corner Count")
        wrong.append(nodes.math("ABSOLUTE", nodes.math("SUBTRACT", corners, inputs["Corners"])))
        # A corner at the parent is one at the point's parent, or at the point if it has none.
        vertex = nodes.node("GeometryNodeVertexOfCorner").outputs["Vertex Index"]
        there = nodes.at_index(vertex, nodes.named(CORNER), "CORNER")
        parent = nodes.at_index(nodes.named(PARENT), vertex, "POINT")
        root = nodes.math("LESS_THAN", parent, 0.0)
        expected = nodes.switch(root, parent, vertex)
        same = nodes.math("COMPARE", there, expected, 0.5)
        other = nodes.math("SUBTRACT", 1.0, same)
        wrong.append(nodes.largest(geometry, other, "CORNER"))
    total = wrong[0]
    for value in wrong[1:]:
        total = nodes.math("ADD", total, value)
    return nodes.math("GREATER_THAN", total, 0.5)


def _merge(nodes: NodeBuilder, geometry: Any, steps: Any, gone: Any, kind: Kind) -> Any:
    """Return the mesh whose points that are gone have moved into their last ancestors."""

    def follow(start: Any, name: str, parent: str, domain: str) -> Any:
        first = nodes.switch(gone, nodes.index(), nodes.named(parent))
        stored = nodes.store(start, name, "INT", domain, first)

        def double(before: Any) -> Any:
            further = nodes.at_index(nodes.named(name), nodes.named(name), domain)
            return nodes.store(before, name, "INT", domain, further)

        return nodes.repeat(stored, steps, double)

    mesh = follow(geometry, ANCESTOR, PARENT, "POINT")
    if kind.corners:
        mesh = follow(mesh, CORNER_ANCESTOR, CORNER, "CORNER")
        for name, of in kind.corners:
            value = nodes.named(name, FIELDS[of])
            taken = nodes.at_index(value, nodes.named(CORNER_ANCESTOR), "CORNER", FIELDS[of])
            mesh = nodes.store(mesh, name, of, "CORNER", taken)
        mesh = nodes.remove(mesh, CORNER_ANCESTOR)
    # Points merge by distance, which depends on the scale. So they meet on a grid of whole
    # numbers, one place for every ancestor, and take its position afterwards.
    ancestor = nodes.named(ANCESTOR)
    grid = nodes.node("ShaderNodeCombineXYZ")
    nodes.link(nodes.math("MODULO", ancestor, ROW), grid.inputs["X"])
    nodes.link(nodes.math("FLOOR", nodes.math("DIVIDE", ancestor, ROW)), grid.inputs["Y"])
    # Merging along edges takes a fraction of the time. What is left of a part that went into
    # another one has no edges then, and no point in it that stays.
    stays = nodes.math("SUBTRACT", 1.0, gone)
    mesh = nodes.store(nodes.move(mesh, grid.outputs["Vector"]), STAYS, "FLOAT", "POINT", stays)
    mesh = nodes.merge(mesh, 0.1, connected=True)
    if not kind.connected:
        apart = nodes.math("GREATER_THAN", nodes.named(APART, "FLOAT"), 0.0)
        mesh = nodes.merge(mesh, 0.1, connected=False, selection=apart)
    edges = nodes.node("GeometryNodeEdgesOfVertex").outputs["Total"]
    alone = nodes.math("LESS_THAN", edges, 0.5)
    empty = nodes.math("COMPARE", nodes.named(STAYS, "FLOAT"), 0.0, 0.0)
    mesh = nodes.delete(mesh, nodes.math("MULTIPLY", empty, alone))
    position = nodes.node("GeometryNodeInputPosition").outputs[0]
    mesh = nodes.move(mesh, nodes.sample(geometry, position, ancestor, "FLOAT_VECTOR"))
    for name, of in kind.points:
        value = nodes.sample(geometry, nodes.named(name, FIELDS[of]), ancestor, FIELDS[of])
        mesh = nodes.store(mesh, name, of, "POINT", value)
    for name in (ANCESTOR, STAYS, CUSTOM_NORMALS):
        mesh = nodes.remove(mesh, name)
    return mesh
