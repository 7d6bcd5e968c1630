# SPDX-License-Identifier: GPL-3.0-or-later
"""Costs of collapses, worked out by hand."""

import numpy as np
import pytest

from salcore.decimation.costs import LEAST_AREA, Costs, Weights
from salcore.decimation.quadrics import plane_quadrics


def costs_of(evenness=0.0):
    """Return costs of three points on the x axis, the first on planes at x = 0, y = 0 of weight 2.

    Areas are 4, 9 and none; the second point is twice as dear, and the third protected.
    """
    points = np.array([[0, 0, 0], [3, 0, 0], [7, 0, 0.0]])
    quadric = np.zeros((3, 10))
    for normal in ([1.0, 0, 0], [0, 1.0, 0]):
        quadric[:1] += plane_quadrics(np.array([normal]), points[:1], np.array([2.0]))
    weights = Weights(
        factor=np.array([1.0, 2, 1]),
        evenness=np.full(3, evenness),
        guessed_surface=np.zeros(3, dtype=bool),
        protected=np.array([False, False, True]),
        border=1.0,
    )
    return Costs.of_vertices(points, quadric, np.array([4.0, 9, 0]), weights, 5.0)


def ends(*pairs):
    return np.array(pairs, dtype=np.int32).T


def test_a_cost_is_the_error_by_the_root_of_the_area_times_the_factor():
    costs = costs_of()
    found = costs.evaluate(*ends((0, 1), (0, 2), (1, 0), (2, 0)))
    assert found == pytest.approx([2 * 9 / 2, 2 * 49 / 2, 0, np.inf])
    assert costs.area == pytest.approx([4, 9, LEAST_AREA * 5])


def test_evenness_adds_the_squared_distance():
    # A third of the area of the mean at least, times evenness, times the squared distance.
    found = costs_of(evenness=0.6).evaluate(*ends((0, 1), (1, 0)))
    to_planes = 2 * 9
    assert found == pytest.approx([(to_planes + 0.6 * 5 / 3 * 9) / 2, 2 * (0.6 * 9 / 3 * 9) / 3])


def test_what_is_kept_stands_for_what_is_removed():
    costs = costs_of()
    changed = costs.merge(np.array([0, 2]), np.array([1, 1]))
    assert changed.tolist() == [1]
    assert costs.area[1] == pytest.approx(4 + 9 + LEAST_AREA * 5)
    assert costs.self_error[1] == pytest.approx(2 * 9)
    assert costs.mean_square(np.array([1])) == pytest.approx([18 / (13 + LEAST_AREA * 5)])
    # The error of both quadrics at the target counts, the target's own included.
    costs.merge(np.array([1]), np.array([2]))
    assert costs.self_error[2] == pytest.approx(2 * 49)


def test_the_living_keep_all_that_is_theirs():
    costs = costs_of()
    before = costs.evaluate(*ends((0, 2), (2, 0)))
    costs.compact(np.array([0, 2]))
    assert len(costs.points) == len(costs.quadric) == len(costs.monomials) == 2
    assert (costs.evaluate(*ends((0, 1), (1, 0))) == before).all()
