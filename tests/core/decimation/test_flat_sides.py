# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat sides, where collapses cost nothing: kept points lie evenly, and faces have good shapes."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapes import box, grid, turned

import salcore
from salcore.arrays.vectors import face_normals


def disc():
    """Return a disc with a round hole, on a lattice."""
    points, faces = grid(61, 61)
    away = np.linalg.norm(points[faces].mean(axis=1)[:, :2] - 30, axis=1)
    used, faces = np.unique(faces[(away < 30) & (away > 8)], return_inverse=True)
    return points[used], faces.reshape(-1, 3)


SHAPES = {"square": grid(51, 51), "disc": disc(), "box": box(25)}


@pytest.mark.parametrize("ratio", [0.5, 0.2])
@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
def test_kept_points_lie_evenly(shape, is_turned, ratio):
    points, faces = SHAPES[shape]
    points = turned(points) if is_turned else points
    area = np.linalg.norm(face_normals(points, faces), axis=1).sum() / 2
    result = salcore.simplify(points, faces, ratio=ratio)
    kept = points[result.indices]
    spacing = np.sqrt(area / len(kept))
    gap = cKDTree(kept).query(points)[0]
    assert gap.mean() < 0.5 * spacing  # 0.38 on a hexagonal lattice
    assert gap.max() < 1.6 * spacing
    corners = kept[result.faces]
    sides = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=(1, 2))
    quality = 2 * np.sqrt(3) * np.linalg.norm(face_normals(kept, result.faces), axis=1) / sides
    assert np.median(quality) > 0.6
    assert (quality < 0.1).mean() < 0.02


def test_a_plane_with_a_bump():
    """The bump takes most points; those round it still lie evenly."""
    points, faces = grid(81, 81)
    away = np.linalg.norm(points[:, :2] - 40, axis=1)
    points = points + np.outer(3 * np.exp(-((away / 4) ** 2)), [0, 0, 1])
    result = salcore.simplify(points, faces, ratio=0.1)
    kept, plane = points[result.indices], away > 20
    spacing = np.sqrt(plane.sum() / (away[result.indices] > 20).sum())
    gap = cKDTree(kept).query(points[plane])[0]
    assert gap.mean() < 0.5 * spacing
    assert gap.max() < 1.6 * spacing


def test_a_large_flat_side_takes_few_rounds():
    points, faces = box(60)
    analysis = salcore.analyze(turned(points), faces)
    analysis.simplify(ratio=0.1)
    large = [left for left, _, _ in analysis.rounds if left > 0.1 * len(points)]
    assert len(large) < 40
