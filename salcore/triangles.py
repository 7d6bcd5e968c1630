# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles and their edges: of meshes, and of clouds by the stars of their points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry import Indices

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
    of_side : (3 m,) intp
        Edge of each side of the faces: all first sides (corner 0 to 1), then all second ones, ...
    forward : (3 m,) bool
        Whether the side runs from low to high.
    """

    low: NDArray[np.int32]
    high: NDArray[np.int32]
    uses: Indices
    of_side: Indices
    forward: NDArray[np.bool_]


def find_edges(faces: NDArray[np.integer], count: int) -> Edges:
    """Return the edges of faces over `count` vertices, in O(m log m)."""
    start = faces.T.ravel().astype(np.int64)
    end = np.roll(faces, -1, axis=1).T.ravel().astype(np.int64)
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key)
    first = np.append(True, key[order[1:]] != key[order[:-1]])[: len(key)]
    number = np.cumsum(first) - 1
    of_side = np.empty(len(key), dtype=np.intp)
    of_side[order] = number
    unique = key[order[first]]
    low, high = np.divmod(unique, max(count, 1))
    return Edges(
        low.astype(np.int32),
        high.astype(np.int32),
        np.bincount(number, minlength=len(unique)),
        of_side,
        start < end,
    )


def star_triangles(stars: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the triangles that at least two of their corners have in their stars.

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
    row, slot = np.nonzero(stars >= 0)
    # Two neighbours make one triangle, three or more close the fan.
    closing = (slot + 1 < size[row]) | (size[row] > 2)
    row, slot = row[closing], slot[closing]
    after = stars[row, np.where(slot + 1 < size[row], slot + 1, 0)]
    corners = np.sort(np.column_stack([row, stars[row, slot], after]).astype(np.int32), axis=1)
    corners = _sorted_rows(corners, len(stars))
    same = (corners[1:] == corners[:-1]).all(axis=1)
    first = np.append(True, ~same)[: len(corners)]
    again = np.append(same, False)[: len(corners)]
    surface: NDArray[np.int32] = corners[first & again]
    return surface


def _sorted_rows(corners: NDArray[np.int32], count: int) -> NDArray[np.int32]:
    """Return rows of three vertex numbers below `count` in lexicographic order."""
    if count > LARGEST_KEY:
        order: Indices = np.lexsort(corners.T[::-1])
        return corners[order]
    a, b, c = corners.astype(np.int64).T
    key, third = np.divmod(np.sort((a * count + b) * count + c), max(count, 1))
    return np.column_stack([*np.divmod(key, max(count, 1)), third]).astype(np.int32)
