# SPDX-License-Identifier: GPL-3.0-or-later
"""The coverage guard: no vertex is left far from a kept one, counted in rings of the graph.

Our extension of the paper's gap rule, which closes most gaps but promises nothing.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..arrays.blocks import run_blocks, worker_count
from ..arrays.rows import row_entries, row_max
from ..arrays.types import Indices, Mask
from ..arrays.vectors import dot, hash01
from ..input.geometry import Geometry
from ..progress import SILENT, Progress
from .graph import Graph


def close_gaps(
    geometry: Geometry, graph: Graph, kept: Mask, max_gap: int, progress: Progress = SILENT
) -> tuple[Mask, Indices]:
    """Add points until every vertex is within `max_gap` rings of a kept one.

    Parameters
    ----------
    geometry : Geometry
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
    O(log n) rounds; priorities are hashed numbers of vertices, so the result is deterministic, but
    another order of the points adds others.
    """
    added = np.zeros(len(kept), dtype=bool)
    if max_gap:
        matrix = graph.matrix()
        bare = np.flatnonzero(~_within(matrix, kept, max_gap))
        total = max(len(bare), 1)
        while len(bare):
            chosen = np.zeros(len(kept), dtype=bool)
            chosen[_independent(graph, matrix, bare, geometry.number, max_gap)] = True
            added |= chosen
            bare = bare[~_within(matrix, chosen, max_gap)[bare]]
            progress(0.5 * (1.0 - len(bare) / total))
    source = _spread(geometry, graph, kept | added, max_gap, progress.part(0.5, 1.0))
    return added, source


def _within(matrix: sparse.csr_array, vertices: Mask, rings: int) -> Mask:
    """Return whether each vertex is up to `rings` rings from one of `vertices` (n,)."""
    inside = vertices
    for _ in range(rings):
        inside = inside | (matrix @ inside)
    return inside


def _independent(
    graph: Graph, matrix: sparse.csr_array, bare: Indices, number: Indices, rings: int
) -> Indices:
    """Return the vertices of `bare` with the highest priority within `rings` rings."""
    own = 1.0 + hash01(number[bare])
    priority = np.zeros(matrix.shape[0])
    priority[bare] = own
    near = np.flatnonzero(_within(matrix, priority > 0.0, rings - 1))
    positions, bounds = row_entries(graph.indptr, near)
    neighbors = graph.indices[positions]
    for _ in range(rings):
        priority[near] = np.maximum(priority[near], row_max(priority[neighbors], bounds))
    chosen: Indices = bare[priority[bare] == own]
    return chosen


def _spread(
    geometry: Geometry, graph: Graph, kept: Mask, max_gap: int, progress: Progress
) -> Indices:
    """Return the source of every vertex, -1 beyond `max_gap` rings.

    With `max_gap` 0 there is no bound, and vertices that no path joins to a kept one take the
    nearest in space.
    """
    source = np.where(kept, np.arange(len(kept)), -1)
    waiting = np.flatnonzero(~kept)
    total, rings = max(len(waiting), 1), 0
    while len(waiting) and (rings < max_gap or not max_gap):
        found = _nearest_sources(geometry, graph, source, waiting)
        if not (found >= 0).any():
            break
        source[waiting] = found
        waiting = waiting[found < 0]
        rings += 1
        progress(1.0 - len(waiting) / total)
    if not max_gap and len(waiting) and kept.any():
        living = np.flatnonzero(kept)
        tree = cKDTree(geometry.points[living])
        source[waiting] = living[tree.query(geometry.points[waiting], workers=worker_count())[1]]
    return source


def _nearest_sources(
    geometry: Geometry, graph: Graph, source: Indices, waiting: Indices
) -> Indices:
    """Return the nearest of the neighbours' sources for each of some vertices; -1 for none."""
    points, number = geometry.points, geometry.number
    result = np.full(len(waiting), -1, dtype=np.intp)

    def search(start: int, stop: int) -> None:
        block = waiting[start:stop]
        positions, bounds = row_entries(graph.indptr, block)
        row = np.repeat(np.arange(len(block)), np.diff(bounds))
        candidate = source[graph.indices[positions]]
        reached = np.flatnonzero(candidate >= 0)
        row, candidate = row[reached], candidate[reached]
        offset = points[block[row]] - points[candidate]
        # The nearest of each row, the first of the input where two are level.
        order = np.lexsort((number[candidate], dot(offset, offset), row))
        first = order[np.append(True, row[order][1:] != row[order][:-1])[: len(order)]]
        result[start + row[first]] = candidate[first]

    run_blocks(search, len(waiting))
    return result
