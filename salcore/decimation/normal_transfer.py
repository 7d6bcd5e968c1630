# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals of the original surface for the corners of a light one, which then is shaded like it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..arrays.blocks import worker_count
from ..arrays.rows import row_entries, row_sum
from ..arrays.types import Floats, Indices
from ..arrays.vectors import dot, face_normals, unit

CREASE_COSINE = 0.5
"""Cosine of the angle from a light face's normal up to which an original face is of its side: 60
degrees, so that the two sides of a crease keep normals of their own."""


def transfer_normals(
    points: Floats, original: Indices, faces: Indices, positions: Floats | None = None
) -> Floats:
    """Return the normals (K, 3, 3) of the original surface at the corners of light faces.

    Each is the mean, weighted by area, of the normals of the original faces round the corner's
    vertex that look the way of the light face; the light face's own one if none does.

    Parameters
    ----------
    points : (n, 3) float64
    original : (m, 3) intp
        Faces of the original.
    faces : (K, 3) intp
        Light faces, over the same vertices.
    positions : (n, 3) float64, optional
        Where vertices have moved to: the original vertex nearest to there takes their places.

    Notes
    -----
    O(m log m + K log n) time.
    """
    double = face_normals(points, original)
    directions = unit(double)
    own = unit(face_normals(points if positions is None else positions, faces))
    order = np.argsort(original.ravel(), kind="stable")
    round_vertex = order // 3
    bounds = np.concatenate([[0], np.cumsum(np.bincount(original.ravel(), minlength=len(points)))])
    result = np.empty((len(faces), 3, 3))
    stand_in = np.arange(len(points))
    if positions is not None:
        used = np.unique(faces)
        stand_in[used] = cKDTree(points).query(positions[used], workers=worker_count())[1]
    for k in range(3):
        entry, rows = row_entries(bounds, stand_in[faces[:, k]])
        face = round_vertex[entry]
        owner = np.repeat(np.arange(len(faces)), np.diff(rows))
        beside = np.where(dot(directions[face], own[owner]) >= CREASE_COSINE, 1.0, 0.0)
        total = unit(row_sum(double[face] * beside[:, None], rows))
        result[:, k] = np.where(total.any(axis=1, keepdims=True), total, own)
    return result
