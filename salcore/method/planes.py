# SPDX-License-Identifier: GPL-3.0-or-later
"""Plane fits and tangent frames (paper §2.2, equations 2.1 and 2.2)."""

from __future__ import annotations

import numpy as np

from .blocks import rest_blocks
from .geometry import Floats, unit
from .progress import Rests, finish

FLAT = 1e-12
"""Share of the largest eigenvalue below which the second counts as zero: points in a line."""


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


def face_normals(points: Floats, faces: np.ndarray) -> Floats:
    """Return (m, 3) float64 normals of length twice the area of each face."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def vertex_normals(points: Floats, faces: np.ndarray) -> Floats:
    """Return (n, 3) unit normals of a mesh's vertices, zero where no face has an area.

    Each face weighs by the sine of its corner over the product of its two edge lengths there,
    which is exact for points on a sphere (Max, Weights for computing vertex normals from facet
    normals, Journal of Graphics Tools 4(2), 1999).
    """
    return finish(vertex_normals_steps(points, faces))


def vertex_normals_steps(points: Floats, faces: np.ndarray, workers: int = 0) -> Rests[Floats]:
    """Rest between the parts of the work, and return what `vertex_normals` returns."""
    count = len(points)
    share = np.empty((3, 3, len(faces)))  # corner, axis, face

    def weigh(start: int, stop: int) -> None:
        block = faces[start:stop]
        normal, corners = face_normals(points, block), points[block]
        square = ((corners - np.roll(corners, -1, axis=1)) ** 2).sum(axis=2)
        weight = square * np.roll(square, 1, axis=1)
        weight = np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 0.0)
        share[:, :, start:stop] = weight.T[:, None] * normal.T

    yield from rest_blocks(weigh, len(faces), workers=workers)
    total = np.zeros((count, 3))
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(faces[:, corner], share[corner, axis], count)
            yield
    return unit(total)
