# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadrics against planes, points and lines whose distances are known."""

import numpy as np
import pytest
from shapes import grid

from salcore.arrays.edges import find_edges
from salcore.decimation.quadrics import (
    SEAM_WEIGHT,
    minimizers,
    monomials,
    plane_quadrics,
    point_quadrics,
    vertex_quadrics,
)


def test_a_quadric_is_the_squared_distance_to_its_plane():
    quadric = plane_quadrics(np.array([[0, 0.6, 0.8]]), np.array([[1, 2, 3.0]]), np.array([2.0]))
    away = np.array([[1, 2, 3], [5, 2, 3], [1, 2.6, 3.8], [1, 2, 8.0]])
    assert monomials(away) @ quadric[0] == pytest.approx([0, 0, 2, 2 * 16])


def test_the_minimum_of_three_planes_is_where_they_meet():
    corner = np.array([1.0, -2.0, 0.5])
    quadric = plane_quadrics(np.eye(3), np.tile(corner, (3, 1)), np.ones(3)).sum(axis=0)
    found = minimizers(quadric[None], np.array([[1.1, -2.1, 0.6]]))
    assert found == pytest.approx(corner[None], abs=1e-3)
    nothing = minimizers(np.zeros((1, 10)), np.array([[7.0, 8, 9]]))
    assert nothing.tolist() == [[7, 8, 9]]


def test_border_planes_hold_the_rim_of_a_plane():
    points, faces = grid(3, 3)
    quadrics, areas = vertex_quadrics(points, faces, find_edges(faces, 9), 1.0)
    assert areas.sum() == pytest.approx(3 * 4)
    inwards = monomials(points + np.array([0.5, 0, 0]))
    cost = np.einsum("nk,nk->n", quadrics, inwards)
    assert cost[4] == pytest.approx(0)  # the middle slides for nothing
    assert (cost[[3, 5]] > 0.1).all()  # the sides do not
    assert cost[1] == pytest.approx(0)  # along the rim is free


def errors(quadrics, points):
    return np.einsum("nk,nk->n", quadrics, monomials(np.asarray(points, dtype=float)))


def test_a_point_quadric_is_the_squared_distance():
    quadric = point_quadrics(np.array([[1.0, 2, 3]]), np.array([0.5]))
    assert errors(quadric, [[1, 2, 3]]) == pytest.approx([0.0])
    assert errors(quadric, [[2, 0, 6]]) == pytest.approx([0.5 * (1 + 4 + 9)])


TRIANGLE = np.array([[0, 0, 0], [4, 0, 0], [0, 3, 0.0]])


def test_a_face_weighs_its_area_at_all_three_corners():
    faces = np.array([[0, 1, 2]])
    quadrics, areas = vertex_quadrics(TRIANGLE, faces, find_edges(faces, 3), 0.0)
    assert areas.tolist() == [6, 6, 6]
    assert errors(quadrics, TRIANGLE + np.array([0, 0, 2])) == pytest.approx([6 * 4] * 3)


def test_a_border_weighs_the_square_on_it_at_both_ends():
    faces = np.array([[0, 1, 2]])
    edges = find_edges(faces, 3)
    quadrics, _ = vertex_quadrics(TRIANGLE, faces, edges, 0.5)
    # Corner 0 lies on the borders along x, of length 4, and along y, of length 3.
    assert errors(quadrics[:1], [[1, 0, 0]]) == pytest.approx([0.5 * 9 * 1])
    assert errors(quadrics[:1], [[0, 1, 0]]) == pytest.approx([0.5 * 16 * 1])


def roof(fold):
    """Return two triangles along the x axis, one flat, one turned by an angle from flat."""
    away = [0.5, -np.cos(fold), np.sin(fold)]
    return np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], away]), np.array([[0, 1, 2], [1, 0, 3]])


@pytest.mark.parametrize(("degrees", "held"), [(0, False), (100, False), (130, True)])
@pytest.mark.parametrize("wound_alike", [True, False])
def test_edges_that_fold_back_are_borders(degrees, held, wound_alike):
    points, faces = roof(np.radians(degrees))
    if not wound_alike:
        faces[1] = faces[1, ::-1]
    edges = find_edges(faces, 4)
    free, _ = vertex_quadrics(points, faces, edges, 0.0)
    quadrics, _ = vertex_quadrics(points, faces, edges, 1.0)
    # What borders add at vertex 0 for a step across the shared edge, in the plane of face 0.
    added = errors((quadrics - free)[:1], points[:1] + np.array([0, 1, 0]))
    across = np.array([-1, 0.5, 0]) / np.sqrt(1.25)  # at right angles to the border to vertex 2
    border = 1.25 * across[1] ** 2
    other = points[3] - points[0]
    normal = np.cross([1, 0, 0], other)
    inwards = np.cross(other, normal / np.linalg.norm(normal))
    border += inwards[1] ** 2
    shared = 1.0 + np.cos(np.radians(degrees)) ** 2 if held else 0.0
    assert added == pytest.approx([border + shared])


def test_a_seam_is_a_weaker_border():
    points, faces = roof(0.0)
    edges = find_edges(faces, 4)
    seam = (edges.low == 0) & (edges.high == 1)
    plain, _ = vertex_quadrics(points, faces, edges, 2.0)
    held, _ = vertex_quadrics(points, faces, edges, 2.0, seam)
    step = points + np.array([0, 0.5, 0])
    # Of two faces at the seam each adds the square on it.
    expected = 2.0 * SEAM_WEIGHT * 2 * 0.25
    assert errors(held - plain, step) == pytest.approx([expected, expected, 0, 0])
