# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the points of a cloud in tiles are from those that are kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Floats, Indices
from ..input.geometry import box_frame
from ..measure.distances import Surface, distances
from ..measure.errors import Deviation, Errors

NO_FACES = np.empty((0, 3), dtype=np.intp)


def unit_boxes(boxes: Floats, low: Floats, high: Floats) -> Floats:
    """Return boxes (t, 2, 3) of a cloud between two corners in the unit of its clean points."""
    if (low == high).all():
        return np.broadcast_to([[[-np.inf]], [[np.inf]]], boxes.shape).copy()
    first, centre, second = box_frame(low, high)
    return np.asarray(np.ldexp(np.ldexp(boxes, -first) - centre, -second))


def boxes_near(boxes: Floats, tile: int, margin: float) -> Indices:
    """Return which boxes (t, 2, 3) have points within a margin of one of them, itself included."""
    low, high = boxes[tile, 0] - margin, boxes[tile, 1] + margin
    near = (boxes[:, 0] <= high).all(axis=1) & (boxes[:, 1] >= low).all(axis=1)
    return np.flatnonzero(near)


def distances_to_kept(points: Floats, kept: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Return the distances (n,) to the nearest kept points, and to the tangent planes there.

    Parameters
    ----------
    points : (n, 3) float64
    kept, normals : (k, 3) float64
        Kept points and their normals; infinite distances if there are none.
    """
    return distances(points, Surface(kept, NO_FACES, normals))


def sum_up(values: Floats) -> Floats:
    """Return number, maximum, sum and sum of squares (4,) of distances (n,)."""
    return np.array([len(values), values.max(initial=0.0), values.sum(), (values**2).sum()])


def merge_errors(point: Sequence[Floats], surface: Sequence[Floats], diagonal: float) -> Errors:
    """Return the errors of a cloud from what `sum_up` returned of its tiles."""
    none = Deviation(0.0, 0.0, 0.0)
    return Errors(_deviation(point), _deviation(surface), none, none, diagonal)


def _deviation(tiles: Sequence[Floats]) -> Deviation:
    number, largest, total, squares = np.array(tiles).T
    count = max(float(number.sum()), 1.0)
    root = float(np.sqrt(squares.sum() / count))
    return Deviation(float(largest.max()), float(total.sum()) / count, root)
