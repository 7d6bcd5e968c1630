# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers: values of corners, such as a map of texture coordinates, normals, colours, materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.check import corner_values as checked_values
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import dot
from ..errors import GeometryError
from .geometry import Geometry

NEAR = 1e-6
"""Share of a layer's range within which two values count as one."""
SAME_NORMAL = float(np.cos(np.radians(10.0)))
"""Cosine of the angle between two normals up to which they count as one."""


@dataclass(frozen=True, eq=False)
class Layer:
    """Values of the corners of clean faces.

    Attributes
    ----------
    values : (m, 3, d) float64
    normals : bool
        Whether they are normals, of which those count as one that hardly differ.
    given : bool
        Whether a caller gave the values; else they only tell equal points apart.
    """

    values: Floats
    normals: bool = False
    given: bool = True

    @property
    def flat(self) -> Floats:
        """The values (3 m, d) of all corners, face by face."""
        return self.values.reshape(-1, self.values.shape[2])

    @cached_property
    def ranges(self) -> Floats:
        """The range (d,) of each column."""
        if not len(self.values):
            return np.zeros(self.values.shape[2])
        return np.array([np.ptp(column) for column in self.flat.T])

    @property
    def is_texture(self) -> bool:
        """Whether charts may be mirrored: the values are of two dimensions."""
        return bool(self.values.shape[2] == 2)

    def differ(self, one: Integers, other: Integers) -> Mask:
        """Return whether corners (k,) have other values than others (k,)."""
        first, second = self.flat[one], self.flat[other]
        if self.normals:
            lengths = np.sqrt(dot(first, first) * dot(second, second))
            return np.asarray(dot(first, second) < SAME_NORMAL * lengths)
        result = np.zeros(len(first), dtype=bool)
        for k, span in enumerate(self.ranges):  # by columns, which numpy does five times as fast
            result |= np.abs(first[:, k] - second[:, k]) > NEAR * span
        return result

    def mirrored(self, low: Indices, high: Indices) -> Mask:
        """Return the pairs of faces (p,) whose charts lie on the same side of their common edge.

        Parameters
        ----------
        low, high : (2, p) intp
            Corners of both faces at the ends of the edge.
        """
        side = np.empty(low.shape)
        for k in range(2):
            third = 9 * (low[k] // 3) + 3 - low[k] - high[k]
            along = self.flat[high[k]] - self.flat[low[k]]
            across = self.flat[third] - self.flat[low[k]]
            side[k] = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
        return np.asarray(side[0] * side[1] > 0.0)

    def divided(self, faces: Indices, count: int) -> Mask:
        """Return the vertices (n,) where corners differ, or faces with mirrored ones meet."""
        flat = faces.ravel()
        some = np.zeros(count, dtype=np.intp)
        some[flat] = np.arange(len(flat))
        result = np.zeros(count, dtype=bool)
        result[flat[self.differ(np.arange(len(flat)), some[flat])]] = True
        if self.is_texture:
            a, b, c = self.values.transpose(1, 2, 0)
            turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            minority = turn < 0.0 if np.count_nonzero(turn < 0.0) < 0.5 * len(turn) else turn > 0.0
            result[faces[minority]] = True
        return result

    def scaled(self, corners: Indices | None = None) -> Floats:
        """Return the values (c, d) of some corners, or of all, as shares of the largest range."""
        largest = float(self.ranges.max(initial=0.0))
        values = self.flat if corners is None else self.flat[corners]
        return values / max(largest, np.finfo(np.float64).tiny)


def read_layers(
    geometry: Geometry,
    corner_values: ArrayLike | Sequence[ArrayLike] | None,
    corner_normals: ArrayLike | None,
    protected: Mask | None,
) -> list[Layer]:
    """Return the layers of a mesh.

    Parameters
    ----------
    geometry : Geometry
    corner_values : (F, 3, d) array_like, or sequence of them, or None
        An empty sequence says that corners have no values.
    corner_normals : (F, 3, 3) array_like or None
    protected : (N,) bool or None
        Input points that are never removed: each is told from those that equal it.

    Raises
    ------
    GeometryError
        If an array does not hold values for every corner of the faces that were analysed.

    Notes
    -----
    Where values are not known, equal points are told apart: they differ, or a file would not have
    split them.
    """
    unknown = corner_values is None and corner_normals is None
    layers = [_layer(geometry, array, "corner_values") for array in arrays_of(corner_values)]
    if corner_normals is not None:
        layers.append(_layer(geometry, corner_normals, "corner_normals", normals=True))
    if geometry.corner_points is not None and (unknown or protected is not None):
        copy = copy_numbers(geometry.vertex_of)[geometry.corner_points].astype(np.float64)
        if unknown:
            layers.append(Layer(copy[:, :, None], given=False))
        if protected is not None:
            own = np.where(protected[geometry.corner_points], copy + 1.0, 0.0)
            layers.append(Layer(own[:, :, None], given=False))
    return layers


def copy_numbers(vertex_of: Indices) -> Indices:
    """Return the number (N,) of each input point among those of its vertex, from 0."""
    order = np.argsort(vertex_of, kind="stable")
    ordered = vertex_of[order]
    start = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(order)])
    number = np.empty(len(order), dtype=np.intp)
    size = np.diff(np.append(start, len(order)))
    number[order] = np.arange(len(order)) - np.repeat(start, size)
    return number


def arrays_of(values: Any) -> list[ArrayLike]:
    """Return the arrays that are given: a list or tuple of them is several, None is none."""
    if values is None:
        return []
    if isinstance(values, list | tuple) and all(
        isinstance(one, np.ndarray) and one.ndim > 1 for one in values
    ):
        return list(values)
    return [values]


def _layer(geometry: Geometry, array: ArrayLike, name: str, *, normals: bool = False) -> Layer:
    """Return values of the corners of clean faces."""
    shape = (geometry.given_faces, 3)
    values = checked_values(array, name, shape)
    if normals and values.shape[2] != 3:
        raise GeometryError(f"{name} of shape {np.shape(array)}: give normals of shape (F, 3, 3)")
    if len(geometry.face_of) != len(values):
        values = values[geometry.face_of]
    return Layer(values, normals)
