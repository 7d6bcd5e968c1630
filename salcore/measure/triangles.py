# SPDX-License-Identifier: GPL-3.0-or-later
"""Distance of a point to a triangle."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats
from ..arrays.vectors import cross, dot


def square_edges(corners: Floats) -> Floats:
    """Return the squared lengths (m, 3) of the edges of triangles, each from its own corner."""
    edges = np.roll(corners, -1, axis=1) - corners
    squares: Floats = np.einsum("mkd,mkd->mk", edges, edges)
    return squares


def triangle_distances(queries: Floats, corners: Floats) -> Floats:
    """Return the distance (m,) of each query (m, 3) to its triangle (m, 3 corners, 3)."""
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.einsum("mkd,mkd->mk", edges, edges)
    normal = _normals(edges, lengths)
    square = dot(normal, normal)
    inside = square > 0.0
    nearest = np.full(len(queries), np.inf)
    for k in range(3):
        edge, length, offset = edges[:, k], lengths[:, k], queries - corners[:, k]
        inside &= dot(cross(edge, offset), normal) >= 0.0
        along = dot(offset, edge)
        share = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
        rest: Floats = offset - np.clip(share, 0.0, 1.0)[:, None] * edge
        nearest = np.minimum(nearest, dot(rest, rest))
    height = dot(queries - corners[:, 0], normal) ** 2
    plane = np.divide(height, square, out=np.zeros_like(height), where=inside)
    result: Floats = np.sqrt(np.where(inside, plane, nearest))
    return result


def _normals(edges: Floats, lengths: Floats) -> Floats:
    """Return normals (m, 3), across the longest edge even where a sliver leaves them few digits.

    What is left of the error turns the normal round the longest edge, where a sliver is narrow.
    """
    normals = cross(edges[:, 0], edges[:, 1])
    row, longest = np.arange(len(edges)), lengths.argmax(axis=1)
    edge, length = edges[row, longest], lengths[row, longest]
    along = dot(normals, edge)
    share = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    across: Floats = normals - share[:, None] * edge
    return across
