# SPDX-License-Identifier: GPL-3.0-or-later
"""What a collapse costs in values of points, such as colours.

As Garland and Heckbert, Simplifying surfaces with color and texture using quadric error metrics,
1998, add the squared differences of values to squared distances. Vertices stay original points
here, so the sum over all points that went into one is known from three moments.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Floats, Indices, Integers
from ..arrays.vectors import dot, sum_by_label


@dataclass(eq=False)
class AttributeCosts:
    """Moments of the values of all points that went into each of n living vertices.

    Attributes
    ----------
    values : (n, d) float64
        Of the vertices themselves, in units of length.
    weight : (n,) float64
        Sum of the weights of the points, which are areas.
    total : (n, d) float64
        Weighted sum of their values.
    square : (n,) float64
        Weighted sum of their squared values.
    """

    values: Floats
    weight: Floats
    total: Floats
    square: Floats

    @classmethod
    def of_points(cls, values: Floats, areas: Floats) -> AttributeCosts:
        """Return the moments of points that stand for themselves."""
        return cls(values, areas.copy(), values * areas[:, None], areas * dot(values, values))

    def evaluate(self, source: Integers, target: Integers) -> Floats:
        """Return the sum of weighted squared differences (e,) of all in source to each target."""
        value = self.values.take(target, axis=0)
        error = self.weight.take(source) * dot(value, value) + self.square.take(source)
        error -= 2.0 * dot(value, self.total.take(source, axis=0))
        return np.maximum(error, 0.0)

    def merge(self, removed: Integers, changed: Integers, place: Integers) -> None:
        """Add the moments of the removed (r,) to those of `changed` (c,), at places (r,)."""
        count = len(changed)
        self.weight[changed] += np.bincount(place, self.weight[removed], count)
        self.square[changed] += np.bincount(place, self.square[removed], count)
        self.total[changed] += sum_by_label(self.total[removed], place, count)

    def compact(self, alive: Indices) -> None:
        """Keep the living vertices only."""
        self.values, self.total = self.values[alive], self.total[alive]
        self.weight, self.square = self.weight[alive], self.square[alive]
