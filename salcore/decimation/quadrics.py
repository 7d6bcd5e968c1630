# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadric error metrics: weighted sums of squared distances to planes, ten numbers each.

Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997. A quadric
holds the upper triangle of the symmetric 4x4 matrix of a sum of planes n·x + d = 0, row by row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.edges import Edges
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import cross, dot, face_normals, unit

SEAM_WEIGHT = 0.1
"""Weight of the planes through seams, as a share of that of borders: on a textured scan with a
fifth of its points on seams, more shrinks what lies between, less lets faces reach across."""
LEAST_AREA = 0.3
"""Share of the mean area that every face weighs at least: details are made of small faces."""
FOLD_COSINE = -0.5
"""Cosine below which two faces fold back on each other: along their edge the surface ends, though
both planes go on, so the edge counts as a border."""


COEFFICIENTS = [(i, j) for i in range(4) for j in range(i, 4)]
"""Rows and columns of the matrix that a quadric's ten numbers stand for; 3 is the offset d."""


def plane_quadrics(normals: Floats, points: Floats, weights: Floats) -> Floats:
    """Return the quadrics (m, 10) of planes with unit normals (m, 3) through points (m, 3)."""
    planes = *normals.T, -dot(normals, points)
    coefficients = [planes[i] * planes[j] * weights for i, j in COEFFICIENTS]
    quadrics: Floats = np.stack(coefficients, axis=1)
    return quadrics


def point_quadrics(points: Floats, weights: Floats) -> Floats:
    """Return the quadrics (n, 10) of squared distances to points (n, 3)."""
    x, y, z = points.T
    one, zero = np.ones(len(points)), np.zeros(len(points))
    square = dot(points, points)
    rows = [one, zero, zero, -x, one, zero, -y, one, -z, square]
    return np.stack(rows, axis=1) * weights[:, None]


def monomials(points: Floats) -> Floats:
    """Return (n, 10) such that a quadric's value at a point is the product of the two rows."""
    x, y, z = points.T
    one = np.ones(len(points))
    rows = [x * x, 2 * x * y, 2 * x * z, 2 * x, y * y, 2 * y * z, 2 * y, z * z, 2 * z, one]
    return np.stack(rows, axis=1)


@dataclass(frozen=True, eq=False)
class _Triangles:
    """Faces (m, 3) over points (n, 3), their unit normals (m, 3) and their areas (m,)."""

    points: Floats
    faces: Integers
    normals: Floats
    areas: Floats


def vertex_quadrics(
    points: Floats,
    faces: Integers,
    edges: Edges,
    border_weight: float,
    seam: Mask | None = None,
    mean_face: float | None = None,
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
    seam : (e,) bool, optional
        Further edges that get planes like borders.
    mean_face : float, optional
        Mean area of a face, by which the smallest are weighed; that of these faces.
    """
    triangles = _measure(points, faces)
    quadrics, areas = _sum_face_planes(triangles, mean_face)
    if border_weight > 0.0:
        ends = _ends_surface(triangles.normals, edges)
        _add_border_planes(quadrics, triangles, _sides_of(edges, ends), border_weight)
        if seam is not None and seam.any():
            sides = _sides_of(edges, seam & ~ends)
            _add_border_planes(quadrics, triangles, sides, SEAM_WEIGHT * border_weight)
    return quadrics, areas


def _measure(points: Floats, faces: Integers) -> _Triangles:
    """Return the faces with their normals and areas."""
    normals, areas = np.empty((len(faces), 3)), np.empty(len(faces))

    def measure(start: int, stop: int) -> None:
        double = face_normals(points, faces[start:stop])
        areas[start:stop] = 0.5 * np.sqrt(dot(double, double))
        normals[start:stop] = unit(double)

    run_blocks(measure, len(faces))
    return _Triangles(points, faces, normals, areas)


def _sum_face_planes(triangles: _Triangles, mean: float | None) -> tuple[Floats, Floats]:
    """Return the sums (n, 10) of the planes of the faces round each vertex, and of areas (n,)."""
    points, faces, area = triangles.points, triangles.faces, triangles.areas
    if len(area):
        area = np.maximum(area, LEAST_AREA * (area.mean() if mean is None else mean))
    planes = np.empty((4, len(faces)))

    def fill(start: int, stop: int) -> None:
        normals = triangles.normals[start:stop]
        planes[:3, start:stop] = normals.T
        planes[3, start:stop] = -dot(normals, points.take(faces[start:stop, 0], axis=0))

    run_blocks(fill, len(faces))
    corners = np.ascontiguousarray(faces.T)
    quadrics, areas = np.empty((len(points), 10)), np.zeros(len(points))
    for corner in corners:
        areas += np.bincount(corner, area, len(points))
    # One coefficient at a time: all ten of all faces would take more memory than anything else.
    for k, (i, j) in enumerate(COEFFICIENTS):
        coefficient = planes[i] * planes[j] * area
        first, second, third = (np.bincount(corner, coefficient, len(points)) for corner in corners)
        quadrics[:, k] = first + second + third
    return quadrics, areas


def _add_planes(quadrics: Floats, vertex: Integers, planes: Floats) -> None:
    """Add planes (10, m), each to the quadric of its vertex (m,)."""
    for k in range(10):
        quadrics[:, k] += np.bincount(vertex, planes[k], len(quadrics))


def _sides_of(edges: Edges, chosen: Mask) -> Indices:
    """Return the sides of faces at the chosen edges (e,), ascending."""
    return np.sort(edges.sides[np.repeat(chosen, edges.uses)])


def _add_border_planes(
    quadrics: Floats, triangles: _Triangles, sides: Indices, weight: float
) -> None:
    """Add planes through sides of faces, at right angles to these."""
    points, faces = triangles.points, triangles.faces
    planes = np.empty((10, len(sides)))
    vertices = np.empty((2, len(sides)), dtype=np.intp)

    def stand(start: int, stop: int) -> None:
        corner, face = np.divmod(sides[start:stop], len(faces))
        begin, end = faces[face, corner], faces[face, (corner + 1) % 3]
        across = cross(points[end] - points[begin], triangles.normals[face])
        square = dot(across, across)
        planes[:, start:stop] = plane_quadrics(unit(across), points[begin], weight * square).T
        vertices[:, start:stop] = begin, end

    run_blocks(stand, len(sides))
    if len(sides):
        for vertex in vertices:
            _add_planes(quadrics, vertex, planes)


def _ends_surface(normals: Floats, edges: Edges) -> Mask:
    """Return the edges of one face, of more than two, or of two that fold back."""
    ends = np.asarray(edges.uses != 2)
    first = np.cumsum(edges.uses) - edges.uses

    def look_for_folds(start: int, stop: int) -> None:
        pair = start + np.flatnonzero(~ends[start:stop])
        sides = edges.sides[first[pair]], edges.sides[first[pair] + 1]
        one, other = (normals[side % len(normals)] for side in sides)
        # Faces with the same winding run along their edge in opposite directions.
        sense = np.where(edges.forward[sides[0]] == edges.forward[sides[1]], -1.0, 1.0)
        ends[pair] = sense * dot(one, other) < FOLD_COSINE

    run_blocks(look_for_folds, len(ends))
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
