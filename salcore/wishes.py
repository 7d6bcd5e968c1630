# SPDX-License-Identifier: GPL-3.0-or-later
"""What a caller wants to keep: protected and important points, and seams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import GeometryError
from .geometry import Floats, Geometry


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
            _of_vertices(geometry, protect, "protect").astype(bool),
            _of_vertices(geometry, importance, "importance"),
            _edges(geometry, seams),
        )

    @property
    def key(self) -> tuple[bytes, ...]:
        """What tells these wishes from others."""
        return self.protect.tobytes(), self.importance.tobytes(), self.seams.tobytes()


def _of_vertices(geometry: Geometry, values: ArrayLike | None, name: str) -> Floats:
    """Return the largest of one value a point over each vertex; zero for None."""
    result = np.zeros(len(geometry.points))
    if values is None:
        return result
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (geometry.input_count,):
        raise GeometryError(
            f"{name} of shape {array.shape}: give one value for each of the "
            f"{geometry.input_count} points"
        )
    if not np.isfinite(array).all() or (array < 0).any():
        raise GeometryError(f"{name}: give finite values of at least 0")
    valid = geometry.vertex_of >= 0
    np.maximum.at(result, geometry.vertex_of[valid], array[valid])
    return result


def _edges(geometry: Geometry, seams: ArrayLike | None) -> NDArray[np.int32]:
    """Return edges (s, 2) between vertices; those of dropped or equal points are left out."""
    array = np.asarray([] if seams is None else seams)
    if array.size == 0:
        return np.empty((0, 2), dtype=np.int32)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":
        raise GeometryError(
            f"seams of shape {array.shape} and type {array.dtype}: give pairs of point numbers as "
            "an array of integers of shape (S, 2)"
        )
    if array.min() < 0 or array.max() >= geometry.input_count:
        raise GeometryError(f"seams: give numbers of points, from 0 to {geometry.input_count - 1}")
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
    O(F log F). Values differ that are further apart than 1e-6 of their range.
    """
    corners = np.asarray(faces, dtype=np.int64)
    chart = np.asarray(values, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1] != 3 or chart.shape[:2] != corners.shape:
        raise GeometryError(
            f"faces of shape {corners.shape} and values of shape {chart.shape}: give (F, 3) and "
            "(F, 3, d)"
        )
    if not corners.size:
        return np.empty((0, 2), dtype=np.int64)
    chart = chart.reshape(*corners.shape, -1)
    near = 1e-6 * np.ptp(chart.reshape(corners.size, -1), axis=0)
    start, end = corners.T, np.roll(corners.T, -1, axis=0)
    here, there = chart.transpose(1, 0, 2), np.roll(chart.transpose(1, 0, 2), -1, axis=0)
    swap = (start > end)[..., None]
    ends = np.concatenate([np.where(swap, there, here), np.where(swap, here, there)], axis=2)
    count = int(corners.max()) + 1
    key = (np.minimum(start, end) * count + np.maximum(start, end)).ravel()
    order = np.argsort(key, kind="stable")
    key, ends = key[order], ends.reshape(len(order), -1)[order]
    differ = (np.abs(ends[1:] - ends[:-1]) > np.tile(near, 2)).any(axis=1)
    seams = np.unique(key[1:][(key[1:] == key[:-1]) & differ])
    return np.column_stack(np.divmod(seams, count))
