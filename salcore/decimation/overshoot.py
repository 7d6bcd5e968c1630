# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted vertices that have left the original where hardly any sample holds them come back."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats, Indices
from ..arrays.vectors import dot
from .attribute_transfer import place_sources

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
        Those that have moved, of faces.
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
    places = positions[vertices]
    face, weights = place_sources(points, faces, vertices, places)
    feet = np.einsum("uk,ukd->ud", weights, points[faces[face]])
    away = places - feet
    square, limit = dot(away, away), REACH**2 * farthest[vertices]
    over = square > limit
    result = positions.copy()
    back = np.sqrt(limit[over] / square[over])[:, None]
    result[vertices[over]] = feet[over] + back * away[over]
    return result
