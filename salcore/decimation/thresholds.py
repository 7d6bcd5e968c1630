# SPDX-License-Identifier: GPL-3.0-or-later
"""Thresholds of cost for the rounds on large clouds, on one scale for all.

A round that takes a share of the living depends on all of them. These rounds depend on costs alone,
so that a tile of a cloud goes through the same collapses as the whole: a round takes what costs at
most the threshold, and the next threshold is a tenth higher, or as high as the cheapest that is
left. Rounds without a candidate change nothing, hence tiles may pass over them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Floats, Mask

GROWTH = 1.1
"""Factor between thresholds. At 1.2 the error of a carved stone at 10 % is 7 % larger."""
FIRST = 0.002
"""First threshold, as a share of the cost of a vertex of mean area that goes as far off the surface
as its side is long: on scans of five kinds the cheapest tenth to third of the vertices."""
LOWEST = -7500
"""Step of a cost of nothing: below that of the smallest double."""
STEPS = 15000
"""Number of steps, up to that of the largest double."""


LAST_STEP = LOWEST + STEPS
"""Step of vertices that never go."""


@dataclass(frozen=True)
class Scale:
    """What a tile takes over from the whole cloud.

    Attributes
    ----------
    mean_face : float
        Mean area of the triangles.
    mean_area : float
        Mean area that a vertex stands for.
    """

    mean_face: float
    mean_area: float


def steps_of(costs: Floats) -> NDArray[np.int64]:
    """Return the lowest step whose threshold each of some costs (n,) does not exceed."""
    with np.errstate(divide="ignore"):
        step = np.ceil(np.log(costs) / np.log(GROWTH))
    return np.asarray(np.clip(step, LOWEST, LOWEST + STEPS - 1), dtype=np.int64)


def first_step(mean_area: float) -> int:
    """Return the step of the first round, from the mean area that a vertex stands for."""
    return int(steps_of(np.array([FIRST * mean_area**1.5]))[0])


@dataclass(eq=False)
class Thresholds:
    """The threshold of the current round.

    Attributes
    ----------
    step : int
        The threshold is this power of `GROWTH`.
    """

    step: int

    def candidates(self, least: Floats) -> Mask:
        """Return which vertices (n,) cost at most the threshold, raised until there is one."""
        cheapest = least.min(initial=np.inf)
        if np.isfinite(cheapest):
            self.step = max(self.step, int(steps_of(np.array([cheapest]))[0]))
        # A cost on the threshold itself must not be lost to the rounding of a power.
        return np.asarray(least <= GROWTH**self.step * (1.0 + 1e-12))

    def rise(self) -> None:
        """Raise the threshold for the next round."""
        self.step = min(self.step + 1, LOWEST + STEPS - 1)
