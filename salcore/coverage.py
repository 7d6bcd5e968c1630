# SPDX-License-Identifier: GPL-3.0-or-later
"""The coverage guard: no vertex is left far from a kept one, counted in rings of the graph.

Our extension of the paper's gap rule, which closes most gaps but promises nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .geometry import Floats, Indices
from .graph import Graph, scrambled
from .rows import row_entries, row_max

Mask = NDArray[np.bool_]


def close_gaps(points: Floats, graph: Graph, kept: Mask, max_gap: int) -> tuple[Mask, Indices]:
    """Add points until every vertex is within `max_gap` rings of a kept one.

    Parameters
    ----------
    points : (n, 3) float64
    graph : Graph
    kept : (n,) bool
    max_gap : int
        Rings; 0 adds nothing.

    Returns
    -------
    added : (n,) bool
        The added points: no two within `max_gap` rings of each other, and as many as fit.
    source : (n,) intp
        Kept or added vertex that stands for each vertex: over the fewest rings, the nearest where
        several are level; -1 if nothing at all is kept.

    Notes
    -----
    The added points are a maximal independent set (Luby, SIAM J. Comput. 15(4), 1986), found in
    O(log n) rounds; priorities are scrambled vertex numbers, so the result is deterministic.
    """
    added = np.zeros(len(kept), dtype=bool)
    if max_gap:
        bare = np.flatnonzero(~_within(graph, np.flatnonzero(kept), max_gap))
        while len(bare):
            chosen = _independent(graph, bare, max_gap)
            added[chosen] = True
            bare = bare[~_within(graph, chosen, max_gap)[bare]]
    return added, _spread(points, graph, kept | added, max_gap)


def _spread(points: Floats, graph: Graph, kept: Mask, max_gap: int) -> Indices:
    """Return the source of every vertex, -1 beyond `max_gap` rings.

    With `max_gap` 0 there is no bound, and vertices that no path joins to a kept one take the
    nearest in space.
    """
    source = np.where(kept, np.arange(len(kept)), -1)
    waiting = np.flatnonzero(~kept)
    rings = 0
    while len(waiting) and (rings < max_gap or not max_gap):
        positions, bounds = row_entries(graph.indptr, waiting)
        row = np.repeat(np.arange(len(waiting)), np.diff(bounds))
        candidate = source[graph.indices[positions]]
        reached = np.flatnonzero(candidate >= 0)
        if not len(reached):
            break
        row, candidate = row[reached], candidate[reached]
        offset = points[waiting[row]] - points[candidate]
        distance = np.einsum("ec,ec->e", offset, offset)
        first = np.flatnonzero(np.append(True, row[1:] != row[:-1]))
        least = np.minimum.reduceat(distance, first)
        best = np.flatnonzero(distance == np.repeat(least, np.diff(np.append(first, len(row)))))
        best = best[np.append(True, row[best[1:]] != row[best[:-1]])]
        source[waiting[row[best]]] = candidate[best]
        waiting = waiting[source[waiting] < 0]
        rings += 1
    if not max_gap and len(waiting) and kept.any():
        living = np.flatnonzero(kept)
        source[waiting] = living[cKDTree(points[living]).query(points[waiting])[1]]
    return source


def _independent(graph: Graph, bare: Indices, rings: int) -> Indices:
    """Return the vertices of `bare` with the highest priority within `rings` rings."""
    count = len(graph.indptr) - 1
    own = 1.0 + scrambled(bare)
    priority = np.zeros(count)
    priority[bare] = own
    near = np.flatnonzero(_within(graph, bare, rings - 1))
    positions, bounds = row_entries(graph.indptr, near)
    other = graph.indices[positions]
    for _ in range(rings):
        priority[near] = np.maximum(priority[near], row_max(priority[other], bounds))
    chosen: Indices = bare[priority[bare] == own]
    return chosen


def _within(graph: Graph, vertices: Indices, rings: int) -> Mask:
    """Return whether each vertex is up to `rings` rings from one of `vertices`."""
    inside = np.zeros(len(graph.indptr) - 1, dtype=bool)
    inside[vertices] = True
    front = vertices
    for _ in range(rings):
        reached = inside.copy()
        reached[graph.indices[row_entries(graph.indptr, front)[0]]] = True
        front = np.flatnonzero(reached & ~inside)
        inside = reached
    return inside
