# SPDX-License-Identifier: GPL-3.0-or-later
"""Where corners and edges of a result come from."""

import numpy as np
import pytest
from shapes import grid

import salcore
from salcore.decimation.attribute_transfer import corner_sources, edge_sources


def roof(width=13, height=9):
    points, faces = grid(width, height)
    points = points.copy()
    points[:, 2] = -np.abs(points[:, 0] - points[:, 0].mean())
    return points, faces


def edges_of(faces):
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def test_corners_belong_to_the_kept_vertex_and_to_its_chart():
    points, faces = roof()
    ridge = points[:, 0].mean()
    right = points[faces].mean(axis=1)[:, 0] > ridge
    charts = points[faces][:, :, :2] + 100.0 * right[:, None, None]
    result = salcore.simplify(points, faces, ratio=0.3)
    corners = result.corner_source(faces, charts)
    assert corners.shape == result.faces.shape
    np.testing.assert_array_equal(
        points[faces.ravel()[corners]], points[result.indices[result.faces]]
    )
    chosen = charts.reshape(-1, 2)[corners]
    assert (
        (chosen[:, :, 0] > 50)
        .all(axis=1)[points[result.indices[result.faces]][:, :, 0].mean(axis=1) > ridge]
        .all()
    )
    # Without charts any corner of the vertex does.
    np.testing.assert_array_equal(
        faces.ravel()[result.corner_source(faces)], result.indices[result.faces]
    )


def test_a_crease_goes_on_along_what_is_left_of_it():
    points, faces = roof()
    ridge = np.flatnonzero(points[:, 0] == points[:, 0].mean())
    result = salcore.simplify(points, faces, ratio=0.3)
    old, new = edges_of(faces), edges_of(result.faces)
    source = result.edge_source(old, new)
    on_ridge = np.isin(result.indices[new], ridge).all(axis=1)
    assert 0 < on_ridge.sum() < len(ridge) - 1
    crease = np.isin(old, ridge).all(axis=1)
    np.testing.assert_array_equal(crease[source], on_ridge)


def test_edges_without_an_origin():
    points, faces = roof()
    result = salcore.simplify(points, faces, ratio=1.0)
    new = np.array([[0, 1], [0, len(points) - 1]])
    assert result.edge_source(new[:1], new).tolist() == [0, -1]
    assert result.edge_source(np.empty((0, 2), int), new).tolist() == [-1, -1]
    with pytest.raises(salcore.GeometryError, match="has none"):
        salcore.simplify(points, ratio=0.5).corner_source(faces)


def test_corners_by_hand():
    # Vertex 1 went into 2, which has a corner in each of two charts, at u = 1 and at u = 9.
    corners = np.array([[0, 1, 3], [2, 3, 4], [5, 2, 6]])
    charts = np.array([[[0.0], [2], [0]], [[1], [0], [1]], [[9], [9], [8]]])
    found = corner_sources(corners, np.array([[0, 2, 3]]), np.array([[0, 1, 2]]), charts)
    assert found.tolist() == [[0, 3, 2]]
    charts[0, 1] = 8
    found = corner_sources(corners, np.array([[0, 2, 3]]), np.array([[0, 1, 2]]), charts)
    assert found.tolist() == [[0, 7, 2]]
    same = corner_sources(corners, corners, np.arange(9).reshape(3, 3), charts)
    assert same.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]


def test_edges_by_hand():
    # Points 1 and 2 went into 0, point 4 into 3. Edge 2-4 lies along 0-3, edge 1-3 does not.
    points = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [4, 0, 0], [3, 0, 0.0]])
    edges = np.array([[1, 3], [2, 4], [0, 1], [0, 2]])
    ends = np.array([[0, 1], [0, 1], [0, 0], [0, 0]])
    kept, new = np.array([0, 3]), np.array([[1, 0]])
    assert edge_sources(points, edges, ends, kept, new).tolist() == [1]
    assert edge_sources(points, edges[:1], ends[:1], kept, new).tolist() == [0]
    assert edge_sources(points, edges[2:], ends[2:], kept, new).tolist() == [-1]
    dropped = np.array([[0, -1]])
    assert edge_sources(points, edges[:1], dropped, kept, new).tolist() == [-1]


def test_places_of_moved_points_have_the_values_of_the_original():
    points, faces = roof()
    values = points[:, :2]  # linear along the roof, so that interpolation is exact
    parameters = salcore.Parameters(placement="optimal")
    result = salcore.simplify(points, faces, ratio=0.2, parameters=parameters)
    face, weights = result.place_source()
    assert (weights >= -1e-12).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    interpolated = np.einsum("pk,pkd->pd", weights, values[faces[face]])
    np.testing.assert_allclose(interpolated, result.positions[:, :2], atol=0.1)
    # Points that stay are corners of their faces; those that no face uses have none.
    more = np.concatenate([points, [[50.0, 50, 50]]])
    face, weights = salcore.simplify(more, faces, ratio=1.0).place_source()
    assert face[-1] == -1
    own = (weights[:-1, :, None] * points[faces[face[:-1]]]).sum(axis=1)
    np.testing.assert_allclose(own, points, atol=1e-12)
    with pytest.raises(salcore.GeometryError, match="has none"):
        salcore.simplify(points, ratio=0.5).place_source()


def test_corners_that_moved_take_the_values_of_their_new_places():
    points, faces = grid(30, 30)
    points[:, 2] = np.sin(points[:, 0] / 3) * np.cos(points[:, 1] / 4)
    middle = points[faces].mean(axis=1)
    # Two charts, in each of which the texture lies as the points do.
    texture = points[faces][:, :, :2] + 100.0 * (middle[:, 0] > 14)[:, None, None]
    parameters = salcore.Parameters(placement="optimal")
    result = salcore.simplify(
        points, faces, parameters=parameters, ratio=0.1, corner_values=texture
    )
    face, weights = result.corner_places()
    np.testing.assert_allclose(weights.sum(axis=2), 1.0)
    values = (weights[..., None] * texture[face]).sum(axis=2)
    places = result.positions[result.faces][:, :, :2]
    chart = np.where(values[:, :, 0] > 60, 100.0, 0.0)
    off = np.linalg.norm(values - chart[:, :, None] - places, axis=2)
    stale = texture.reshape(-1, 2)[result.face_corners] - chart[:, :, None]
    stale_off = np.linalg.norm(stale - places, axis=2)
    assert np.median(off) < 0.1 * np.median(stale_off)
    assert (np.ptp(values[:, :, 0], axis=1) < 60).all()  # no chart is torn


def test_corners_that_stayed_keep_their_own_values():
    points, faces = grid(12, 12)
    result = salcore.simplify(points, faces, ratio=0.3)
    face, weights = result.corner_places()
    np.testing.assert_array_equal(3 * face + weights.argmax(axis=2), result.face_corners)
    assert (weights.max(axis=2) == 1.0).all()
