# SPDX-License-Identifier: GPL-3.0-or-later
"""The triangles that are simplified."""

import numpy as np
import pytest
from models import load_model
from shapes import grid

import salcore
from salcore.arrays.edges import find_edges
from salcore.decimation.surface import elimination_surface, star_triangles
from salcore.input.geometry import clean
from salcore.method.graph import build_graph


def test_the_stars_of_a_scan_make_a_surface():
    points, _ = load_model("bun_zipper.ply")
    graph = build_graph(clean(points), salcore.Parameters())
    triangles = star_triangles(graph.stars)
    assert len(np.unique(triangles, axis=0)) == len(triangles)
    assert len(triangles) / len(points) == pytest.approx(2.0, abs=0.02)
    uses = find_edges(triangles, len(points)).uses
    assert (uses == 2).mean() > 0.97


# A square 0 1 2 3 round vertex 4, by angle; vertex 5 sees 3 and 4, whom nobody asked.
STARS = np.array(
    [[1, 4, 3, -1], [2, 4, 0, -1], [3, 4, 1, -1], [0, 4, 2, -1], [0, 1, 2, 3], [3, 4, -1, -1]],
    dtype=np.int32,
)


def test_triangles_are_those_that_two_stars_have():
    assert star_triangles(STARS).tolist() == [[0, 1, 4], [0, 3, 4], [1, 2, 4], [2, 3, 4]]


def test_triangles_by_priority():
    priority = np.array([5, 4, 3, 2, 1, 0])
    found = star_triangles(STARS, priority)
    assert found.tolist() == [[4, 3, 2], [4, 3, 0], [4, 2, 1], [4, 1, 0]]


def surface_of(points, faces=None):
    geometry, parameters = clean(points, faces), salcore.Parameters()
    return elimination_surface(geometry, build_graph(geometry, parameters), parameters)


def test_faces_stay_as_they_are():
    points, faces = grid(4, 5)
    found, links = surface_of(points, faces)
    np.testing.assert_array_equal(found, faces)
    assert [len(ends) for ends in links] == [0, 0]
    assert found.dtype == np.int32


def test_points_beside_faces_get_triangles_and_the_rest_links():
    points, faces = grid(4, 5)
    others = grid(6, 6)[0] + [30, 0, 0]
    found, (low, high) = surface_of(np.concatenate([points, others]), faces)
    np.testing.assert_array_equal(found[: len(faces)], faces)
    assert (found[len(faces) :] >= len(points)).all()
    assert (low < high).all()
    used = np.zeros(len(points) + len(others), dtype=bool)
    used[found], used[low], used[high] = True, True, True
    assert used.all()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_points(count):
    found, (low, high) = surface_of(np.eye(3)[:count])
    assert len(found) == 0
    assert list(zip(low.tolist(), high.tolist(), strict=True)) == [(0, 1)][: count // 2]
