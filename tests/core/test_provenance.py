# SPDX-License-Identifier: GPL-3.0-or-later
"""Where corners, edges and ranks of a result come from."""

import numpy as np
import pytest
from shapes import grid

import salcore


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


def ranking(analysis, **wishes):
    return salcore.run(analysis.ranking_steps(**wishes))


@pytest.mark.parametrize("with_faces", [True, False])
def test_ranks_are_those_of_every_cut(with_faces):
    points, faces = roof()
    points = np.concatenate([points, points[:5], [[np.nan, 0, 0]]])
    analysis = salcore.analyze(points, faces if with_faces else None)
    order = ranking(analysis)
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
    assert len(ranking(salcore.analyze(np.empty((0, 3)))).rank) == 0
    one = ranking(salcore.analyze([[1.0, 2.0, 3.0]]))
    assert (one.rank.tolist(), one.parent.tolist(), one.generations) == ([0], [-1], 0)
    twins = ranking(salcore.analyze([[1.0, 2.0, 3.0]] * 3))
    assert (twins.rank.tolist(), twins.parent.tolist()) == ([0, 1, 2], [-1, 0, 0])
