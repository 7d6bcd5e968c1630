# SPDX-License-Identifier: GPL-3.0-or-later
"""Half-edges: which are cheapest, which go together, and what becomes of the others."""

import numpy as np
import pytest

from salcore.decimation.costs import Costs, Weights
from salcore.decimation.half_edges import HalfEdges, Ties
from salcore.decimation.one_rings import OneRings, twin

# Three triangles round vertex 0, and one more beyond edge 2-3.
FACES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [2, 4, 3]])
LOW = np.array([0, 0, 0, 1, 1, 2, 2, 3], dtype=np.int32)
HIGH = np.array([1, 2, 3, 2, 3, 3, 4, 4], dtype=np.int32)


def costs_of(count):
    """Return costs of points on the x axis that stand for planes at their own x."""
    points = np.column_stack([np.arange(count, dtype=float) ** 2, np.zeros((count, 2))])
    quadric = np.zeros((count, 10))
    quadric[:, 0], quadric[:, 3], quadric[:, 9] = 1, -points[:, 0], points[:, 0] ** 2
    nothing = np.zeros(count)
    weights = Weights(nothing + 1, nothing, nothing > 0, nothing > 0, 1.0)
    return Costs.of_vertices(points, quadric, nothing + 1, weights, 1.0)


def half_edges_of(low=LOW, high=HIGH, seam=(), ties=None):
    on_seam = np.isin(np.arange(len(low)), seam)
    return HalfEdges.of_edges(
        low, high, on_seam, costs_of(int(max(low.max(), high.max())) + 1), ties
    )


def corners():
    return [np.ascontiguousarray(corner, dtype=np.int32) for corner in FACES.T]


def edges_of(half_edges):
    """Return the living edges as sorted pairs."""
    low, high = half_edges.source.reshape(2, -1)
    pairs = np.sort(np.column_stack([low, high])[low != high], axis=1)
    return sorted(map(tuple, pairs.tolist()))


def test_twins_run_back():
    half_edges = half_edges_of()
    half = np.arange(16)
    assert (twin(twin(half, 8), 8) == half).all()
    assert half_edges.target(half).tolist() == [*HIGH, *LOW]


def test_costs_are_squared_distances_both_ways():
    half_edges = half_edges_of()
    distance = (HIGH.astype(float) ** 2 - LOW.astype(float) ** 2) ** 2
    assert half_edges.cost == pytest.approx([*distance, *distance])
    assert half_edges.find_cheapest().tolist() == [1, 1, 9, 25, 49]


def test_leaving_a_seam_costs_more():
    half_edges = half_edges_of(seam=[0, 1])  # 1 - 0 - 2
    plain = half_edges_of().cost
    assert half_edges.seams.tolist() == [2, 1, 1, 0, 0]
    factor = half_edges.cost / plain
    # Out of vertex 0 to 1, 2 and 3; then the seam's ends 1 and 2, wherever they go.
    assert factor[:3].tolist() == [1, 1, 10]
    assert factor[[3, 4, 5, 6, 8, 9, 11]].tolist() == [10] * 7
    assert factor[[7, 10, 12, 13, 14, 15]].tolist() == [1] * 6
    half_edges.drop_seams()
    assert not half_edges.seam.any()
    assert not half_edges.seams.any()


def test_the_cheapest_of_neighbours_are_picked():
    # A path; costs of its vertices are given.
    path = np.arange(6, dtype=np.int32)
    half_edges = half_edges_of(path, path + 1)
    least = np.array([5.0, 4, 3, 2, 6, 1, 7])
    half_edges.cost = np.minimum(least[half_edges.source], 99.0)
    everyone = np.ones(7, dtype=bool)
    picked = half_edges.pick_collapses(everyone, least)
    # 3 and 5 beat their neighbours; 1 has lost only to 2, which has lost, and 0 lost to 1.
    assert half_edges.source[picked].tolist() == [5, 3, 1]
    some = least > 2
    assert half_edges.source[half_edges.pick_collapses(some, least)].tolist() == [2, 0, 4, 6]


def test_equal_costs_go_by_number_or_by_priority():
    path = np.arange(3, dtype=np.int32)
    half_edges = half_edges_of(path, path + 1)
    half_edges.cost[:] = 1.0
    least, everyone = np.ones(4), np.ones(4, dtype=bool)
    picked = half_edges.pick_collapses(everyone, least)
    assert half_edges.source[picked].tolist() == [0, 2]
    # The last half-edge counts: towards lower numbers where there is one.
    assert half_edges.target(picked).tolist() == [1, 1]
    # The same with the numbers of vertices the other way round.
    low, high = path[::-1] + 1, path[::-1].copy()
    ties = Ties.of_edges(low, high, 0, np.array([3, 2, 1, 0]))
    assert ties.edge.tolist() == [0, 1, 2]
    half_edges = half_edges_of(low, high, ties=ties)
    half_edges.cost[:] = 1.0
    picked = half_edges.pick_collapses(everyone, least)
    assert half_edges.source[picked].tolist() == [3, 1]
    assert half_edges.target(picked).tolist() == [2, 2]


def test_failures_grow_dearer_and_are_forgotten():
    half_edges, costs = half_edges_of(), costs_of(5)
    before = half_edges.cost.copy()
    half_edges.cost[1] = 0.0
    half_edges.penalize(np.array([0, 1, 2]), np.array([10.0, np.inf, np.inf]))
    assert half_edges.cost[:3].tolist() == [10 * before[0], np.inf, np.inf]
    assert half_edges.failed[:4].tolist() == [True, False, False, False]
    assert half_edges.forget_failures(costs)
    assert half_edges.cost.tolist() == [10 * before[0], *before[1:]]
    costs.protected[:] = True
    half_edges.cost[:] = np.inf
    assert not half_edges.forget_failures(costs)


def test_a_collapse_hangs_edges_on_the_kept_vertex():
    half_edges, costs = half_edges_of(), costs_of(5)
    degree = np.bincount(half_edges.source)
    rings = OneRings.find(np.array([1]), half_edges.source, corners(), 5)  # 0 into 2
    assert (rings.removed.tolist(), rings.kept.tolist()) == ([0], [2])
    assert sorted(rings.faces.tolist()) == [0, 1, 2]
    assert rings.faces[rings.vanishing].tolist() == [0, 1]
    assert rings.other[rings.shared].tolist() == [1, 3]
    half_edges.rewire(rings, np.array([True]), degree)
    assert edges_of(half_edges) == [(1, 2), (1, 3), (2, 3), (2, 4), (3, 4)]
    assert degree[1:].tolist() == [2, 3, 3, 2]
    assert half_edges.dead == 3
    assert np.isinf(half_edges.cost[[0, 1, 2, 8, 9, 10]]).all()
    half_edges.renew(costs.merge(rings.removed, rings.kept), costs)
    assert half_edges.dead == 0  # more than a tenth: dropped
    assert len(half_edges.seam) == 5
    # 2 stands for 0 as well, at a distance of 4: into 1 both go, by the root of two areas.
    half = np.flatnonzero((half_edges.source == 2) & (half_edges.target(np.arange(10)) == 1))
    assert half_edges.cost[half] == pytest.approx([(1 + 9) / np.sqrt(2)])


def test_edges_move_where_nothing_is_shared():
    low, high = np.array([0, 1], dtype=np.int32), np.array([1, 2], dtype=np.int32)
    half_edges = half_edges_of(low, high, seam=[0, 1])
    degree = np.bincount(half_edges.source)
    nothing = [np.empty(0, dtype=np.int32)] * 3
    rings = OneRings.find(np.array([2]), half_edges.source, nothing, 3)  # 1 into 0
    half_edges.rewire(rings, np.array([True]), degree)
    assert edges_of(half_edges) == [(0, 2)]
    assert degree[[0, 2]].tolist() == [1, 1]
    assert half_edges.seams[[0, 2]].tolist() == [1, 1]


def test_a_seam_that_is_laid_upon_an_edge_makes_it_a_seam():
    half_edges = half_edges_of(seam=[0, 2])  # 1 - 0 - 3
    degree = np.bincount(half_edges.source)
    rings = OneRings.find(np.array([1]), half_edges.source, corners(), 5)  # 0 into 2
    half_edges.rewire(rings, np.array([True]), degree)
    low, high = half_edges.source.reshape(2, -1)
    alive = half_edges.seam & (low != high)
    assert sorted(zip(low[alive].tolist(), high[alive].tolist(), strict=True)) == [(1, 2), (2, 3)]
    assert half_edges.seams[1:].tolist() == [1, 2, 1, 0]


def test_the_living_are_renumbered():
    half_edges = half_edges_of()
    before = half_edges.cost.copy()
    number = np.array([1, 0, 2, 3, 4], dtype=np.int32)
    half_edges.renumber(number, np.array([1, 0, 2, 3, 4]))
    assert edges_of(half_edges)[:3] == [(0, 1), (0, 2), (0, 3)]
    assert (half_edges.cost == before).all()
