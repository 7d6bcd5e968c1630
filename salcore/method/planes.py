# SPDX-License-Identifier: GPL-3.0-or-later
"""Plane fits and tangent frames (paper §2.2, equations 2.1 and 2.2)."""

from __future__ import annotations

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.rows import row_sum
from ..arrays.types import Floats, Indices, Integers
from ..arrays.vectors import face_normals, unit

FLAT = 1e-12
"""Share of the largest eigenvalue below which the second counts as zero: points in a line."""


def mean_offset(offsets: Floats, indptr: Integers) -> Floats:
    """Return the means (b, 3) of the neighbours of a block of vertices, (2.1).

    Parameters
    ----------
    offsets : (e, 3) float64
        Neighbours, relative to their vertex.
    indptr : (b + 1,) int
        Bounds of each vertex's neighbours.
    """
    mean: Floats = row_sum(offsets, indptr) / np.maximum(np.diff(indptr), 1)[:, None]
    return mean


def covariance(offsets: Floats, row: Indices, indptr: Integers) -> Floats:
    """Return the covariance matrices C (b, 3, 3) of the neighbours about their mean, (2.2).

    Parameters
    ----------
    offsets : (e, 3) float64
    row : (e,) int
        Vertex of each offset, counted from the block's first.
    indptr : (b + 1,) int
    """
    x, y, z = (offsets - mean_offset(offsets, indptr)[row]).T
    result = np.empty((len(indptr) - 1, 3, 3))
    for (a, b), product in zip(
        [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)],
        [x * x, x * y, x * z, y * y, y * z, z * z],
        strict=True,
    ):
        result[:, a, b] = result[:, b, a] = row_sum(product, indptr)
    return result


def fit_normals(covariance: Floats) -> Floats:
    """Return the normals of the planes of least squares distance.

    Parameters
    ----------
    covariance : (b, 3, 3) float64
        Covariance matrices C of (2.2).

    Returns
    -------
    (b, 3) float64
        Eigenvectors of the least eigenvalues, of arbitrary sign; zero where the points span no
        plane (fewer than three of them, or all in a line).
    """
    values, vectors = np.linalg.eigh(covariance)
    return np.where(values[:, 1:2] > FLAT * values[:, 2:3], vectors[:, :, 0], 0.0)


def tangent_basis(normals: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors that complete each unit normal to an orthonormal basis.

    Parameters
    ----------
    normals : (b, 3) float64
        Unit normals; a zero normal is taken for the z axis.

    Returns
    -------
    (b, 3) float64, (b, 3) float64

    References
    ----------
    Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017.
    """
    x, y, z = normals.T
    z = np.where(normals.any(axis=1), z, 1.0)
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    return first, second


def vertex_normals(points: Floats, faces: Integers) -> Floats:
    """Return (n, 3) unit normals of a mesh's vertices, zero where no face has an area.

    Each face weighs by the sine of its corner over the product of its two edge lengths there,
    which is exact for points on a sphere (Max, Weights for computing vertex normals from facet
    normals, Journal of Graphics Tools 4(2), 1999).
    """
    weighted = np.empty((3, 3, len(faces)))  # corner, axis, face

    def weigh(start: int, stop: int) -> None:
        block = faces[start:stop]
        normal, corners = face_normals(points, block), points[block]
        square = ((corners - np.roll(corners, -1, axis=1)) ** 2).sum(axis=2)
        product = square * np.roll(square, 1, axis=1)
        weight = np.divide(1.0, product, out=np.zeros_like(product), where=product > 0.0)
        weighted[:, :, start:stop] = weight.T[:, None] * normal.T

    run_blocks(weigh, len(faces))
    total = np.zeros((len(points), 3))
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(faces[:, corner], weighted[corner, axis], len(points))
    return unit(total)
