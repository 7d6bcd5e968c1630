# SPDX-License-Identifier: GPL-3.0-or-later
"""What all tiles of a cloud together come to: statistics are added, and one cut is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Floats, Ints, Mask
from ..decimation.quadrics import LEAST_AREA
from ..decimation.thresholds import LAST_STEP, LOWEST, Scale
from ..errors import ParameterError
from ..method.saliency import MIN_SPREAD, QUANTILES

SALIENCY_BINS = 1 << 16
"""Bins of saliency from 0 to 1, before it is scaled."""
AREA_GROWTH, AREA_BINS = 1.01, 1 << 17
"""Factor between the bins of areas, and their number: down from 1, the square on the whole's
diagonal, to the least double."""


@dataclass(frozen=True, eq=False)
class Statistics:
    """What one tile adds to the whole; only its core counts.

    Attributes
    ----------
    points : int
        Distinct points.
    saliency : (SALIENCY_BINS,) int64
        Histogram of saliency before it is scaled.
    faces : (AREA_BINS,) int64
        Number of triangles with areas in each bin.
    areas : (AREA_BINS,) float64
        Sum of these areas.
    """

    points: int
    saliency: NDArray[np.int64]
    faces: NDArray[np.int64]
    areas: Floats

    @classmethod
    def of_core(cls, saliency: Floats, areas: Floats) -> Statistics:
        """Return the statistics of saliency (n,) of points and areas (m,) of triangles."""
        place = np.clip(saliency * SALIENCY_BINS, 0, SALIENCY_BINS - 1).astype(np.int64)
        with np.errstate(divide="ignore"):
            step = np.floor(-np.log(areas) / np.log(AREA_GROWTH))
        step = np.clip(step, 0, AREA_BINS - 1).astype(np.int64)
        return cls(
            len(saliency),
            np.bincount(place, minlength=SALIENCY_BINS),
            np.bincount(step, minlength=AREA_BINS),
            np.bincount(step, areas, AREA_BINS).astype(np.float64),
        )

    def __add__(self, other: Statistics) -> Statistics:
        """Return the statistics of two tiles together."""
        return Statistics(
            self.points + other.points,
            self.saliency + other.saliency,
            self.faces + other.faces,
            self.areas + other.areas,
        )


@dataclass(frozen=True)
class Whole:
    """What a tile must know of the whole cloud.

    Attributes
    ----------
    low, spread : float
        Scaled saliency is ``(saliency - low) / spread``, cut off at 0 and 1.
    scale : Scale
        Mean areas.
    """

    low: float
    spread: float
    scale: Scale

    def scaled(self, saliency: Floats) -> Floats:
        """Return the saliency (n,) in [0, 1]."""
        result: Floats = np.clip((saliency - self.low) / self.spread, 0.0, 1.0)
        return result


def merge_statistics(tiles: Sequence[Statistics]) -> Whole:
    """Return what tiles must know of the whole: the same whatever the order of the tiles."""
    points = sum(tile.points for tile in tiles)
    saliency = np.sum([tile.saliency for tile in tiles], axis=0)
    faces = np.sum([tile.faces for tile in tiles], axis=0)
    areas = np.sum([tile.areas for tile in tiles], axis=0)
    low, high = (_quantile(saliency, share) for share in QUANTILES)
    mean_face = float(areas.sum() / max(faces.sum(), 1))
    # Every face weighs so much at least, and at each of its corners.
    least = LEAST_AREA * mean_face
    floor = np.where(np.arange(AREA_BINS) < -np.log(max(least, 1e-300)) / np.log(AREA_GROWTH), 0, 1)
    total = float(np.where(floor, faces * least, areas).sum())
    mean_area = 3.0 * total / max(points, 1)
    return Whole(low, max(high - low, MIN_SPREAD), Scale(mean_face, mean_area or 1.0))


def _quantile(counts: NDArray[np.int64], share: float) -> float:
    """Return a quantile of saliency from its histogram, between bins in proportion."""
    if not counts.any():
        return 0.0
    total = np.cumsum(counts)
    wanted = share * total[-1]
    place = int(np.searchsorted(total, wanted))
    inside = (wanted - (total[place] - counts[place])) / max(counts[place], 1)
    return float((place + inside) / SALIENCY_BINS)


@dataclass(frozen=True)
class Cut:
    """Where the order of the whole is cut: before a point that goes at this step, cost and number.

    Attributes
    ----------
    step : int
    cost : float
    number : int
    """

    step: int
    cost: float
    number: int


def count_steps(step: Ints) -> NDArray[np.int64]:
    """Return how many points (n,) go at each step; counts of tiles can be added."""
    return np.bincount(step - LOWEST, minlength=LAST_STEP - LOWEST + 1)


def worst_by_step(step: Ints, error: Floats) -> Floats:
    """Return the largest error of points (n,) that go at each step; tiles merge by the maximum."""
    worst = np.zeros(LAST_STEP - LOWEST + 1)
    np.maximum.at(worst, step - LOWEST, error)
    return worst


def count_of_error(counts: NDArray[np.int64], worst: Floats, bound: float) -> int:
    """Return about how many points keep an error within a bound, from what all tiles add up to.

    Parameters
    ----------
    counts : (steps,) int64
        From `count_steps`.
    worst : (steps,) float64
        From `worst_by_step`.
    bound : float
    """
    return int(counts[np.maximum.accumulate(worst) > bound].sum())


def find_step(counts: NDArray[np.int64], count: int) -> tuple[int, int]:
    """Return the step within which an order is cut, and how many of its points are kept.

    Parameters
    ----------
    counts : (steps,) int64
        From `count_steps`, added over all tiles.
    count : int
        Points to keep.

    Raises
    ------
    ParameterError
        If there are not so many points.
    """
    total = int(counts.sum())
    if not 0 < count <= total:
        raise ParameterError(f"count={count}: there are {total} valid points; give 1 to so many")
    kept = np.cumsum(counts[::-1])  # of the last steps first
    place = int(np.searchsorted(kept, count))
    step = len(counts) - 1 - place
    return step + LOWEST, count - int(kept[place] - counts[step])


def find_cut(
    step: int, keep: int, costs: Sequence[Floats], numbers: Sequence[NDArray[np.int64]]
) -> Cut:
    """Return the cut, from the costs and numbers of all points that go at its step.

    Parameters
    ----------
    step, keep : int
        From `find_step`.
    costs : sequence of (k,) float64
        One array a tile.
    numbers : sequence of (k,) int64
    """
    cost, number = np.concatenate(costs), np.concatenate(numbers)
    order = np.lexsort((number, -cost))  # the dearest stay; of those that cost the same, the first
    last = order[keep - 1]
    return Cut(step, float(cost[last]), int(number[last]))


def kept_points(cut: Cut, step: Ints, cost: Floats, number: NDArray[np.int64]) -> Mask:
    """Return which points (n,) of a tile a cut keeps."""
    same = step == cut.step
    dearer = (cost > cut.cost) | ((cost == cut.cost) & (number <= cut.number))
    result: Mask = (step > cut.step) | (same & dearer)
    return result
