# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams: edges on whose two sides values of corners differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays.check import corner_values, indices
from ..arrays.edges import find_edges

NEAR = 1e-6
"""Share of the values' range within which two values count as one."""


def find_seams(faces: ArrayLike, values: ArrayLike) -> NDArray[np.int64]:
    """Return the edges on whose two sides values of corners differ, such as texture coordinates.

    Parameters
    ----------
    faces : (F, 3) array_like of integers
    values : (F, 3, d) array_like of float
        Of every corner. Give one value for all corners of a face for borders between materials.

    Returns
    -------
    (S, 2) int64
        Edges of exactly these faces whose ends have different values in two of them.

    Raises
    ------
    GeometryError
        If there is not one value for every corner.

    Notes
    -----
    O(F log F). Values differ that are further apart than 1e-6 of their range;
    those that are not finite count as zero.

    Examples
    --------
    Two triangles along an edge from point 1 to point 2, whose texture lies in two places:

    >>> import salcore
    >>> faces = [[0, 1, 2], [3, 2, 1]]
    >>> uv = [[[0, 0], [1, 0], [0, 1]], [[9, 9], [8, 9], [9, 8]]]
    >>> salcore.find_seams(faces, uv).tolist()
    [[1, 2]]
    """
    corners = indices(faces, "faces", "triangles", 3, np.iinfo(np.int32).max).astype(np.int64)
    chart = corner_values(values, "values", corners.shape)
    if not corners.size:
        return np.empty((0, 2), dtype=np.int64)
    flat = chart.reshape(corners.size, -1)
    near = NEAR * np.ptp(flat, axis=0)
    edges = find_edges(corners, int(corners.max()) + 1)
    corner, face = np.divmod(edges.sides, len(corners))
    start, end = 3 * face + corner, 3 * face + (corner + 1) % 3
    forward = edges.forward[edges.sides]
    low, high = np.where(forward, start, end), np.where(forward, end, start)
    edge = np.repeat(np.arange(len(edges.uses)), edges.uses)
    again = np.flatnonzero(edge[1:] == edge[:-1])
    differ = np.zeros(len(again), dtype=bool)
    for ends in (low, high):
        differ |= (np.abs(flat[ends[again]] - flat[ends[again + 1]]) > near).any(axis=1)
    seams = np.unique(edge[again[differ]])
    return np.column_stack([edges.low[seams], edges.high[seams]]).astype(np.int64)
