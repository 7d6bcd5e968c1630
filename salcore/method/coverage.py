# SPDX-License-Identifier: GPL-3.0-or-later
"""The coverage guard: no vertex is left far from a kept one, counted in rings of the graph.

Our extension of the paper's gap rule, which closes most gaps but promises nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .blocks import BLOCK, rest_blocks
from .geometry import Floats, Indices
from .graph import Graph, scrambled
from .progress import Rests
from .rows import row_entries, row_max

Mask = NDArray[np.bool_]


def close_gaps(
    points: Floats, graph: Graph, kept: Mask, max_gap: int, workers: int = 0
) -> Rests[tuple[Mask, Indices]]:
    """Add points until every vertex is within `max_gap` rings of a kept one, with rests.

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
    O(log n) rounds; priorities are scrambled vertex numbers, so the result is deterministic, but
    another order of the points adds others.
    """
    added = np.zeros(len(kept), dtype=bool)
    if max_gap:
        covered = yield from _within(graph, np.flatnonzero(kept), max_gap)
        bare = np.flatnonzero(~covered)
        while len(bare):
            chosen = yield from _independent(graph, bare, max_gap, workers)
            added[chosen] = True
            covered = yield from _within(graph, chosen, max_gap)
            bare = bare[~covered[bare]]
    source = yield from _spread(points, graph, kept | added, max_gap, workers)
    return added, source


def _spread(points: Floats, graph: Graph, kept: Mask, max_gap: int, workers: int) -> Rests[Indices]:
    """Return the source of every vertex, -1 beyond `max_gap` rings.

    With `max_gap` 0 there is no bound, and vertices that no path joins to a kept one take the
    nearest in space.
    """
    source = np.where(kept, np.arange(len(kept)), -1)
    waiting = np.flatnonzero(~kept)
    rings = 0
    while len(waiting) and (rings < max_gap or not max_gap):
        found = np.full(len(waiting), -1, dtype=np.intp)

        def reach(
            start: int, stop: int, waiting: Indices = waiting, found: Indices = found
        ) -> None:
            found[start:stop] = _nearest_source(points, graph, source, waiting[start:stop])

        yield from rest_blocks(reach, len(waiting), workers=workers)
        if not (found >= 0).any():
            break
        source[waiting] = found
        waiting = waiting[found < 0]
        rings += 1
        yield
    if not max_gap and len(waiting) and kept.any():
        living = np.flatnonzero(kept)
        yield
        tree = cKDTree(points[living])
        yield

        def find(start: int, stop: int) -> None:
            block = waiting[start:stop]
            source[block] = living[tree.query(points[block])[1]]

        yield from rest_blocks(find, len(waiting), workers=workers)
    return source


def _nearest_source(points: Floats, graph: Graph, source: Indices, waiting: Indices) -> Indices:
    """Return the nearest of the neighbours' sources for each of some vertices; -1 for none."""
    result = np.full(len(waiting), -1, dtype=np.intp)
    positions, bounds = row_entries(graph.indptr, waiting)
    row = np.repeat(np.arange(len(waiting)), np.diff(bounds))
    candidate = source[graph.indices[positions]]
    reached = np.flatnonzero(candidate >= 0)
    if not len(reached):
        return result
    row, candidate = row[reached], candidate[reached]
    offset = points[waiting[row]] - points[candidate]
    distance = np.einsum("ec,ec->e", offset, offset)
    first = np.flatnonzero(np.append(True, row[1:] != row[:-1]))
    least = np.minimum.reduceat(distance, first)
    best = np.flatnonzero(distance == np.repeat(least, np.diff(np.append(first, len(row)))))
    best = best[np.append(True, row[best[1:]] != row[best[:-1]])]
    result[row[best]] = candidate[best]
    return result


def _independent(graph: Graph, bare: Indices, rings: int, workers: int) -> Rests[Indices]:
    """Return the vertices of `bare` with the highest priority within `rings` rings."""
    count = len(graph.indptr) - 1
    own = 1.0 + scrambled(bare)
    priority = np.zeros(count)
    priority[bare] = own
    near = np.flatnonzero((yield from _within(graph, bare, rings - 1)))
    raised = np.empty(len(near))

    def raise_(start: int, stop: int) -> None:
        block = near[start:stop]
        positions, bounds = row_entries(graph.indptr, block)
        around = row_max(priority[graph.indices[positions]], bounds)
        raised[start:stop] = np.maximum(priority[block], around)

    for _ in range(rings):
        yield from rest_blocks(raise_, len(near), workers=workers)
        priority[near] = raised
    chosen: Indices = bare[priority[bare] == own]
    return chosen


def _within(graph: Graph, vertices: Indices, rings: int) -> Rests[Mask]:
    """Return whether each vertex is up to `rings` rings from one of `vertices`."""
    inside = np.zeros(len(graph.indptr) - 1, dtype=bool)
    inside[vertices] = True
    front = vertices
    for _ in range(rings):
        reached = inside.copy()
        for start in range(0, len(front), BLOCK):
            positions, _ = row_entries(graph.indptr, front[start : start + BLOCK])
            reached[graph.indices[positions]] = True
            yield
        front = np.flatnonzero(reached & ~inside)
        inside = reached
    return inside
