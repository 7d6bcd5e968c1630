# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances against slow exact ones."""

import numpy as np
import pytest
from models import load_model
from shapes import grid, sphere_cloud, torus

import salcore
from salcore.measure.distances import distances, triangle_distances


def test_triangle_distances_by_hand():
    corners = np.array([[[0, 0, 0], [4, 0, 0], [0, 3, 0.0]]] * 6)
    queries = np.array(
        [[1, 1, 5], [-3, -4, 0], [2, -2, 0], [7, 4, 0], [0, 3, 1], [1, 0.5, 0.0]], dtype=float
    )
    assert triangle_distances(queries, corners) == pytest.approx([5, 5, 2, 5, 1, 0])


def test_a_triangle_of_no_area_is_its_longest_side():
    corners = np.array([[[0, 0, 0], [1, 0, 0], [4, 0, 0.0]], [[1, 1, 1]] * 3], dtype=float)
    queries = np.array([[2, 3, 0], [1, 1, 3.0]])
    assert triangle_distances(queries, corners) == pytest.approx([3, 2])


def test_distances_to_a_mesh_of_faces_of_all_sizes():
    rng = np.random.default_rng(0)
    size = 10.0 ** rng.uniform(-3, 0, 60)
    corners = rng.random((60, 1, 3)) + size[:, None, None] * rng.normal(size=(60, 3, 3))
    points, faces = corners.reshape(-1, 3), np.arange(180).reshape(-1, 3)
    queries = rng.random((500, 3)) * 2
    expected = np.min(
        [triangle_distances(queries, np.broadcast_to(c, (500, 3, 3))) for c in corners], axis=0
    )
    surface = salcore.Surface(points, faces)
    assert distances(queries, surface)[1] == pytest.approx(expected)


def test_points_that_no_face_uses_are_surface_too():
    points, faces = grid(3, 3)
    surface = salcore.make_surface(np.concatenate([points, [[9.0, 0, 0]]]), faces)
    assert distances(np.array([[9.0, 0, 1]]), surface)[1] == pytest.approx([1.0])


def test_errors_both_ways():
    cloud = np.array([[0, 0, 0], [1, 0, 0], [5, 0, 0.0]])
    errors = salcore.compare(salcore.make_surface(cloud), salcore.make_surface(cloud[:2]))
    assert (errors.point.max, errors.point.mean) == pytest.approx((4.0, 4 / 3))
    assert errors.point_back.max == 0
    back = salcore.compare(salcore.make_surface(cloud[:2]), salcore.make_surface(cloud))
    assert (back.point.max, back.point_back.max) == pytest.approx((0, 4))
    assert errors.diagonal == 5


def test_tangent_planes_stand_for_the_surface_of_a_cloud():
    fine, coarse = sphere_cloud(4000), sphere_cloud(500)
    errors = salcore.compare(salcore.make_surface(fine), salcore.make_surface(coarse))
    assert errors.surface.max < 0.01 < 0.05 < errors.point.max


def test_a_refined_mesh_lies_on_its_surface():
    points, faces = torus(30, 20)
    middle = points[faces].mean(axis=1)
    to_point, to_surface = distances(middle, salcore.make_surface(points, faces))
    assert to_surface.max() < 1e-12
    assert to_point.min() > 0.01


def test_point_errors_agree_with_meshlab():
    import pymeshlab

    points, faces = load_model("bun_zipper.ply")
    kept = salcore.simplify(points, faces, alpha=30).indices
    errors = salcore.compare(salcore.make_surface(points), salcore.make_surface(points[kept]))
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points))
    meshes.add_mesh(pymeshlab.Mesh(points[kept]))
    theirs = meshes.get_hausdorff_distance(
        sampledmesh=0,
        targetmesh=1,
        samplenum=10 * len(points),
        maxdist=pymeshlab.PercentageValue(50),
    )
    assert theirs["n_samples"] == len(points)
    assert errors.point.max == pytest.approx(theirs["max"], rel=1e-5)
    assert errors.point.mean == pytest.approx(theirs["mean"], rel=1e-5)
