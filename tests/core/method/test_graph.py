# SPDX-License-Identifier: GPL-3.0-or-later
"""The neighbourhood graph against slow references."""

import numpy as np
import pytest
from models import load_model
from scipy.spatial import Delaunay
from shapes import grid, sphere_cloud

import salcore
from salcore.decimation.surface import star_triangles
from salcore.input.geometry import clean
from salcore.method.graph import build_graph


def graph_of(points, faces=None, **changes):
    parameters = salcore.Parameters(**changes)
    return build_graph(clean(points, faces), parameters)


def neighbours(graph, vertex):
    return set(graph.indices[graph.indptr[vertex] : graph.indptr[vertex + 1]].tolist())


def test_graph_is_symmetric_and_has_no_loops():
    for graph in (graph_of(np.random.default_rng(0).random((400, 3))), graph_of(*grid(5, 7))):
        matrix = graph.matrix().toarray()
        assert (matrix == matrix.T).all()
        assert not matrix.diagonal().any()
        assert matrix.max() == 1


def test_mesh_ring():
    graph = graph_of(*grid(3, 3))
    assert neighbours(graph, 4) == {0, 1, 3, 5, 7, 8}
    assert neighbours(graph, 0) == {1, 3, 4}


def test_level_two_joins_rings():
    graph, wide = graph_of(*grid(6, 6)), graph_of(*grid(6, 6), level=2)
    for vertex in range(36):
        expected = neighbours(graph, vertex)
        expected |= {k for j in expected for k in neighbours(graph, j)}
        assert neighbours(wide, vertex) == expected - {vertex}


def test_stars_of_a_plane_are_its_delaunay_triangulation():
    points = np.random.default_rng(3).random((600, 2))
    graph = graph_of(np.column_stack([points, np.zeros(600)]), neighbors=48)
    triangulation = Delaunay(points)
    start, other = triangulation.vertex_neighbor_vertices
    inner = np.flatnonzero(((points > 0.15) & (points < 0.85)).all(axis=1))
    for vertex in inner:
        assert neighbours(graph, vertex) == set(other[start[vertex] : start[vertex + 1]].tolist())


def test_stars_of_a_square_lattice_agree_on_one_diagonal_a_square():
    points, _ = grid(9, 9)
    graph = graph_of(points)
    assert {31, 39, 41, 49} <= neighbours(graph, 40) <= {30, 31, 32, 39, 41, 48, 49, 50}
    for x in range(8):
        for y in range(8):
            a, b, c, d = (9 * y + x + step for step in (0, 1, 10, 9))
            assert (c in neighbours(graph, a)) != (d in neighbours(graph, b))
    corners = points[star_triangles(graph.stars)]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert area == pytest.approx(np.full(128, 0.5))


def test_stars_are_ordered_by_angle():
    graph = graph_of(sphere_cloud(500))
    points = sphere_cloud(500)
    for vertex in (100, 250):
        star = graph.stars[vertex]
        star = star[star >= 0]
        rays = points[star] - points[vertex]
        cross = np.cross(rays, np.roll(rays, -1, axis=0)) @ points[vertex]
        assert (cross > 0).all() or (cross < 0).all()


def test_stars_find_the_edges_of_a_scan():
    points, faces = load_model("bun_zipper.ply")
    used = np.zeros(len(points), bool)
    used[faces] = True
    mesh, geometry = graph_of(points, faces), clean(points)
    cloud = build_graph(geometry, salcore.Parameters())
    row = mesh.rows()
    at = np.flatnonzero(used[row])
    key = row.astype(np.int64) * len(points)
    ends = geometry.input_of[cloud.rows()], geometry.input_of[cloud.indices]
    found = np.isin(key[at] + mesh.indices[at], ends[0] * len(points) + ends[1])
    assert found.mean() > 0.95


def test_delaunay_graph():
    points = np.random.default_rng(5).random((200, 3))
    graph = graph_of(points, graph="delaunay")
    simplices = Delaunay(points).simplices
    expected = {(int(a), int(b)) for s in simplices for a in s for b in s if a != b}
    assert set(zip(graph.rows().tolist(), graph.indices.tolist(), strict=True)) == expected


def test_delaunay_graph_of_a_plane_falls_back_to_stars():
    points = np.column_stack([np.random.default_rng(1).random((100, 2)), np.zeros(100)])
    flat = graph_of(points, graph="delaunay")
    assert (flat.indices == graph_of(points).indices).all()


def test_loose_points_of_a_mesh_have_neighbours_among_themselves():
    points, faces = grid(4, 4)
    loose = np.random.default_rng(0).random((30, 3)) + 10
    graph = graph_of(np.concatenate([points, loose]), faces)
    assert (graph.degrees > 0).all()
    assert max(neighbours(graph, 5)) < 16
    assert min(neighbours(graph, 20)) >= 16


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_points_are_all_joined(count):
    graph = graph_of(np.random.default_rng(2).random((count, 3)))
    assert graph.degrees.tolist() == [count - 1] * count
