# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors (5.1) (5.2) against distances found without the code under test."""

import numpy as np
import pytest
from shapes import bumpy, grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.measure.distances import distances, triangle_distances

STEPS = 48
WEIGHTS = np.array(
    [(a, b, STEPS - a - b) for a in range(STEPS + 1) for b in range(STEPS + 1 - a)]
) / float(STEPS)


def sampled(queries, triangles):
    """Return distances to dense samples of triangles, and how much too large they may be."""
    samples = np.einsum("sw,twc->tsc", WEIGHTS, triangles)
    apart = np.linalg.norm(queries[:, None, None] - samples, axis=3).min(axis=2)
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    return apart, longest / STEPS


def test_point_to_triangle_against_dense_sampling():
    rng = np.random.default_rng(2)
    triangles = rng.normal(size=(40, 3, 3))
    triangles[:8, 2] = triangles[:8, 0] + (triangles[:8, 1] - triangles[:8, 0]) * 1.7  # no area
    triangles[8:12, 2] = triangles[8:12, 1]
    queries = 2 * rng.normal(size=(25, 3))
    apart, slack = sampled(queries, triangles)
    exact = np.stack(
        [triangle_distances(queries, np.broadcast_to(t, (25, 3, 3))) for t in triangles], axis=1
    )
    assert (exact <= apart + 1e-12).all()
    assert (exact >= apart - slack).all()


@pytest.mark.parametrize("shape", ["torus", "sphere"])
def test_mesh_to_mesh_both_ways_against_dense_sampling(shape):
    if shape == "torus":
        fine, coarse = torus(14, 8), torus(9, 5)
    else:
        fine, coarse = hull_mesh(sphere_cloud(90)), hull_mesh(sphere_cloud(30))
    errors = salcore.compare(salcore.make_surface(*fine), salcore.make_surface(*coarse))
    for here, there, point, surface in (
        (fine, coarse, errors.point, errors.surface),
        (coarse, fine, errors.point_back, errors.surface_back),
    ):
        nearest = np.linalg.norm(here[0][:, None] - there[0], axis=2).min(axis=1)
        assert point.max == pytest.approx(nearest.max())
        assert point.mean == pytest.approx(nearest.sum() / len(nearest))
        assert point.rms == pytest.approx(np.sqrt((nearest**2).sum() / len(nearest)))
        apart, slack = sampled(here[0], there[0][there[1]])
        apart = apart.min(axis=1)
        assert apart.max() - slack.max() <= surface.max <= apart.max() + 1e-12
        assert apart.mean() - slack.max() <= surface.mean <= apart.mean() + 1e-12


def test_known_distances():
    # A unit square 0.25 above a large one: 0.25 everywhere there, and back from the corners of
    # the large one, at ±3, to the corners of the small one, at ±0.5.
    square, faces = grid(2, 2)
    small = salcore.make_surface(square - [0.5, 0.5, 0] + [0, 0, 0.25], faces)
    large = salcore.make_surface(6 * (square - [0.5, 0.5, 0]), faces)
    errors = salcore.compare(small, large)
    assert (errors.surface.max, errors.surface.mean) == pytest.approx((0.25, 0.25))
    back = np.sqrt(2 * 2.5**2 + 0.25**2)
    assert (errors.surface_back.max, errors.surface_back.mean) == pytest.approx((back, back))
    assert errors.point.max == pytest.approx(back)


def test_the_report_says_what_brute_force_says():
    points = bumpy(600)
    result = salcore.simplify(points, alpha=25)
    nearest = np.linalg.norm(points[:, None] - points[result.indices], axis=2).min(axis=1)
    errors = result.report.errors
    assert errors.point.max == pytest.approx(nearest.max())
    assert errors.point.mean == pytest.approx(nearest.mean())
    assert errors.point_back.max == errors.surface_back.max == 0
    assert errors.surface.max <= errors.point.max
    assert errors.diagonal == pytest.approx(np.linalg.norm(np.ptp(points, axis=0)))


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e12])
def test_errors_have_the_unit_of_the_input(scale):
    points, faces = torus(20, 10)
    points = points + 0.01 * np.random.default_rng(0).normal(size=points.shape)
    for use_faces in (faces, None):
        one = salcore.simplify(points, use_faces, ratio=0.4).report.errors
        other = salcore.simplify(scale * points, use_faces, ratio=0.4).report.errors
        assert other.surface.max == pytest.approx(scale * one.surface.max, rel=1e-6)
        assert other.point.mean == pytest.approx(scale * one.point.mean, rel=1e-6)
        assert other.diagonal == pytest.approx(scale * one.diagonal)


def test_one_triangle_against_its_own_corners():
    points, faces = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0.0]]), [[0, 1, 2]]
    middle = np.array([[1.5, 2.0, 0.0], [1.0, 1.0, 2.0]])
    to_point, to_surface = distances(middle, salcore.make_surface(points, faces))
    assert to_surface == pytest.approx([0.0, 2.0])
    assert to_point == pytest.approx([2.5, np.sqrt(6)])
