# SPDX-License-Identifier: GPL-3.0-or-later
"""Find what each pixel of a picture sees of a mesh, with a depth buffer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BLOCK = 1 << 20
"""Pixels of faces' bounding boxes that are tried at once: some hundred megabytes."""
SLACK = 1e-9
"""Weights below zero that still count as inside, so that no gap opens between two faces."""


def visible(
    points: Floats, faces: NDArray[Any], shape: tuple[int, int]
) -> tuple[NDArray[np.int64], Floats]:
    """Return the face that each pixel sees, and how near its three corners are.

    Parameters
    ----------
    points : (n, 3) float64
        Column, row and nearness; pixel (i, j) has its centre at column j + 0.5, row i + 0.5.
    faces : (m, 3) int
    shape : (int, int)
        Rows and columns.

    Returns
    -------
    seen : (rows, columns) int64
        Positions in `faces`, -1 where no face is.
    weights : (rows, columns, 3) float64
        Barycentric coordinates, summing to one; 0 where no face is.

    Notes
    -----
    Time grows with the pixels of the faces' bounding boxes; memory with the picture.
    """
    rows, columns = shape
    seen = np.full(rows * columns, -1, dtype=np.int64)
    nearest = np.full(rows * columns, -np.inf)
    weights = np.zeros((rows * columns, 3))
    low, size = _boxes(points, faces, shape)
    count = size.prod(axis=1)
    kept = np.flatnonzero(count)
    ends = np.cumsum(count[kept])
    pieces = np.searchsorted(ends, np.arange(BLOCK, ends[-1] if len(ends) else 0, BLOCK))
    for block in np.split(kept, np.unique(pieces)):
        face, pixel, weight, near = _hits(points, faces, low, size, block, columns)
        np.maximum.at(nearest, pixel, near)
        front = near >= nearest[pixel]
        seen[pixel[front]], weights[pixel[front]] = face[front], weight[front]
    return seen.reshape(shape), weights.reshape(rows, columns, 3)


def _boxes(
    points: Floats, faces: NDArray[Any], shape: tuple[int, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first pixel (m, 2) and the size (m, 2), column first, of each face's box."""
    corners = points[:, :2][faces]
    limit = np.array(shape[::-1])
    low = np.clip(np.ceil(corners.min(axis=1) - 0.5), 0, limit).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1) - 0.5) + 1, 0, limit).astype(np.int64)
    return low, np.maximum(high - low, 0)


def _hits(
    points: Floats,
    faces: NDArray[Any],
    low: NDArray[np.int64],
    size: NDArray[np.int64],
    block: NDArray[np.int64],
    columns: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Return face, pixel, weights and nearness of all pixels inside some faces."""
    count = size[block].prod(axis=1)
    face = np.repeat(block, count)
    place = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    down, across = np.divmod(place, size[face, 0])
    column, row = low[face, 0] + across, low[face, 1] + down
    first, second, third = np.moveaxis(points[faces[block]], 1, 0)
    one, other = (second - first)[:, :2], (third - first)[:, :2]
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    scale = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0.0)
    # Each weight is linear in column and row: three numbers a face, then one sum a pixel.
    slopes = [
        np.column_stack([other[:, 1], -other[:, 0]]) * scale[:, None],
        np.column_stack([-one[:, 1], one[:, 0]]) * scale[:, None],
    ]
    position = np.repeat(np.arange(len(block)), count)
    x, y = column + 0.5 - first[position, 0], row + 0.5 - first[position, 1]
    v, w = (slope[position, 0] * x + slope[position, 1] * y for slope in slopes)
    u = 1.0 - v - w
    inside = (np.minimum(np.minimum(u, v), w) >= -SLACK) & (scale != 0.0)[position]
    weight = np.column_stack([u, v, w])[inside]
    depth = np.column_stack([first[:, 2], second[:, 2], third[:, 2]])[position[inside]]
    near = np.einsum("ij,ij->i", weight, depth)
    return face[inside], (row * columns + column)[inside], weight, near
