# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadric error metrics: weighted sums of squared distances to planes, ten numbers each.

Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997. A quadric
holds the upper triangle of the symmetric 4x4 matrix of a sum of planes n·x + d = 0, row by row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .blocks import rest_blocks
from .geometry import Floats, Indices, unit
from .planes import face_normals
from .progress import Rests
from .triangles import Edges

SEAM_WEIGHT = 0.1
"""Weight of the planes through seams, as a share of that of borders: on a textured scan with a
fifth of its points on seams, more shrinks what lies between, less lets faces reach across."""
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
    points: Floats,
    faces: NDArray[np.integer],
    edges: Edges,
    border_weight: float,
    workers: int = 0,
    seam: NDArray[np.bool_] | None = None,
) -> Rests[tuple[Floats, Floats]]:
    """Return the quadric (n, 10) of every vertex, and the area (n,) it integrates over, with rests.

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
    workers : int
        Threads; 0 takes one per processor.
    seam : (e,) bool, optional
        Further edges that get planes like borders.
    """
    count = len(points)
    normal, area = np.empty((len(faces), 3)), np.empty(len(faces))

    def measure(start: int, stop: int) -> None:
        double = face_normals(points, faces[start:stop])
        area[start:stop] = 0.5 * np.sqrt(np.einsum("mc,mc->m", double, double))
        normal[start:stop] = unit(double)

    yield from rest_blocks(measure, len(faces), workers=workers)
    area = np.maximum(area, LEAST_AREA * area.mean()) if len(area) else area
    planes = np.empty((10, len(faces)))

    def spread(start: int, stop: int) -> None:
        through = points[faces[start:stop, 0]]
        planes[:, start:stop] = plane_quadrics(normal[start:stop], through, area[start:stop]).T

    yield from rest_blocks(spread, len(faces), workers=workers)
    quadrics, areas = np.zeros((count, 10)), np.zeros(count)
    for corner in faces.T:
        areas += np.bincount(corner, area, count)
        yield
        yield from _add_planes(quadrics, corner, planes)
    if border_weight > 0.0:
        ends = yield from _ends_surface(normal, edges, workers)
        lines = [(ends, border_weight)]
        if seam is not None and seam.any():
            lines.append((seam & ~ends, SEAM_WEIGHT * border_weight))
        for line, weight in lines:
            side = np.sort(edges.sides[np.repeat(line, edges.uses)])
            yield
            yield from _add_borders(quadrics, points, faces, normal, side, weight, workers)
    return quadrics, areas


def _add_planes(quadrics: Floats, vertex: NDArray[np.integer], planes: Floats) -> Rests[None]:
    """Add planes (10, m), each to the quadric of its vertex (m,)."""
    for k in range(10):
        quadrics[:, k] += np.bincount(vertex, planes[k], len(quadrics))
        yield


def _add_borders(
    quadrics: Floats,
    points: Floats,
    faces: NDArray[np.integer],
    normal: Floats,
    side: Indices,
    weight: float,
    workers: int,
) -> Rests[None]:
    """Add planes through sides of faces, at right angles to these."""
    planes = np.empty((10, len(side)))
    vertices = np.empty((2, len(side)), dtype=np.intp)

    def stand(start: int, stop: int) -> None:
        corner, face = np.divmod(side[start:stop], len(faces))
        begin, end = faces[face, corner], faces[face, (corner + 1) % 3]
        across = np.cross(points[end] - points[begin], normal[face])
        square = np.einsum("mc,mc->m", across, across)
        planes[:, start:stop] = plane_quadrics(unit(across), points[begin], weight * square).T
        vertices[:, start:stop] = begin, end

    yield from rest_blocks(stand, len(side), workers=workers)
    if len(side):
        for vertex in vertices:
            yield from _add_planes(quadrics, vertex, planes)


def _ends_surface(normals: Floats, edges: Edges, workers: int) -> Rests[NDArray[np.bool_]]:
    """Return the edges of one face, of more than two, or of two that fold back."""
    ends = np.asarray(edges.uses != 2)
    first = np.cumsum(edges.uses) - edges.uses
    yield

    def fold(start: int, stop: int) -> None:
        pair = start + np.flatnonzero(~ends[start:stop])
        sides = edges.sides[first[pair]], edges.sides[first[pair] + 1]
        one, other = (normals[side % len(normals)] for side in sides)
        # Faces with the same winding run along their edge in opposite directions.
        sense = np.where(edges.forward[sides[0]] == edges.forward[sides[1]], -1.0, 1.0)
        ends[pair] = sense * np.einsum("ec,ec->e", one, other) < FOLD

    yield from rest_blocks(fold, len(ends), workers=workers)
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
