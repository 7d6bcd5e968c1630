# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals and curvature on shapes where they are known."""

import numpy as np
import pytest
from shapes import grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.method.planes import tangent_basis, vertex_normals


def frames_of(points, faces=None, normals=None, **changes):
    analysis = salcore.analyze(points, faces, normals, salcore.Parameters(**changes))
    frames = analysis.frames
    return frames, frames.curvature * analysis.geometry.to_unit


def test_tangent_basis_is_orthonormal():
    normals = np.random.default_rng(0).normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals = np.concatenate([normals, np.eye(3), -np.eye(3)])
    first, second = tangent_basis(normals)
    basis = np.stack([first, second, normals], axis=1)
    assert np.matmul(basis, basis.transpose(0, 2, 1)) == pytest.approx(
        np.broadcast_to(np.eye(3), basis.shape), abs=1e-12
    )


def test_mesh_normals_of_a_sphere_are_exact():
    points, faces = hull_mesh(sphere_cloud(400))
    assert vertex_normals(points, faces) == pytest.approx(points, abs=1e-12)


@pytest.mark.parametrize("radius", [0.5, 4.0])
def test_curvature_of_a_sphere(radius):
    frames, curvature = frames_of(*hull_mesh(sphere_cloud(800, radius)))
    assert curvature == pytest.approx(np.full(800, -1 / radius), rel=1e-9)
    assert frames.oriented.all()


def test_curvature_of_a_cylinder():
    points, faces = grid(40, 60)
    angle = 2 * np.pi * points[:, 0] / 120
    tube = np.column_stack([np.cos(angle), np.sin(angle), points[:, 1] * 2 * np.pi / 120])
    _, curvature = frames_of(tube, faces)
    inner = ((points[:, :2] > 1) & (points[:, :2] < [58, 38])).all(axis=1)
    # Six neighbours: two along, two around, two on a diagonal weigh the directions unevenly.
    assert np.abs(curvature[inner]) == pytest.approx(np.full(inner.sum(), 0.5), rel=0.02)


def test_curvature_of_a_saddle_vanishes():
    points, faces = grid(21, 21)
    points = (points - [10, 10, 0]) / 10
    points[:, 2] = points[:, 0] ** 2 - points[:, 1] ** 2
    _, curvature = frames_of(points, faces)
    assert curvature[220] == pytest.approx(0.0, abs=0.02)  # the centre; principal ones are ±2


def test_curvature_of_a_torus_is_strongest_outside():
    points, faces = torus(80, 40)
    _, curvature = frames_of(points, faces)
    outer, inner = np.abs(curvature[0]), np.abs(curvature[20])
    # The rectangles' diagonals weigh the two directions unevenly.
    assert outer == pytest.approx((1 / 0.4 + 1 / 1.4) / 2, rel=0.1)
    assert inner == pytest.approx((1 / 0.4 - 1 / 0.6) / 2, rel=0.5)
    assert outer > 2 * inner


def test_normals_of_a_cloud_are_fitted_and_have_no_sense():
    points = sphere_cloud(2000)
    frames, _ = frames_of(points)
    assert np.abs(np.einsum("nc,nc->n", frames.normals, points)).min() > 0.999
    assert not frames.oriented.any()


def test_given_normals_win_and_are_scaled():
    points = sphere_cloud(500)
    frames, _ = frames_of(points, normals=7 * points)
    assert frames.normals == pytest.approx(points)
    assert frames.oriented.all()


def test_given_normals_with_scattered_signs_count_as_lines():
    points = sphere_cloud(500)
    sign = np.random.default_rng(0).choice([-1.0, 1.0], (500, 1))
    frames, _ = frames_of(points, normals=sign * points)
    assert not frames.oriented.any()
    plain = salcore.analyze(points, normals=points, parameters=salcore.Parameters())
    flipped = salcore.analyze(points, normals=sign * points)
    assert flipped.saliency == pytest.approx(plain.saliency, abs=1e-9)


def test_a_mesh_with_inconsistent_winding_counts_as_lines():
    points, faces = grid(12, 12)
    faces = faces.copy()
    faces[::2] = faces[::2, ::-1]
    analysis = salcore.analyze(points, faces)
    assert not analysis.saliency.any()
