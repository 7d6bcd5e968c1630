# SPDX-License-Identifier: GPL-3.0-or-later
"""Wedges: the corners at one vertex that have the same values.

A mesh is vertices, faces and corners. Texture coordinates, normals, colours and materials belong to
corners; where they differ along an edge there is a seam, and each vertex on it has a wedge for each
chart that meets there (Hoppe, New quadric metric for simplifying meshes with appearance attributes,
1999). Files without corners split such vertices: equal points are welded, and their copies are
wedges, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays.edges import pairs_at_edges
from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from ..arrays.vectors import dot
from .geometry import Geometry
from .layers import Layer

MAX_SEAMS = 0.5
"""Share of the edges that may be seams. A layer that would raise it further has none: with values
of its own for each single face every edge is one, and no line is left to keep."""
EDGES_PER_FACE = 1.5
"""As on a closed mesh."""


@dataclass(frozen=True, eq=False)
class Wedges:
    """The wedges of a mesh of n vertices and m faces, sorted by vertex.

    Attributes
    ----------
    corners : (m, 3) int32
        Wedge of each corner.
    first : (n + 1,) int32
        First wedge of each vertex, which has at least one.
    values : (w, d) float64
        What wedges are compared by: values of each wedge's first corner, as shares of their ranges.
    seams : (s, 2) int32
        Edges along which wedges differ, or a texture is mirrored.
    without_seams : tuple of int
        Layers so full of seams that they have none.
    """

    corners: Ints
    first: Ints
    values: Floats
    seams: Ints
    without_seams: tuple[int, ...] = ()

    @property
    def vertex(self) -> Indices:
        """Vertex (w,) of each wedge."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    def nearest(self, wedges: Integers, vertices: Integers) -> Ints:
        """Return, for each of some wedges (k,), the most alike one at a vertex (k,)."""
        start = self.first[vertices]
        size = self.first[vertices + 1] - start
        row = np.repeat(np.arange(len(wedges)), size)
        begin = np.cumsum(size) - size
        candidate = np.arange(len(row)) - begin[row] + start[row]
        away = self.values[candidate] - self.values[wedges[row]]
        order = np.lexsort((dot(away, away), row))
        found: Ints = candidate[order[begin]].astype(np.int32)
        return found


def build_wedges(geometry: Geometry, layers: list[Layer]) -> Wedges | None:
    """Return the wedges of a mesh; None where every vertex has one, and no edge is a seam.

    Parameters
    ----------
    geometry : Geometry
    layers : list of Layer

    Notes
    -----
    O(m), and O(s log s) for s faces at vertices with several values. Corners at a vertex are one
    wedge if they are linked by faces with an edge in common, on whose sides all layers agree there;
    all of them where no layer differs.
    """
    faces, count = geometry.faces, len(geometry.points)
    divided = [layer.divided(faces, count) for layer in layers]
    if not np.any(divided):
        return None
    near = np.flatnonzero(np.any(divided, axis=0)[faces].any(axis=1))
    edges, edge, low, high = pairs_at_edges(faces, near, count)
    apart_low, apart_high, seam = np.zeros((3, len(edge)), dtype=bool)
    most = MAX_SEAMS * EDGES_PER_FACE * len(faces)
    used: list[int] = []
    for number, layer in enumerate(layers):
        at_low, at_high = layer.differ(*low), layer.differ(*high)
        if not layer.given:
            # Scans have single points twice, at slits and where fans meet: that is no line.
            line = edge[at_low & at_high]
            on_line = np.zeros(count, dtype=bool)
            on_line[edges.low[line]] = on_line[edges.high[line]] = True
            divided[number] = divided[number] & on_line
            at_low &= on_line[edges.low[edge]]
            at_high &= on_line[edges.high[edge]]
        there = seam | at_low | at_high
        if layer.is_texture:
            there |= layer.mirrored(low, high)
        if np.count_nonzero(there) <= most:
            used.append(number)
            seam = there
            apart_low |= at_low
            apart_high |= at_high
    several = np.zeros(count, dtype=bool)
    for number in used:
        several |= divided[number]
    together = np.hstack([low[:, ~apart_low], high[:, ~apart_high]])
    corners, first = _number_wedges(faces.ravel(), together, several)
    chosen = np.unique(edge[seam])
    return Wedges(
        corners.reshape(-1, 3),
        first,
        _values_of(corners, [layers[number] for number in used], int(first[-1])),
        np.column_stack([edges.low[chosen], edges.high[chosen]]),
        tuple(number for number in range(len(layers)) if number not in used),
    )


def _number_wedges(vertex: Indices, together: Indices, several: Mask) -> tuple[Ints, Ints]:
    """Return the wedge of each corner (3 m,), and the first (n + 1,) of each vertex.

    Parameters
    ----------
    vertex : (3 m,) intp
        Vertex of each corner.
    together : (2, p) intp
        Pairs of corners of one wedge.
    several : (n,) bool
        Vertices that may have several wedges; others have one.
    """
    divided = np.flatnonzero(several[vertex])
    place = np.empty(len(vertex), dtype=np.intp)
    place[divided] = np.arange(len(divided))
    links = place[together[:, several[vertex[together[0]]]]]
    shape = (len(divided), len(divided))
    graph = coo_array((np.ones(links.shape[1], dtype=bool), tuple(links)), shape)
    label = connected_components(graph, directed=False)[1]
    vertex_of_label = np.empty(int(label.max(initial=-1)) + 1, dtype=np.intp)
    vertex_of_label[label] = vertex[divided]
    wedges = np.maximum(np.bincount(vertex_of_label, minlength=len(several)), 1)
    first = np.concatenate([[0], np.cumsum(wedges)]).astype(np.int32)
    order = np.argsort(vertex_of_label, kind="stable")
    number = np.empty(len(order), dtype=np.int32)
    ordered = vertex_of_label[order]
    start = np.searchsorted(ordered, ordered)
    number[order] = first[ordered] + np.arange(len(order)) - start
    corners: Ints = first[vertex]
    corners[divided] = number[label]
    return corners, first


def _values_of(corners: Ints, layers: list[Layer], count: int) -> Floats:
    """Return the values (w, d) of the first corner of each wedge, each layer's range being 1."""
    first = np.zeros(count, dtype=np.intp)
    first[corners[::-1]] = np.arange(len(corners))[::-1]
    rows = [layer.scaled(first) for layer in layers]
    return np.hstack(rows) if rows else np.zeros((count, 1))
