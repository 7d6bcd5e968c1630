# SPDX-License-Identifier: GPL-3.0-or-later
"""Distance of a point to a triangle."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats
from ..arrays.vectors import dot


def triangle_distances(queries: Floats, corners: Floats) -> Floats:
    """Return the distance (m,) of each query (m, 3) to its triangle (m, 3 corners, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    square = dot(normal, normal)
    inside = square > 0.0
    nearest = np.full(len(queries), np.inf)
    for k in range(3):
        start, edge = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        offset = queries - start
        inside &= dot(np.cross(edge, offset), normal) >= 0.0
        length = dot(edge, edge)
        along = dot(offset, edge)
        share = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
        rest = offset - np.clip(share, 0.0, 1.0)[:, None] * edge
        nearest = np.minimum(nearest, dot(rest, rest))
    height = dot(queries - corners[:, 0], normal) ** 2
    plane = np.divide(height, square, out=np.zeros_like(height), where=inside)
    result: Floats = np.sqrt(np.where(inside, plane, nearest))
    return result
