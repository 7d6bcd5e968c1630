# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of vertex groups are read, and vertices deleted so that weights and shape keys go along.

Blender gives scripts no array of weights. Nodes read them, and delete geometry with them, in a
small part of the time that Python or bmesh take; but no node knows shape keys.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import compress
from typing import Any

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from . import attributes
from .attributes import Layer
from .node_builder import NodeBuilder

REMOVED, WEIGHT = "salient_removed", "salient_weight"
"""Attributes by which arrays and nodes understand each other."""


def weights(mesh: Any, name: str) -> NDArray[np.float32]:
    """Return the weight (n,) of every vertex in a group; 0 where it is not in it."""

    def build(nodes: NodeBuilder, geometry: Any) -> Any:
        return nodes.store(geometry, WEIGHT, "FLOAT", "POINT", nodes.named(name, "FLOAT"))

    with _modified(mesh, build) as obj:
        final = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        return np.asarray(attributes.read(final.attributes[WEIGHT]))


def keep(mesh: Any, indices: NDArray[np.integer[Any]]) -> None:
    """Delete all but some vertices of a mesh, and all edges and polygons.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    indices : (m,) int
        Of the vertices to keep, ascending.
    """
    removed = np.ones(len(mesh.vertices), dtype=bool)
    removed[indices] = False
    if mesh.shape_keys is not None:
        _delete_with_shapes(mesh, removed)
        return
    attributes.write_layer(mesh, Layer(REMOVED, "BOOLEAN", "POINT", removed))
    # A modifier can only be applied to a mesh that no other object shows.
    stand_in = bpy.data.meshes.new("stand in")
    mesh.user_remap(stand_in)
    try:
        with _modified(mesh, _delete_marked) as obj, bpy.context.temp_override(object=obj):
            bpy.ops.object.modifier_apply(modifier=obj.modifiers[0].name)
    finally:
        stand_in.user_remap(mesh)
        bpy.data.meshes.remove(stand_in)
    mesh.attributes.remove(mesh.attributes[REMOVED])


def _delete_marked(nodes: NodeBuilder, geometry: Any) -> Any:
    """Return what is left without marked vertices, edges and polygons."""
    left = nodes.delete(geometry, nodes.named(REMOVED, "BOOLEAN"))
    node = nodes.node("GeometryNodeDeleteGeometry", domain="EDGE", mode="EDGE_FACE")
    nodes.link(left, node.inputs["Geometry"])
    return node.outputs["Geometry"]


@contextmanager
def _modified(mesh: Any, build: Callable[[NodeBuilder, Any], Any]) -> Iterator[Any]:
    """Lend an object that shows a mesh through nodes, made by `build` from a geometry socket."""
    group = bpy.data.node_groups.new("vertices", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = NodeBuilder(group)
    start, end = nodes.node("NodeGroupInput"), nodes.node("NodeGroupOutput")
    nodes.link(build(nodes, start.outputs["Geometry"]), end.inputs["Geometry"])
    obj = bpy.data.objects.new("vertices", mesh)
    bpy.context.scene.collection.objects.link(obj)
    try:
        obj.modifiers.new("vertices", "NODES").node_group = group
        yield obj
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.node_groups.remove(group)


def _delete_with_shapes(mesh: Any, removed: NDArray[np.bool_]) -> None:
    """Delete some vertices of a mesh, and all edges and polygons; its shape keys go along."""
    work = bmesh.new()
    try:
        work.from_mesh(mesh, face_normals=False, vertex_normals=False)
        bmesh.ops.delete(work, geom=work.edges[:], context="EDGES_FACES")
        bmesh.ops.delete(work, geom=list(compress(work.verts, removed.tolist())), context="VERTS")
        work.to_mesh(mesh)
    finally:
        work.free()
