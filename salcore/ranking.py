# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of elimination in the input's own numbers, for hosts that cut through it themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry
from .progressive import Elimination


@dataclass(frozen=True, eq=False)
class Ranking:
    """The order in which input points go.

    Attributes
    ----------
    rank : (N,) int64
        A permutation: the points of rank below a count are those that this count keeps. Points
        equal to another come after all distinct ones, points that are not finite last.
    parent : (N,) int64
        Point of lower rank that each goes into; -1 for rank 0.
    generations : int
        Doublings (``parent[parent]``) after which every point has found its last ancestor.
    """

    rank: NDArray[np.int64]
    parent: NDArray[np.int64]
    generations: int


def input_ranking(geometry: Geometry, elimination: Elimination) -> Ranking:
    """Return the order of elimination over input points, in O(N log N)."""
    vertex_of, input_of = geometry.vertex_of, geometry.input_of
    finite = vertex_of >= 0
    first = np.zeros(len(vertex_of), dtype=bool)
    first[input_of] = True
    order = np.concatenate(
        [
            input_of[np.argsort(elimination.rank)],
            np.flatnonzero(finite & ~first),
            np.flatnonzero(~finite),
        ]
    )
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    parent = np.full(len(order), order[0] if len(order) else 0, dtype=np.int64)
    parent[finite] = input_of[vertex_of[finite]]
    parent[input_of] = input_of[elimination.parent]
    parent[order[:1]] = -1
    return Ranking(rank, parent, _generations(parent))


def _generations(parent: NDArray[np.int64]) -> int:
    """Return the number of doublings that lead every point to the one without a parent."""
    ancestor = np.where(parent < 0, np.arange(len(parent)), parent)
    count = 0
    while True:
        further = ancestor[ancestor]
        if np.array_equal(further, ancestor):
            return count
        ancestor, count = further, count + 1
