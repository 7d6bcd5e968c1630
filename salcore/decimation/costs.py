# SPDX-License-Identifier: GPL-3.0-or-later
"""What it costs that one vertex goes into another: quadric error, times what is dear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from ..arrays.vectors import sum_by_label
from .attribute_costs import AttributeCosts
from .quadrics import monomials, point_quadrics

COST_BLOCK = 1 << 15
"""Half-edges whose costs are worked out at once."""
LEAST_AREA = 1e-3
"""Share of the mean area of vertices that each counts at least."""
FLAT_EVENNESS = 1e-9
"""Evenness that all vertices have: where collapses cost nothing, on flat sides, short edges and
even spacing decide. Hardly more than ties: distances to planes of 3e-5 of those along them weigh as
much."""


@dataclass(frozen=True)
class Weights:
    """What a removal costs, beside its quadric error.

    Attributes
    ----------
    factor : (n,) float64
        Multiplies the error: 1 + detail · saliency, and what else is dear.
    evenness : (n,) float64
        Weight of the squared distance to the vertices that went into one, against that to their
        planes.
    guessed_surface : (n,) bool
        Vertices on a surface that is only guessed: a forbidden collapse is put off, not refused.
    protected : (n,) bool
        Vertices that go last of all.
    border : float
        Weight of border planes.
    values : (n, d) float64 or None
        Values of the vertices, such as colours, in units of length: how far from the surface a
        point of other values seems to lie.
    """

    factor: Floats
    evenness: Floats
    guessed_surface: Mask
    protected: Mask
    border: float
    values: Floats | None = None


@dataclass(eq=False)
class Costs:
    """What each of the living vertices stands for.

    Attributes
    ----------
    points : (n, 3) float64
    monomials : (n, 10) float64
        Of the points; times a quadric they make its error there.
    quadric : (n, 10) float64
        Sum of the quadrics of all that went into a vertex.
    area : (n,) float64
        Area that the quadric integrates over.
    self_error : (n,) float64
        Error of the quadric at the vertex itself.
    factor : (n,) float64
    protected : (n,) bool
    attributes : AttributeCosts or None
        Of values that count beside the distances.
    """

    points: Floats
    monomials: Floats
    quadric: Floats
    area: Floats
    self_error: Floats
    factor: Floats
    protected: Mask
    attributes: AttributeCosts | None = None

    @classmethod
    def of_vertices(
        cls, points: Floats, quadric: Floats, area: Floats, weights: Weights, mean_area: float
    ) -> Costs:
        """Return the costs of a whole surface; takes `quadric` over, and adds to it."""
        products = np.empty((len(points), 10))

        def fill(start: int, stop: int) -> None:
            here = points[start:stop]
            products[start:stop] = monomials(here)
            evenness = weights.evenness[start:stop]
            if evenness.any():
                spread = evenness * np.maximum(area[start:stop], mean_area) / 3.0
                quadric[start:stop] += point_quadrics(here, spread)

        run_blocks(fill, len(points))
        area = np.maximum(area, LEAST_AREA * mean_area)
        values = weights.values
        return cls(
            points,
            products,
            quadric,
            area=area,
            self_error=np.zeros(len(points)),
            factor=weights.factor,
            protected=weights.protected,
            attributes=None if values is None else AttributeCosts.of_points(values, area),
        )

    def evaluate(self, source: Ints, target: Ints) -> Floats:
        """Return the cost of each source going into its target.

        The error of both quadrics at the target, by the root of the area of the source: the
        integral of the squared distance would let large flat parts sink, its mean small features.
        """
        result = np.empty(len(source))

        def kernel(start: int, stop: int) -> None:
            i, j = source[start:stop].astype(np.intp), target[start:stop].astype(np.intp)
            quadric = self.quadric.take(i, axis=0)
            error = np.einsum("ek,ek->e", quadric, self.monomials.take(j, axis=0))
            error += self.self_error.take(j)
            if self.attributes is not None:
                error += self.attributes.evaluate(i, j)
            cost = np.maximum(error, 0.0) * self.factor.take(i)
            cost /= np.sqrt(self.area.take(i))
            cost[self.protected.take(i)] = np.inf
            result[start:stop] = cost

        run_blocks(kernel, len(source), size=COST_BLOCK)
        return result

    def merge(self, removed: Integers, kept: Integers) -> Integers:
        """Add what the removed stand for to the kept, and return these (c,), each once."""
        changed, place = np.unique(kept, return_inverse=True)
        # The area that is there comes first: sums depend on their order.
        labels = np.concatenate([np.arange(len(changed)), place])
        self.area[changed] = np.bincount(labels, self.area[np.concatenate([changed, removed])])
        self.quadric[changed] += sum_by_label(
            self.quadric.take(removed, axis=0), place, len(changed)
        )
        error = np.einsum(
            "nk,nk->n", self.quadric.take(changed, axis=0), self.monomials.take(changed, axis=0)
        )
        if self.attributes is not None:
            self.attributes.merge(removed, changed, place)
            error += self.attributes.evaluate(changed, changed)
        self.self_error[changed] = error.clip(min=0.0)
        return changed

    def mean_square(self, vertices: Integers) -> Floats:
        """Return the mean square distance of vertices to the planes that they stand for."""
        error: Floats = self.self_error[vertices] / self.area[vertices]
        return error

    def compact(self, alive: Indices) -> None:
        """Keep the living vertices only."""
        self.points = self.points.take(alive, axis=0)
        self.monomials = self.monomials.take(alive, axis=0)
        self.quadric = self.quadric.take(alive, axis=0)
        self.area = self.area.take(alive)
        self.self_error = self.self_error.take(alive)
        self.factor = self.factor.take(alive)
        self.protected = self.protected.take(alive)
        if self.attributes is not None:
            self.attributes.compact(alive)
