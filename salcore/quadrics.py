# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadric error metrics: weighted sums of squared distances to planes, ten numbers each.

Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997. A quadric
holds the upper triangle of the symmetric 4x4 matrix of a sum of planes n·x + d = 0, row by row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .geometry import Floats, unit
from .planes import face_normals
from .triangles import Edges

LEAST_AREA = 0.3
"""Share of the mean area that every face weighs at least: details are made of small faces."""
FOLD = -0.5
"""Cosine below which two faces fold back on each other: along their edge the surface ends, though
both planes go on, so the edge counts as a border."""


def plane_quadrics(normals: Floats, points: Floats, weights: Floats) -> Floats:
    """Return the quadrics (m, 10) of planes with unit normals (m, 3) through points (m, 3)."""
    offset = -np.einsum("mc,mc->m", normals, points)
    x, y, z = normals.T
    rows = [x * x, x * y, x * z, x * offset, y * y, y * z, y * offset, z * z, z * offset]
    return np.stack([*rows, offset * offset], axis=1) * weights[:, None]


def point_quadrics(points: Floats, weights: Floats) -> Floats:
    """Return the quadrics (n, 10) of squared distances to points (n, 3)."""
    x, y, z = points.T
    one, zero = np.ones(len(points)), np.zeros(len(points))
    square = np.einsum("nc,nc->n", points, points)
    rows = [one, zero, zero, -x, one, zero, -y, one, -z, square]
    return np.stack(rows, axis=1) * weights[:, None]


def monomials(points: Floats) -> Floats:
    """Return (n, 10) such that a quadric's value at a point is the product of the two rows."""
    x, y, z = points.T
    one = np.ones(len(points))
    rows = [x * x, 2 * x * y, 2 * x * z, 2 * x, y * y, 2 * y * z, 2 * y, z * z, 2 * z, one]
    return np.stack(rows, axis=1)


def vertex_quadrics(
    points: Floats, faces: NDArray[np.integer], edges: Edges, border_weight: float
) -> tuple[Floats, Floats]:
    """Return the quadric (n, 10) of every vertex, and the area (n,) it integrates over.

    Each face adds its plane, weighted by its area, to its three corners. Each edge of one face, of
    more than two, or of two that fold back adds planes through itself, at right angles to its
    faces, so that borders and rims stay.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 3) int
    edges : Edges
        Of these faces.
    border_weight : float
        Weight of border planes, relative to faces as large as the square on the edge.
    """
    count = len(points)
    normal = face_normals(points, faces)
    area = 0.5 * np.sqrt(np.einsum("mc,mc->m", normal, normal))
    area = np.maximum(area, LEAST_AREA * area.mean()) if len(area) else area
    normal = unit(normal)
    planes = plane_quadrics(normal, points[faces[:, 0]], area)
    quadrics, areas = np.zeros((count, 10)), np.zeros(count)
    for corner in faces.T:
        areas += np.bincount(corner, area, count)
        for k in range(10):
            quadrics[:, k] += np.bincount(corner, planes[:, k], count)
    side = np.flatnonzero(_ends_surface(normal, edges)[edges.of_side])
    if border_weight > 0.0 and len(side):
        face, corner = side % len(faces), side // len(faces)
        start, end = faces[face, corner], faces[face, (corner + 1) % 3]
        across = np.cross(points[end] - points[start], normal[face])
        square = np.einsum("mc,mc->m", across, across)
        planes = plane_quadrics(unit(across), points[start], border_weight * square)
        for vertex in (start, end):
            for k in range(10):
                quadrics[:, k] += np.bincount(vertex, planes[:, k], count)
    return quadrics, areas


def _ends_surface(normals: Floats, edges: Edges) -> NDArray[np.bool_]:
    """Return the edges of one face, of more than two, or of two that fold back."""
    ends = np.asarray(edges.uses != 2)
    order = np.argsort(edges.of_side, kind="stable")
    first = np.cumsum(edges.uses) - edges.uses
    pair = np.flatnonzero(edges.uses == 2)
    sides = order[first[pair]], order[first[pair] + 1]
    one, other = (normals[side % len(normals)] for side in sides)
    # Faces with the same winding run along their edge in opposite directions.
    sense = np.where(edges.forward[sides[0]] == edges.forward[sides[1]], -1.0, 1.0)
    ends[pair] = sense * np.einsum("ec,ec->e", one, other) < FOLD
    return ends


def minimizers(quadrics: Floats, points: Floats, ridge: float = 1e-3) -> Floats:
    """Return the points (n, 3) of least quadric error, near `points` where that is not unique.

    Parameters
    ----------
    quadrics : (n, 10) float64
    points : (n, 3) float64
        Where to stay, as far as the planes do not say.
    ridge : float
        Weight of staying, as a share of the trace.
    """
    a = quadrics
    matrix = np.empty((len(a), 3, 3))
    for row, column, k in [(0, 0, 0), (0, 1, 1), (0, 2, 2), (1, 1, 4), (1, 2, 5), (2, 2, 7)]:
        matrix[:, row, column] = matrix[:, column, row] = a[:, k]
    gradient = np.matmul(matrix, points[:, :, None])[:, :, 0] + a[:, [3, 6, 8]]
    trace = a[:, 0] + a[:, 4] + a[:, 7]
    fixed = trace <= 0.0
    matrix += (ridge * trace + fixed)[:, None, None] * np.eye(3)
    step = np.linalg.solve(matrix, gradient[:, :, None])[:, :, 0]
    return points - np.where(fixed[:, None], 0.0, step)
