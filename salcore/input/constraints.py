# SPDX-License-Identifier: GPL-3.0-or-later
"""What a caller wants to keep: protected and important points, and seams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import corner_values, indices, real_numbers
from .errors import GeometryError
from .geometry import Floats, Geometry

LARGEST = 1e100
"""Largest importance: its products with all other weights stay far from the largest double."""


@dataclass(frozen=True, eq=False)
class Wishes:
    """Wishes over the n vertices of a geometry.

    Attributes
    ----------
    protect : (n,) bool
    importance : (n,) float64
    seams : (s, 2) int32
        Ends of edges.
    """

    protect: NDArray[np.bool_]
    importance: Floats
    seams: NDArray[np.int32]

    @classmethod
    def check(
        cls,
        geometry: Geometry,
        protect: ArrayLike | None,
        importance: ArrayLike | None,
        seams: ArrayLike | None,
    ) -> Wishes:
        """Bring wishes about input points to the vertices.

        Raises
        ------
        GeometryError
            If an array cannot be understood.
        """
        return cls(
            _of_vertices(geometry, protect, "protect", 1.0).astype(bool),
            _of_vertices(geometry, importance, "importance", LARGEST),
            _edges(geometry, seams),
        )

    @property
    def key(self) -> tuple[bytes, ...]:
        """What tells these wishes from others."""
        return self.protect.tobytes(), self.importance.tobytes(), self.seams.tobytes()


def _of_vertices(geometry: Geometry, values: ArrayLike | None, name: str, largest: float) -> Floats:
    """Return the largest of one value a point over each vertex; zero for None."""
    result = np.zeros(len(geometry.points))
    if values is None:
        return result
    array = real_numbers(values, name, "one value a point")
    if array.shape != (geometry.input_count,):
        raise GeometryError(
            f"{name} of shape {array.shape}: give one value for each of the "
            f"{geometry.input_count} points"
        )
    bad = ~((array >= 0.0) & (array <= largest))
    if name == "protect":
        bad |= (array != 0.0) & (array != 1.0)
    if bad.any():
        first = int(np.argmax(bad))
        kind = "True or False" if name == "protect" else f"numbers from 0 to {largest:g}"
        raise GeometryError(f"{name}: {array[first]:g} is the value of point {first}; give {kind}")
    valid = geometry.vertex_of >= 0
    np.maximum.at(result, geometry.vertex_of[valid], array[valid])
    return result


def _edges(geometry: Geometry, seams: ArrayLike | None) -> NDArray[np.int32]:
    """Return edges (s, 2) between vertices; those of dropped or equal points are left out."""
    array = indices(seams, "seams", "pairs of points", 2, geometry.input_count)
    ends = geometry.vertex_of[array.astype(np.intp)]
    good = (ends >= 0).all(axis=1) & (ends[:, 0] != ends[:, 1])
    edges: NDArray[np.int32] = ends[good].astype(np.int32)
    return edges


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
    near = 1e-6 * np.ptp(flat, axis=0)
    # A side is numbered by the corner it starts at.
    start = np.arange(corners.size)
    end = start.reshape(-1, 3)[:, [1, 2, 0]].ravel()
    here, there = corners.ravel(), corners.ravel()[end]
    low, high = np.where(here < there, start, end), np.where(here < there, end, start)
    count = int(corners.max()) + 1
    key = np.minimum(here, there) * count + np.maximum(here, there)
    order = np.argsort(key)
    key = key[order]
    again = np.flatnonzero(key[1:] == key[:-1])
    one, other = order[again], order[again + 1]
    differ = np.zeros(len(again), dtype=bool)
    for corner in (low, high):
        differ |= (np.abs(flat[corner[one]] - flat[corner[other]]) > near).any(axis=1)
    seams = np.unique(key[again[differ]])
    return np.column_stack(np.divmod(seams, count))
