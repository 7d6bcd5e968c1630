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

from ..arrays.edges import Edges, find_edges
from ..arrays.types import Floats, Indices, Integers, Ints
from ..arrays.vectors import dot
from .geometry import Geometry
from .layers import Layer

MAX_SEAMS = 0.5
"""Share of the edges that may be seams. A layer that would raise it further has none: with values
of its own for each single face every edge is one, and no line is left to keep."""


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
    O(m log m). Corners at a vertex are one wedge if they are linked by faces with an edge in
    common, on whose sides all layers agree there; all of them where no layer differs.
    """
    faces = geometry.faces
    flat = faces.ravel()
    some = np.zeros(len(geometry.points), dtype=np.intp)
    some[flat] = np.arange(len(flat))
    divided = [layer.differ(np.arange(len(flat)), some[flat]) for layer in layers]
    if not any(
        there.any() or layer.is_texture for there, layer in zip(divided, layers, strict=True)
    ):
        return None
    edges = find_edges(faces, len(geometry.points))
    edge, low, high = _pairs_at_edges(edges, len(faces))
    apart_low, apart_high, seam = np.zeros((3, len(edge)), dtype=bool)
    dropped: list[int] = []
    for number, layer in enumerate(layers):
        at_low, at_high = layer.differ(*low), layer.differ(*high)
        there = seam | at_low | at_high
        if layer.is_texture:
            there |= layer.mirrored(low, high)
        if np.count_nonzero(there) > MAX_SEAMS * len(edges.low):
            dropped.append(number)
            continue
        seam = there
        apart_low |= at_low
        apart_high |= at_high
    chosen = np.unique(edge[seam])
    if not len(chosen) and not dropped:
        return None
    used = [number for number in range(len(layers)) if number not in dropped]
    whole = np.ones(len(geometry.points), dtype=bool)
    for number in used:
        whole[flat[divided[number]]] = False
    alike = np.flatnonzero(whole[flat])
    together = np.hstack(
        [low[:, ~apart_low], high[:, ~apart_high], np.stack([alike, some[flat[alike]]])]
    )
    corners, first = _number_wedges(flat, together, len(geometry.points))
    return Wedges(
        corners.reshape(-1, 3),
        first,
        _values_of(corners, [layers[number] for number in used], int(first[-1])),
        np.column_stack([edges.low[chosen], edges.high[chosen]]),
        tuple(dropped),
    )


def _pairs_at_edges(edges: Edges, count: int) -> tuple[Indices, Indices, Indices]:
    """Return pairs of faces at edges: the edge (p,), and corners (2, p) at its low and high end."""
    corner, face = np.divmod(edges.sides, count)
    start, end = 3 * face + corner, 3 * face + (corner + 1) % 3
    low, high = np.where(edges.forward[edges.sides], (start, end), (end, start))
    edge = np.repeat(np.arange(len(edges.uses)), edges.uses)
    pair = np.flatnonzero(edge[1:] == edge[:-1])
    sides = np.stack([pair, pair + 1])
    return edge[pair], low[sides], high[sides]


def _number_wedges(vertex: Indices, together: Indices, count: int) -> tuple[Ints, Ints]:
    """Return the wedge of each corner (3 m,), and the first (n + 1,) of each vertex.

    Parameters
    ----------
    vertex : (3 m,) intp
        Vertex of each corner.
    together : (2, p) int64
        Pairs of corners of one wedge.
    """
    size = len(vertex)
    links = coo_array((np.ones(together.shape[1], dtype=bool), tuple(together)), (size, size))
    label = connected_components(links, directed=False)[1]
    total = int(label.max(initial=-1)) + 1
    vertex_of_label = np.empty(total, dtype=np.intp)
    vertex_of_label[label] = vertex
    loose = np.ones(count, dtype=bool)
    loose[vertex] = False
    owner = np.concatenate([vertex_of_label, np.flatnonzero(loose)])
    number = np.empty(len(owner), dtype=np.int32)
    number[np.argsort(owner, kind="stable")] = np.arange(len(owner))
    first = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=count))])
    return number[label], first.astype(np.int32)


def _values_of(corners: Ints, layers: list[Layer], count: int) -> Floats:
    """Return the values (w, d) of the first corner of each wedge, each layer's range being 1."""
    reverse = np.arange(len(corners))[::-1]
    first = np.full(count, -1, dtype=np.intp)
    first[corners[reverse]] = reverse
    rows = [layer.scaled()[first] for layer in layers]
    return np.where(first[:, None] >= 0, np.hstack(rows) if rows else np.zeros((count, 1)), 0.0)
