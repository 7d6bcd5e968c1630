# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts through an order: ancestors, faces, positions, and ranks in the input's numbers."""

import dataclasses

import numpy as np
import pytest
from models import load_model
from shapes import grid

import salcore
from salcore.decimation.cut import cut_faces, living_ancestors, optimal_positions
from salcore.decimation.order import Elimination


def test_ancestors_by_hand():
    # 4 -> 3 -> 2 -> 0 and 5 -> 1 -> 0.
    parent = np.array([-1, 0, 0, 2, 3, 1])
    order = Elimination(np.arange(6), parent, np.zeros(6), ())
    assert living_ancestors(order, 6).tolist() == [0, 1, 2, 3, 4, 5]
    assert living_ancestors(order, 3).tolist() == [0, 1, 2, 2, 2, 1]
    assert living_ancestors(order, 1).tolist() == [0, 0, 0, 0, 0, 0]


def test_cut_faces_by_hand():
    faces = np.array([[0, 1, 2], [2, 1, 3], [3, 4, 0], [4, 2, 0], [3, 2, 1]])
    source = np.array([0, 1, 2, 3, 3])
    left, which = cut_faces(faces, source)
    # Face 2 lost a corner; face 4 has the corners of face 1.
    assert left.tolist() == [[0, 1, 2], [2, 1, 3], [3, 2, 0]]
    assert which.tolist() == [0, 1, 3]


def test_the_best_place_of_a_cube_corner_is_where_its_planes_meet():
    points = np.concatenate([[[0.1, 0.1, 0.1]], np.eye(3), [[0, 1, 1], [1, 0, 1], [1, 1, 0.0]]])
    points[0] = 0.1  # cut off a little
    faces = np.array([[0, 1, 6], [0, 6, 2], [0, 2, 4], [0, 4, 3], [0, 3, 5], [0, 5, 1]])
    moved = optimal_positions(points, faces, 0.0, np.arange(7), faces)
    before = np.linalg.norm(points[0])
    assert np.linalg.norm(moved[0] - points[0]) < before
    assert np.isfinite(moved).all()
    flat, square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), [[0, 1, 2], [0, 2, 3]]
    square = np.array(square)
    stay = optimal_positions(flat, square, 1.0, np.arange(4), square)
    assert stay == pytest.approx(flat, abs=1e-12)


def test_optimal_positions_lower_the_error_and_turn_no_face():
    points, faces = load_model("rockerArm.ply")
    cut = salcore.Parameters(refine=False)
    original = salcore.simplify(points, faces, parameters=cut, ratio=0.02)
    parameters = dataclasses.replace(cut, placement="optimal")
    moved = salcore.simplify(points, faces, parameters=parameters, ratio=0.02)
    assert (moved.indices == original.indices).all()
    assert moved.positions.shape == (len(moved.indices), 3)
    assert original.positions is None
    assert moved.report.errors.surface.rms < 0.8 * original.report.errors.surface.rms
    assert np.isfinite(moved.positions).all()


@pytest.mark.parametrize("with_faces", [True, False])
def test_ranks_are_those_of_every_cut(with_faces):
    points, faces = grid(13, 9)
    points = np.concatenate([points, points[:5], [[np.nan, 0, 0]]])
    analysis = salcore.analyze(points, faces if with_faces else None)
    order = analysis.ranking()
    n = len(points)
    assert sorted(order.rank.tolist()) == list(range(n))
    assert order.rank[-1] == n - 1
    assert set(order.rank[n - 6 : n - 1]) == set(range(n - 6, n - 1))
    root = int(np.argmin(order.rank))
    assert order.parent[root] == -1
    others = np.arange(n) != root
    assert (order.rank[order.parent[others]] < order.rank[others]).all()
    for count in (1, 10, 60, n - 6, n - 3):
        result = analysis.simplify(count=count)
        np.testing.assert_array_equal(np.flatnonzero(order.rank < count), result.indices)
        ancestor = np.where(order.rank < count, np.arange(n), order.parent)
        for _ in range(order.generations):
            ancestor = ancestor[ancestor]
        known = result.source >= 0
        np.testing.assert_array_equal(ancestor[known], result.indices[result.source[known]])


def test_the_least_inputs():
    assert len(salcore.analyze(np.empty((0, 3))).ranking().rank) == 0
    one = salcore.analyze([[1.0, 2.0, 3.0]]).ranking()
    assert (one.rank.tolist(), one.parent.tolist(), one.generations) == ([0], [-1], 0)
    twins = salcore.analyze([[1.0, 2.0, 3.0]] * 3).ranking()
    assert (twins.rank.tolist(), twins.parent.tolist()) == ([0, 1, 2], [-1, 0, 0])
