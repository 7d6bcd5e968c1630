# SPDX-License-Identifier: GPL-3.0-or-later
"""Analytic shapes: what is salient on them is known."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def grid(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a flat grid of unit squares, cut into triangles."""
    x, y = np.meshgrid(np.arange(float(columns)), np.arange(float(rows)))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.column_stack([corner, corner + 1, corner + columns + 1])
    second = np.column_stack([corner, corner + columns + 1, corner + columns])
    return points, np.concatenate([first, second])


def sphere_cloud(count: int, radius: float = 1.0) -> np.ndarray:
    """Return points spread evenly on a sphere along a golden spiral."""
    i = np.arange(count) + 0.5
    polar, around = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    return radius * np.column_stack(
        [np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)]
    )


def hull_mesh(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the convex hull of points round the origin as an outward mesh."""
    from scipy.spatial import ConvexHull

    faces = ConvexHull(points).simplices
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("mc,mc->m", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def cube_cloud(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface of a cube with `steps` squares a side, and each point's edge distance."""
    g = np.arange(steps + 1)
    u, v = (a.ravel() for a in np.meshgrid(g, g))
    sides = [
        np.insert(np.column_stack([u, v]), axis, value, axis=1)
        for axis in range(3)
        for value in (0, steps)
    ]
    points = np.unique(np.concatenate(sides), axis=0)
    distance = np.sort(np.minimum(points, steps - points), axis=1)[:, 1]
    return points / steps, distance


def box(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit cube as a closed mesh of `steps` squares a side, facing outward."""
    flat, triangles = grid(steps + 1, steps + 1)
    flat /= steps
    corners, faces = [], []
    for axis in range(3):
        for value in (0.0, 1.0):
            side = np.roll(np.insert(flat[:, :2], 2, value, axis=1), axis + 1, axis=1)
            corners.append(side)
            outward = triangles if value else triangles[:, ::-1]
            faces.append(outward + len(flat) * (len(corners) - 1))
    points, place = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return points, place.reshape(-1)[np.concatenate(faces)]


def torus(around: int, across: int, radius: float = 1.0, tube: float = 0.4):
    """Return a closed torus mesh."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    ring = radius + tube * np.cos(b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), tube * np.sin(b)], axis=-1)
    number = (u * across + v).ravel()
    right = (((u + 1) % around) * across + v).ravel()
    up = (u * across + (v + 1) % across).ravel()
    both = (((u + 1) % around) * across + (v + 1) % across).ravel()
    faces = [np.column_stack([number, right, both]), np.column_stack([number, both, up])]
    return points.reshape(-1, 3), np.concatenate(faces)


def bumpy(count: int = 1500, seed: int = 0) -> np.ndarray:
    """Return a generic cloud: a random height field with a ridge, without ties."""
    rng = np.random.default_rng(seed)
    xy = rng.random((count, 2))
    z = 0.1 * np.sin(6 * xy[:, 0]) * np.cos(5 * xy[:, 1]) + 0.3 * np.abs(xy[:, 0] - 0.5)
    return np.column_stack([xy, z])


def turned(points: np.ndarray, seed: int = 1) -> np.ndarray:
    """Return the points rotated at random."""
    return Rotation.random(random_state=seed).apply(np.array(points))
