# SPDX-License-Identifier: GPL-3.0-or-later
"""The undirected edges of triangles, and one number as a key for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .blocks import run_blocks
from .types import Indices, Integers, Ints, Keys, Mask

LARGEST_KEY = 2_000_000
"""Vertices up to which three numbers fit into one of 64 bits."""


@dataclass(frozen=True, eq=False)
class Edges:
    """The undirected edges of a list of m faces.

    Attributes
    ----------
    low, high : (e,) int32
        Their ends, ``low < high``, sorted.
    uses : (e,) intp
        Number of faces at each edge.
    sides : (3 m,) intp
        The sides of the faces in the order of their edges: those of edge 0, of edge 1, ... Sides
        are numbered all first ones first (corner 0 to 1), then all second ones, ...
    forward : (3 m,) bool
        Whether each side runs from low to high.
    """

    low: Ints
    high: Ints
    uses: Indices
    sides: Indices
    forward: Mask

    def among(self, pairs: Integers, count: int) -> Mask:
        """Return which edges (e,) are among pairs (s, 2) of vertices, of `count`."""
        keys = edge_key(pairs[:, 0], pairs[:, 1], count)
        found: Mask = np.isin(edge_key(self.low, self.high, count), keys)
        return found


def edge_key(a: Integers, b: Integers, count: int) -> Keys:
    """Return one number for each undirected edge between vertices below `count`."""
    return np.minimum(a, b).astype(np.int64) * count + np.maximum(a, b)


def find_edges(faces: Integers, count: int) -> Edges:
    """Return the edges of faces (m, 3) over `count` vertices, in O(m log m)."""
    key = np.empty((3, len(faces)), dtype=np.int64)
    forward = np.empty((3, len(faces)), dtype=bool)

    def encode(begin: int, stop: int) -> None:
        start = faces[begin:stop].T.astype(np.int64)
        end = np.roll(start, -1, axis=0)
        key[:, begin:stop] = edge_key(start, end, count)
        forward[:, begin:stop] = start < end

    run_blocks(encode, len(faces))
    flat = key.ravel()
    sides = np.argsort(flat, kind="stable")  # faster: scans come in sorted runs
    ordered = flat[sides]
    first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)])
    low, high = np.divmod(ordered[first], max(count, 1))
    uses = np.diff(np.append(first, len(ordered)))
    return Edges(low.astype(np.int32), high.astype(np.int32), uses, sides, forward.ravel())


def pairs_at_edges(
    faces: Integers, chosen: Indices, count: int
) -> tuple[Edges, Indices, Indices, Indices]:
    """Return the edges of some faces, and the pairs of these at an edge, in O(c log c).

    Parameters
    ----------
    faces : (m, 3) int
    chosen : (c,) intp
        Which of them.
    count : int
        Vertices.

    Returns
    -------
    edges : Edges
        Of the chosen faces.
    edge : (p,) intp
        Edge of each pair; k faces at an edge make k - 1.
    low, high : (2, p) intp
        Corners of both faces at the ends of their edge: corner c of face f is ``3 f + c``.
    """
    edges = find_edges(faces[chosen], count)
    corner, place = np.divmod(edges.sides, max(len(chosen), 1))
    face = chosen[place]
    start, end = 3 * face + corner, 3 * face + (corner + 1) % 3
    low, high = np.where(edges.forward[edges.sides], (start, end), (end, start))
    edge = np.repeat(np.arange(len(edges.uses)), edges.uses)
    pair = np.flatnonzero(edge[1:] == edge[:-1])
    sides = np.stack([pair, pair + 1])
    return edges, edge[pair], low[sides], high[sides]


def sort_rows(corners: Integers, count: int) -> tuple[Indices, Mask]:
    """Sort rows of three vertex numbers below `count`.

    Returns
    -------
    order : (m,) intp
        The stable lexicographic order.
    same : (m - 1,) bool
        Whether a row, in that order, equals the next.
    """
    a, b, c = corners.T.astype(np.int64)
    if count > LARGEST_KEY:
        order = np.lexsort((c, b, a))
        ordered = corners[order]
        return order, (ordered[1:] == ordered[:-1]).all(axis=1)
    key = (a * count + b) * count + c
    order = np.argsort(key, kind="stable")
    key = key[order]
    return order, key[1:] == key[:-1]


def contains(table: Keys, keys: Keys) -> Mask:
    """Return which keys are in the sorted table."""
    if not len(table):
        return np.zeros(len(keys), dtype=bool)
    order = np.argsort(keys)  # sorted look-ups walk the table in order, not all over it
    place = np.minimum(np.searchsorted(table, keys[order]), len(table) - 1)
    found = np.empty(len(keys), dtype=bool)
    found[order] = table[place] == keys[order]
    return found
