# SPDX-License-Identifier: GPL-3.0-or-later
"""The boxes that a cloud is cut into, found from counts of points in cells."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Floats, Mask

CELLS = 64
"""Cells along each side of the bounding box, in which points are counted."""
REACH = 8.0
"""Width of a halo in spacings of the points that are kept: beyond it a tile's border changes hardly
any choice."""
LEAST_REACH = 24.0
"""Width of a halo in spacings of the points that are given, at the least."""


def count_cells(points: Floats, low: Floats, high: Floats) -> NDArray[np.int64]:
    """Return the number of points in each cell of a box; counts of parts of a cloud can be added.

    Parameters
    ----------
    points : (n, 3) float64
        Those that are not finite are left out.
    low, high : (3,) float64
        Corners of the box.

    Returns
    -------
    (CELLS, CELLS, CELLS) int64
    """
    finite = points[np.isfinite(points).all(axis=1)]
    cell = np.clip(_cells_of(finite, low, high), 0, CELLS - 1)
    flat = np.ravel_multi_index(tuple(cell.T), (CELLS,) * 3)
    return np.bincount(flat, minlength=CELLS**3).reshape((CELLS,) * 3)


def _cells_of(points: Floats, low: Floats, high: Floats) -> NDArray[np.int64]:
    """Return the cells (n, 3) of points."""
    side = np.where(high > low, high - low, 1.0) / CELLS
    return np.floor((points - low) / side).astype(np.int64)


def plan_boxes(counts: NDArray[np.int64], low: Floats, high: Floats, most: int) -> Floats:
    """Cut a box, at faces of cells, until no part has more than so many points.

    Parameters
    ----------
    counts : (CELLS, CELLS, CELLS) int64
    low, high : (3,) float64
    most : int
        Points that a tile may have; a single cell may have more.

    Returns
    -------
    (t, 2, 3) float64
        Lowest and highest corners of the tiles that are not empty. They fill the box but for empty
        parts; the outermost reach to infinity, so that no point is lost to rounding.
    """
    done, waiting = [], [(np.zeros(3, dtype=int), np.full(3, CELLS))]
    while waiting:
        start, stop = waiting.pop()
        here = counts[tuple(slice(a, b) for a, b in zip(start, stop, strict=True))]
        cut = _halve(here, (high - low) / CELLS) if here.sum() > most else None
        if cut is None:
            if here.any():
                done.append((start, stop))
            continue
        axis, place = cut
        middle = start[axis] + place
        first, second = stop.copy(), start.copy()
        first[axis] = second[axis] = middle
        waiting += [(second, stop), (start, first)]
    side = (high - low) / CELLS
    boxes = np.empty((len(done), 2, 3))
    for box, (start, stop) in zip(boxes, done, strict=True):
        box[0] = np.where(start == 0, -np.inf, low + start * side)
        box[1] = np.where(stop == CELLS, np.inf, low + stop * side)
    return boxes


def _halve(counts: NDArray[np.int64], side: Floats) -> tuple[int, int] | None:
    """Return the axis and place of a cut into halves of like many points; None for a single cell.

    Of the axes the one along which the points spread furthest.
    """
    best, found = -1.0, None
    for axis in range(3):
        along = counts.sum(axis=tuple(k for k in range(3) if k != axis))
        filled = np.flatnonzero(along)
        spread = (filled[-1] - filled[0]) * side[axis]
        if filled[-1] == filled[0] or spread <= best:
            continue
        total = np.cumsum(along)
        place = int(np.argmin(np.abs(total[:-1] - total[-1] / 2))) + 1
        best, found = spread, (axis, place)
    return found


def within(points: Floats, box: Floats, halo: float = 0.0) -> Mask:
    """Return which points (n,) lie in a box (2, 3) that is wider by a halo; upper faces not."""
    inside = np.ones(len(points), dtype=bool)
    for axis in range(3):
        inside &= points[:, axis] >= box[0, axis] - halo
        inside &= points[:, axis] < box[1, axis] + halo
    return inside


def halo_width(spacing: float, ratio: float) -> float:
    """Return the width of a halo, in the unit of the spacing.

    Parameters
    ----------
    spacing : float
        Distance between neighbouring points.
    ratio : float
        Share of the points that are kept.
    """
    return spacing * max(LEAST_REACH, REACH / math.sqrt(max(ratio, 1e-9)))
