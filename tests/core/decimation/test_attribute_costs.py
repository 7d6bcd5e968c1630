# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of points, such as colours, count beside distances."""

import numpy as np
import pytest
from shapes import bumpy, grid, hull_mesh

import salcore
from salcore.decimation.attribute_costs import AttributeCosts


def test_moments_sum_the_squared_differences_of_all_that_went_in():
    rng = np.random.default_rng(0)
    values, areas = rng.random((6, 3)), rng.random(6)
    costs = AttributeCosts.of_points(values, areas)
    costs.merge(np.array([1, 2, 5]), np.array([0, 3]), np.array([0, 0, 1]))
    gone_into = {0: [0, 1, 2], 3: [3, 5]}
    for source, members in gone_into.items():
        for target in (0, 3, 4):
            squares = ((values[members] - values[target]) ** 2).sum(axis=1)
            expected = (areas[members] * squares).sum()
            error = costs.evaluate(np.array([source]), np.array([target]))
            np.testing.assert_allclose(error, expected, atol=1e-14)
    costs.compact(np.array([0, 3, 4]))
    assert len(costs.values) == len(costs.total) == len(costs.square) == len(costs.weight) == 3


def painted(points, size):
    """Return a checker's colours."""
    return ((points[:, :2] // size).sum(axis=1) % 2)[:, None] * 255.0


def colour_error(points, faces, size):
    """Return the root mean square error of a checker's colours over flat faces."""
    rng = np.random.default_rng(0)
    a, b, c = (points[faces[:, k], :2] for k in range(3))
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    face = rng.choice(len(faces), 20000, p=area / area.sum())
    share = rng.dirichlet((1, 1, 1), len(face))
    place = (points[faces[face]] * share[:, :, None]).sum(axis=1)
    shown = (painted(points, size)[faces[face], 0] * share).sum(axis=1)
    return np.sqrt(np.mean((shown - painted(place, size)[:, 0]) ** 2))


def test_borders_of_colours_stay_on_a_flat_side():
    points, faces = grid(60, 60)
    analysis = salcore.analyze(points, faces)
    plain = analysis.simplify(ratio=0.1)
    colours = painted(points, 9.5)
    painted_result = analysis.simplify(ratio=0.1, point_values=colours)
    before, after = (
        colour_error(points[result.indices], result.faces, 9.5)
        for result in (plain, painted_result)
    )
    assert after < 0.9 * before
    same = analysis.simplify(ratio=0.1, point_values=colours / 255)  # the unit does not matter
    np.testing.assert_array_equal(same.indices, painted_result.indices)


def test_shape_comes_first():
    points, faces = hull_mesh(bumpy(2000) / np.linalg.norm(bumpy(2000), axis=1)[:, None])
    values = np.random.default_rng(0).random((len(points), 3))
    plain, noisy = (
        salcore.simplify(points, faces, ratio=0.1, point_values=v).errors.surface.rms
        for v in (None, values)
    )
    assert noisy < 1.02 * plain


def test_colours_without_a_difference_change_nothing():
    points, faces = grid(20, 20)
    analysis = salcore.analyze(points, faces)
    plain = analysis.simplify(ratio=0.2)
    grey = analysis.simplify(ratio=0.2, point_values=np.full((400, 3), 7))
    np.testing.assert_array_equal(plain.indices, grey.indices)


@pytest.mark.parametrize("values", [np.zeros((3, 3)), np.zeros((400, 3, 2))])
def test_values_must_fit_the_points(values):
    points, faces = grid(20, 20)
    with pytest.raises(salcore.GeometryError, match="point_values of shape"):
        salcore.simplify(points, faces, ratio=0.2, point_values=values)
