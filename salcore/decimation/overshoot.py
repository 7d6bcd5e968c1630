# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted vertices that have left the original where hardly any sample holds them come back."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats, Indices
from .nearest_faces import Assignment, Triangles
from .samples import Samples

REACH = 1.5
"""Distance of a vertex from the original, of the largest from samples to the faces round it: 99 %
of fitted vertices are nearer."""


def pull_back(
    positions: Floats, vertices: Indices, farthest: Floats, points: Floats, faces: Indices
) -> Floats:
    """Return positions (n, 3) none of which is much farther from the original than it from them.

    A fit sees distances from samples to faces only, so a vertex of small faces, between samples,
    may go anywhere.

    Parameters
    ----------
    positions : (n, 3) float64
    vertices : (u,) intp
        Those that have moved.
    farthest : (n,) float64
        Largest squared distance from samples to the faces round each.
    points : (n, 3) float64
        Of the original: where the vertices come from.
    faces : (m, 3) intp
        Of the original.

    Notes
    -----
    O(m + u): the nearest place is sought from where each comes from, over the faces between.
    """
    count = len(vertices)
    queries = np.ascontiguousarray(positions[vertices].T)
    moved = Samples(queries, np.zeros((3, count)), np.ones(count), vertices, count)
    at = Assignment.of(moved, points, faces)
    limit = REACH**2 * farthest[vertices]
    over = np.flatnonzero(at.square > limit)
    nearest = faces[at.face[over]]
    share, _ = Triangles.of(points, nearest).project(queries[:, over], np.arange(len(over)))
    foot = np.einsum("ks,skd->sd", share, points[nearest])
    result = positions.copy()
    back = np.sqrt(limit[over] / at.square[over])[:, None]
    result[vertices[over]] = foot + back * (queries[:, over].T - foot)
    return result
