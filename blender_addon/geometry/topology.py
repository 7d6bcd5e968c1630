# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons, corners and edges of a simplified mesh, and which of the original each comes from.

Triangles that a simplification leaves become polygons. A quad or n-gon that lost nothing comes
back as it was; loose edges follow their ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import attributes, bridge
from .salcore import Simplification, find_seams

Ints = NDArray[np.int64]


class Topology(NamedTuple):
    """A mesh over M kept vertices, and the element of the original that each element comes from.

    Attributes
    ----------
    starts : (P,) int64
        First corner of each polygon.
    polygons : (P,) int64
        Original polygon.
    vertices, corners : (C,) int64
        Vertex of each corner, and its original corner.
    edge_of : (C,) int64
        Edge from each corner to the next.
    edges : (E, 2) int64
        Vertices of the edges.
    edge_source : (E,) int64
        Original edge; -1 where there is none.
    """

    starts: Ints
    polygons: Ints
    vertices: Ints
    corners: Ints
    edge_of: Ints
    edges: Ints
    edge_source: Ints


def simplified(mesh: Any, result: Simplification) -> Topology:
    """Return the topology that `result` leaves of a `bpy.types.Mesh`."""
    starts, polygons, vertices, corners = _polygons(mesh, result)
    sides = np.column_stack([vertices, vertices[_following(starts, len(vertices))]])
    sides = np.concatenate([sides, _loose_edges(mesh, result)])
    count = max(len(result.indices), 1)
    keys, edge_of = np.unique(sides.min(axis=1) * count + sides.max(axis=1), return_inverse=True)
    edges = np.column_stack(np.divmod(keys, count))
    edge_source = np.full(len(edges), -1, dtype=np.int64)
    if _carries(mesh, "EDGE"):
        edge_source = result.edge_source(attributes.topology(mesh, ".edge_verts"), edges)
    edge_of = edge_of.ravel()[: len(vertices)]
    return Topology(starts, polygons, vertices, corners, edge_of, edges, edge_source)


def seams(mesh: Any) -> Ints:
    """Return edges (s, 2) that stay as lines.

    Those where charts of a UV map meet, those marked as seams, and borders between materials.
    """
    vertices, corners, polygons = bridge.triangles(mesh)
    values = [
        np.asarray(attributes.read(mesh.attributes[layer.name]))[corners]
        for layer in mesh.uv_layers
    ]
    material = mesh.attributes.get("material_index")
    if material is not None:
        kind = np.asarray(attributes.read(material))[polygons]
        values.append(np.repeat(kind[:, None, None], 3, axis=1))
    found = [np.empty((0, 2), dtype=np.int64)]
    if values:
        found.append(find_seams(vertices, np.concatenate(values, axis=2)))
    marked = mesh.attributes.get("uv_seam")
    if marked is not None:
        found.append(attributes.topology(mesh, ".edge_verts")[np.asarray(attributes.read(marked))])
    return np.concatenate(found)


def _polygons(mesh: Any, result: Simplification) -> tuple[Ints, Ints, Ints, Ints]:
    """Return first corners, original polygons, and vertices and original corners of the corners."""
    if result.faces is None or not len(result.faces):
        return (np.empty(0, dtype=np.int64),) * 4
    old_vertices, old_corners, polygon_of = bridge.triangles(mesh)
    origin = result.face_source
    first, size = _loops(mesh)
    unchanged = (result.indices[result.faces] == old_vertices[origin]).all(axis=1)
    left = np.bincount(polygon_of[origin[unchanged]], minlength=len(size))
    whole = left == size - 2
    rest = np.flatnonzero(~whole[polygon_of[origin]])
    source = _corner_source(mesh, result, old_vertices, old_corners)[rest]
    place = np.full(len(mesh.vertices), -1, dtype=np.int64)
    place[result.indices] = np.arange(len(result.indices))
    intact = np.flatnonzero(whole)
    whole_corners = _ranges(first[intact], size[intact])
    corner_vertex = attributes.topology(mesh, ".corner_vert")
    polygons = np.concatenate([intact, polygon_of[origin[rest]]])
    sizes = np.concatenate([size[intact], np.full(len(rest), 3)])
    vertices = np.concatenate([place[corner_vertex[whole_corners]], result.faces[rest].ravel()])
    corners = np.concatenate([whole_corners, old_corners.ravel()[source.ravel()]])
    # Polygons keep the order of the original.
    order = np.argsort(polygons, kind="stable")
    moved = _ranges((np.cumsum(sizes) - sizes)[order], sizes[order])
    starts = np.cumsum(sizes[order]) - sizes[order]
    return starts, polygons[order], vertices[moved], corners[moved]


def _corner_source(
    mesh: Any, result: Simplification, vertices: NDArray[np.int32], corners: NDArray[np.int32]
) -> Ints:
    """Return the old corner (k, 3), among those of the triangles, for each new one."""
    if not _carries(mesh, "CORNER"):
        return 3 * result.face_source[:, None] + np.arange(3)
    return result.corner_source(vertices, charts(mesh, corners))


def charts(mesh: Any, corners: NDArray[np.int32]) -> NDArray[np.float64] | None:
    """Return what tells corners of one vertex apart: the active UV map, or None."""
    uv = mesh.uv_layers.active
    if uv is None:
        return None
    return np.asarray(attributes.read(mesh.attributes[uv.name]), dtype=np.float64)[corners]


def _carries(mesh: Any, domain: str) -> bool:
    """Return whether elements of a domain have values that a new element has to get."""
    return any(a.domain == domain and a.name not in attributes.TOPOLOGY for a in mesh.attributes)


def _loops(mesh: Any) -> tuple[Ints, Ints]:
    """Return the first corner and the number of corners of every polygon."""
    found = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", found)
    first = found.astype(np.int64)
    return first, np.diff(np.append(first, len(mesh.loops)))


def _ranges(starts: Ints, sizes: Ints) -> Ints:
    """Return the concatenated ranges ``start, start + 1, ...`` of these sizes."""
    offset = starts - (np.cumsum(sizes) - sizes)
    return np.repeat(offset, sizes) + np.arange(int(sizes.sum()))


def _following(starts: Ints, count: int) -> Ints:
    """Return the next corner of the same polygon, for `count` corners."""
    after = np.arange(1, count + 1)
    if len(starts):
        after[np.append(starts[1:], count) - 1] = starts
    return after


def _loose_edges(mesh: Any, result: Simplification) -> Ints:
    """Return the edges (e, 2) of no polygon, between what stands for their ends."""
    edges = attributes.topology(mesh, ".edge_verts")
    loose = np.ones(len(edges), dtype=bool)
    loose[attributes.topology(mesh, ".corner_edge")] = False
    ends = result.source[edges[loose]]
    return ends[(ends[:, 0] != ends[:, 1]) & (ends >= 0).all(axis=1)]
