# SPDX-License-Identifier: GPL-3.0-or-later
"""Progressive elimination: vertices go one after another, each into a neighbour that stays.

Half-edge collapses, cheapest first (Hoppe, Progressive meshes, SIGGRAPH 1996), by the quadric
error of the planes that a vertex stands for, times its saliency. Every vertex gets a rank, a parent
and an error, so that any count is a cut through one order.

Collapses are done in rounds. A round takes the cheapest vertices, of which no two are neighbours,
checks them all against the surface at its start, and applies those that neither break it nor
conflict with a cheaper one. Nothing runs over vertices one by one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays.edges import find_edges
from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from ..input.wedges import MAX_SEAMS, Wedges
from ..progress import SILENT, Progress
from .costs import Costs, Weights
from .half_edges import HalfEdges, Ties
from .one_rings import OneRings
from .parts import Parts, share_ranks
from .quadrics import vertex_quadrics
from .rounds import State
from .thresholds import LAST_STEP, Scale, Thresholds, first_step
from .wedge_collapses import WedgeCollapses

COMPACT = 0.6
"""Share of the numbered vertices that still live below which these are renumbered."""
START_SHARE = 0.2
"""Share of the time that the costs of the whole surface take, before the first round."""


@dataclass(frozen=True, eq=False)
class Elimination:
    """The order in which vertices go.

    Attributes
    ----------
    rank : (n,) intp
        The vertex of rank r is among the kept of every count above r. A permutation, but for parts
        that go whole: their vertices share the highest of their ranks.
    parent : (n,) intp
        Vertex of lower rank that each went into; -1 for rank 0.
    error : (n,) float64
        Estimate of the surface error once the vertex is gone, growing with falling rank: the root
        of the largest mean square distance to the planes of a vertex so far.
    rounds : tuple of (int, int, float)
        Vertices left, collapses and largest cost of every round, for the curious.
    wedge_parent : (w,) int32 or None
        Wedge at the parent that each wedge went into; its own at rank 0. None without wedges.
    """

    rank: Indices
    parent: Indices
    error: Floats
    rounds: tuple[tuple[int, int, float], ...]
    wedge_parent: Ints | None = None
    topology_count: int = 0
    """Least count before collapses that change the topology of a surface."""
    part_ranks: Indices = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    """Ranks of the parts that go whole, ascending."""
    step: Ints | None = None
    """Step of the threshold (n,) in the round in which each went; None without `Thresholds`."""
    cost: Floats | None = None
    """Cost (n,) at which each went."""


def eliminate(
    points: Floats,
    faces: Integers,
    links: tuple[Ints, Ints],
    weights: Weights,
    seams: Integers | None = None,
    progress: Progress = SILENT,
    priority: Integers | None = None,
    wedges: Wedges | None = None,
    keep_topology: bool = False,
    scale: Scale | None = None,
    on_plane: Mask | None = None,
) -> Elimination:
    """Return the order of elimination.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 3) int
        Triangles without repeated corners; non-manifold ones, and ones of no area, are welcome.
    links : (int32, int32)
        Further edges, along which vertices may go that no face uses.
    weights : Weights
    seams : (s, 2) int, optional
        Edges that stay as lines, such as those where charts of a texture meet: their vertices go
        along them only, and where they meet or end, last.
    progress : Progress, optional
        Told the share of vertices gone.
    priority : (n,) int, optional
        A permutation that decides where costs are equal, in place of the vertices' own numbers:
        with the old numbers as priorities, the order of a renumbered surface is the same.
    wedges : Wedges, optional
        Of the first of the faces. Where there are seams, collapses that tear charts are put off.
    keep_topology : bool
        No part goes whole, and the end is where only collapses are left that change the topology.
    scale : Scale, optional
        What a tile of a cloud takes over from the whole. Large clouds, which have a `priority`,
        find their own.
    on_plane : (n,) bool, optional
        Vertices on a plane of symmetry where the surface ends: what is left, and its mirror image,
        fit together there.

    Notes
    -----
    About O(n log n): the rounds shrink geometrically. Some 550 bytes a vertex at the peak.

    While a part is a manifold it stays one, of the same topology: the link condition of Dey et al.
    holds for every collapse. Small parts go whole (`parts`). Where only forbidden collapses are
    left, they are done all the same, so that what is left ends in one vertex.
    """
    rounds = progress.part(START_SHARE, 1.0)
    part = progress.part(0.0, START_SHARE)
    state = _start(points, faces, links, weights, seams, priority, scale, part)
    if wedges is not None:
        state.wedges = WedgeCollapses.of_faces(wedges, faces)
        state.charts_hold = bool(state.half_edges.seam.any())
    state.keep_topology, state.on_plane = keep_topology, on_plane
    if len(faces) and not keep_topology:
        ends = state.half_edges.source.reshape(2, -1)
        state.parts = Parts.find((ends[0], ends[1]), state.costs, weights, priority)
    run_rounds(state, rounds)
    return number_vertices(state, priority)


def run_rounds(state: State, progress: Progress) -> None:
    """Do one round after another, until nothing is left that may go."""
    total = max(state.living, 1)
    while True:
        least = state.find_cheapest()
        candidates, leaving = state.pick_candidates(least)
        if state.must_retry(candidates | leaving):
            if not state.retry(candidates | leaving):
                break
            continue
        collapses = state.half_edges.pick_collapses(candidates, least)
        rings = OneRings.find(collapses, state.half_edges.source, state.corners, len(least))
        performed = state.select_legal(rings)
        state.perform(rings, performed, least, leaving)
        if state.thresholds is not None:
            state.thresholds.rise()
        if state.living < COMPACT * len(state.vertex_id):
            state.compact()
        progress(1.0 - state.living / total)


def _start(
    points: Floats,
    faces: Integers,
    links: tuple[Ints, Ints],
    weights: Weights,
    seams: Integers | None,
    priority: Integers | None,
    scale: Scale | None,
    progress: Progress,
) -> State:
    """Return the whole surface."""
    count = len(points)
    edges = find_edges(faces, count)
    progress(0.2)
    seam = np.zeros(len(edges.low), dtype=bool)
    if seams is not None and len(seams):
        seam = edges.among(seams, count)
    if np.count_nonzero(seam) > MAX_SEAMS * len(seam):
        seam[:] = False
    mean_face = None if scale is None else scale.mean_face
    quadrics, areas = vertex_quadrics(points, faces, edges, weights.border, seam, mean_face)
    progress(0.6)
    low = np.concatenate([edges.low, links[0]])
    high = np.concatenate([edges.high, links[1]])
    del edges  # the costs need the memory
    seam = np.concatenate([seam, np.zeros(len(links[0]), dtype=bool)])
    ties, summed = None, areas
    if priority is not None:
        swapped = priority.take(low) > priority.take(high)
        low, high = np.where(swapped, high, low), np.where(swapped, low, high)
        ties = Ties.of_edges(low, high, len(links[0]), priority)
        summed = areas[np.argsort(priority)]  # sums depend on their order
    progress(0.8)
    mean_area = float(summed.mean()) if areas.any() else 1.0
    if scale is not None:
        mean_area = scale.mean_area
    costs = Costs.of_vertices(points, quadrics, areas, weights, mean_area)
    half_edges = HalfEdges.of_edges(low, high, seam, costs, ties)
    thresholds = None
    if priority is not None or scale is not None:
        thresholds = Thresholds(first_step(mean_area))
    progress(1.0)
    return State(
        costs,
        half_edges,
        corners=[np.array(corner, dtype=np.int32, order="C") for corner in faces.T],  # copies
        degree=np.bincount(half_edges.source, minlength=count),
        guessed=weights.guessed_surface,
        vertex_id=np.arange(count),
        cluster_size=np.ones(count),
        parent=np.full(count, -1, dtype=np.intp),
        mean_square=np.zeros(count),
        living=count,
        thresholds=thresholds,
        is_tile=scale is not None,
    )


def number_vertices(state: State, priority: Integers | None = None) -> Elimination:
    """Number the vertices from the last survivor to the first removed."""
    count = len(state.parent)
    removed = np.concatenate([*state.removed, np.empty(0, dtype=np.intp)])
    alive = np.ones(count, dtype=bool)
    alive[removed] = False
    survivors = np.flatnonzero(alive)
    if priority is not None:
        survivors = survivors[np.argsort(priority[survivors])]
    # Those that stand for most go last.
    weight = np.zeros(count)
    weight[state.vertex_id] = np.where(state.costs.protected, np.inf, state.cluster_size)
    survivors = survivors[np.argsort(-weight[survivors], kind="stable")]
    rank = np.empty(count, dtype=np.intp)
    order = np.concatenate([survivors, removed[::-1]])
    rank[order] = np.arange(count)
    error = np.zeros(count)
    if len(removed):
        error[removed] = np.sqrt(np.maximum.accumulate(state.mean_square[removed]))
        error[survivors] = error[removed[-1]]
    parent = state.parent
    for vertices, _ in state.gone_parts:
        parent[vertices] = order[0]
    parent[survivors] = np.where(survivors == order[:1], -1, order[:1])
    wedge_parent = None
    if state.wedges is not None:
        wedge_parent = state.wedges.parent
        # Where components end no face is left, and any wedge will do.
        left = np.flatnonzero(wedge_parent < 0)
        root = state.wedges.wedges.first[order[0]]
        wedge_parent[left] = np.where(rank[state.wedges.wedges.vertex[left]] == 0, left, root)
    step = cost = None
    if state.thresholds is not None:
        step, cost = np.full(count, LAST_STEP, dtype=np.int32), np.full(count, np.inf)
        sizes = [len(vertices) for vertices in state.removed]
        step[removed] = np.repeat(state.steps, sizes)
        cost[removed] = np.concatenate([*state.costs_then, np.empty(0)])
    least = state.topology_count or state.living
    parts = share_ranks(rank, state.gone_parts)
    return Elimination(
        rank, parent, error, tuple(state.rounds), wedge_parent, least, parts, step, cost
    )
