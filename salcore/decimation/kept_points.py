# SPDX-License-Identifier: GPL-3.0-or-later
"""The kept vertices in the input's own numbers: which points stay, and which stands for each.

A vertex may stand for several equal points. On a mesh these are copies, split for the sake of
values that belong to corners: those stay that the corners of the kept faces take their values from.
In a cloud each is a point of its own. Protected points stay in either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Indices, Mask
from ..input.geometry import Geometry


@dataclass(frozen=True, eq=False)
class KeptPoints:
    """Kept points.

    Attributes
    ----------
    indices : (M,) intp
        Input points, ascending.
    source : (N,) int64
        Position in `indices` of the point that stands for each input point; -1 for none.
    position : (N,) int64
        Position of each kept input point in `indices`.
    first : (n,) intp
        A kept input point of each kept vertex.
    """

    indices: Indices
    source: Indices
    position: Indices
    first: Indices


def first_points(geometry: Geometry, protected: Mask | None) -> Indices:
    """Return the input point (n,) that stands for each vertex: a protected one before others."""
    first = geometry.input_of
    if protected is None:
        return first
    point = np.flatnonzero(protected & (geometry.vertex_of >= 0))[::-1]
    # One that a face uses stays in its place; what is protected stays besides.
    point = point[~geometry.loose[point] | geometry.loose[first[geometry.vertex_of[point]]]]
    first = first.copy()
    first[geometry.vertex_of[point]] = point
    return first


def keep_points(
    geometry: Geometry, kept: Indices, source: Indices, protected: Mask | None, copies: int
) -> KeptPoints:
    """Return one point for each kept vertex, all protected ones, and some more copies.

    Parameters
    ----------
    geometry : Geometry
    kept : (m,) intp
        Kept vertices.
    source : (n,) intp
        Kept vertex that stands for each; -1 for none.
    protected : (N,) bool or None
        Input points that stay.
    copies : int
        Further points to keep, of those that equal a kept one.
    """
    first = first_points(geometry, protected)
    stays = np.zeros(geometry.input_count, dtype=bool)
    stays[first[kept]] = True
    if protected is not None:
        stays |= protected & (geometry.vertex_of >= 0)
    _fill_up(geometry, stays, copies)
    return _number(geometry, stays, first, source)


def keep_corner_points(
    geometry: Geometry,
    kept: Indices,
    source: Indices,
    protected: Mask | None,
    copies: int,
    corner_points: Indices,
    heir: Indices,
) -> KeptPoints:
    """Return the points that the corners of kept faces use, and those of vertices without faces.

    Parameters
    ----------
    geometry, kept, source, protected, copies
        As for `keep_points`.
    corner_points : (K, 3) intp
        Input points at the corners of the kept faces.
    heir : (N,) intp
        Input point that would stand for each; -1 where none is known.
    """
    first = first_points(geometry, protected)
    stays = np.zeros(geometry.input_count, dtype=bool)
    stays[corner_points] = True
    bare = np.zeros(len(first), dtype=bool)
    bare[kept] = True
    bare[geometry.vertex_of[corner_points]] = False
    stays[first[bare]] = True
    used = np.flatnonzero(stays)
    first = first.copy()
    first[geometry.vertex_of[used]] = used
    if protected is not None:
        stays |= protected & (geometry.vertex_of >= 0)
    _fill_up(geometry, stays, copies)
    result = _number(geometry, stays, first, source)
    known = np.flatnonzero((heir >= 0) & (geometry.vertex_of >= 0) & ~stays)
    known = known[stays[heir[known]]]
    result.source[known] = result.position[heir[known]]
    return result


def _fill_up(geometry: Geometry, stays: Mask, copies: int) -> None:
    """Let some more points stay, in their order, of those that no face uses."""
    others = geometry.loose & (geometry.vertex_of >= 0) & ~stays
    stays[np.flatnonzero(others)[: max(copies, 0)]] = True


def _number(geometry: Geometry, stays: Mask, first: Indices, source: Indices) -> KeptPoints:
    """Return the points (N,) that stay, where `first` (n,) of each kept vertex is one of them."""
    position = np.cumsum(stays, dtype=np.int64) - 1
    # Vertex -1, a dropped point or one that nothing stands for, finds the last entry.
    vertex = np.append(source, -1)[geometry.vertex_of]
    heir = np.append(first, -1)[vertex]
    result = np.where(vertex < 0, -1, np.append(position, -1)[heir])
    indices = np.flatnonzero(stays)
    result[indices] = position[indices]
    return KeptPoints(indices, result, position, first)
