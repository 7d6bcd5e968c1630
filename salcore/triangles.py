# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles and their edges: of meshes, and of clouds by the stars of their points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .blocks import rest_blocks
from .geometry import Indices
from .progress import Rests
from .sorting import sort

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

    low: NDArray[np.int32]
    high: NDArray[np.int32]
    uses: Indices
    sides: Indices
    forward: NDArray[np.bool_]

    def among(self, pairs: NDArray[np.integer], count: int) -> NDArray[np.bool_]:
        """Return which edges are among pairs (s, 2) of vertices, of `count`."""
        keys = pairs.min(axis=1).astype(np.int64) * count + pairs.max(axis=1)
        found: NDArray[np.bool_] = np.isin(self.low.astype(np.int64) * count + self.high, keys)
        return found if len(keys) else np.zeros(len(self.low), dtype=bool)


def find_edges(faces: NDArray[np.integer], count: int, workers: int = 0) -> Rests[Edges]:
    """Return the edges of faces over `count` vertices, in O(m log m), with rests."""
    key = np.empty((3, len(faces)), dtype=np.int64)
    forward = np.empty((3, len(faces)), dtype=bool)

    def name(begin: int, stop: int) -> None:
        start = faces[begin:stop].T.astype(np.int64)
        end = np.roll(start, -1, axis=0)
        key[:, begin:stop] = np.minimum(start, end) * count + np.maximum(start, end)
        forward[:, begin:stop] = start < end

    yield from rest_blocks(name, len(faces), workers=workers)
    sides, ordered = yield from sort(key.ravel(), workers=workers)
    first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)])
    yield
    unique = ordered[first]
    uses = np.diff(np.append(first, len(ordered)))
    yield
    low = unique // max(count, 1)
    high = (unique - low * count).astype(np.int32)
    yield
    return Edges(low.astype(np.int32), high, uses, sides, forward.ravel())


def star_triangles(stars: NDArray[np.int32], workers: int = 0) -> Rests[NDArray[np.int32]]:
    """Return the triangles that at least two of their corners have in their stars, with rests.

    Each star is a fan of triangles round its vertex. Where the stars agree they form a surface;
    where they do not, those of one vertex only are left out.

    Parameters
    ----------
    stars : (n, w) int32
        Neighbours of each vertex by angle, filled up with -1 (`Graph.stars`).

    Returns
    -------
    (m, 3) int32
        Corners in ascending order: the sides of the surface are not told apart.
    """
    size = np.count_nonzero(stars >= 0, axis=1)
    # Two neighbours make one triangle, three or more close the fan.
    bounds = np.concatenate([[0], np.cumsum(np.where(size > 2, size, size == 2))])
    corners = np.empty((bounds[-1], 3), dtype=np.int32)
    yield

    def spread(start: int, stop: int) -> None:
        block, width = stars[start:stop], size[start:stop]
        row, slot = np.nonzero(block >= 0)
        used = (slot + 1 < width[row]) | (width[row] > 2)
        row, slot = row[used], slot[used]
        after = block[row, np.where(slot + 1 < width[row], slot + 1, 0)]
        fan = np.column_stack([row + start, block[row, slot], after])
        corners[bounds[start] : bounds[stop]] = np.sort(fan.astype(np.int32), axis=1)

    yield from rest_blocks(spread, len(stars), workers=workers)
    order, same = yield from sort_rows(corners, len(stars), workers)
    # The first of several that are the same.
    kept = order[:-1][same & ~np.append(False, same[:-1])]
    yield
    surface: NDArray[np.int32] = corners[kept]
    return surface


def sort_rows(
    corners: NDArray[np.integer], count: int, workers: int = 0
) -> Rests[tuple[Indices, NDArray[np.bool_]]]:
    """Sort rows of three vertex numbers below `count`, with rests.

    Returns
    -------
    order : (m,) intp
        The stable lexicographic order.
    same : (m - 1,) bool
        Whether a row, in that order, equals the next.
    """
    if count > LARGEST_KEY:
        by_third, _ = yield from sort(corners[:, 2], stable=True, workers=workers)
        key = (corners[:, 0].astype(np.int64) * count + corners[:, 1])[by_third]
        yield
        order, key = yield from sort(key, stable=True, workers=workers)
        order = by_third[order]
        third = corners[order, 2]
        return order, (key[1:] == key[:-1]) & (third[1:] == third[:-1])
    key = np.empty(len(corners), dtype=np.int64)

    def name(start: int, stop: int) -> None:
        a, b, c = corners[start:stop].astype(np.int64).T
        key[start:stop] = (a * count + b) * count + c

    yield from rest_blocks(name, len(corners), workers=workers)
    order, key = yield from sort(key, stable=True, workers=workers)
    return order, key[1:] == key[:-1]
