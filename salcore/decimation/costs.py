# SPDX-License-Identifier: GPL-3.0-or-later
"""What it costs that one vertex goes into another: quadric error, times what is dear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .blocks import rest_blocks
from .geometry import Floats, Indices
from .progress import Rests
from .quadrics import monomials, point_quadrics, vertex_quadrics
from .triangles import Edges

Mask = NDArray[np.bool_]
Ints = NDArray[np.int32]

COST_BLOCK = 1 << 15


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
    lenient : (n,) bool
        Vertices on a surface that is only guessed: a forbidden collapse is put off, not refused.
    protected : (n,) bool
        Vertices that go last of all.
    border : float
        Weight of border planes.
    """

    factor: Floats
    evenness: Floats
    lenient: Mask
    protected: Mask
    border: float


@dataclass(eq=False)
class Costs:
    """What each of the living vertices stands for.

    Attributes
    ----------
    points : (n, 3) float64
    products : (n, 10) float64
        `monomials` of the points.
    quadric : (n, 10) float64
        Sum of the quadrics of all that went into a vertex.
    area : (n,) float64
        Area that the quadric integrates over.
    own : (n,) float64
        Error of the quadric at the vertex itself.
    factor : (n,) float64
    protected : (n,) bool
    workers : int
    """

    points: Floats
    products: Floats
    quadric: Floats
    area: Floats
    own: Floats
    factor: Floats
    protected: Mask
    workers: int

    @classmethod
    def start(
        cls,
        points: Floats,
        faces: NDArray[np.integer],
        edges: Edges,
        seam: Mask,
        weights: Weights,
        workers: int,
    ) -> Rests[Costs]:
        """Rest between the parts of the work; return the costs of a surface that is still whole."""
        products = np.empty((len(points), 10))

        def multiply(start: int, stop: int) -> None:
            products[start:stop] = monomials(points[start:stop])

        yield from rest_blocks(multiply, len(points), workers=workers)
        quadric, area = yield from vertex_quadrics(
            points, faces, edges, weights.border, workers, seam
        )
        mean_area = area.mean() if area.any() else 1.0
        if weights.evenness.any():
            spread = weights.evenness * np.maximum(area, mean_area) / 3.0

            def even(start: int, stop: int) -> None:
                quadric[start:stop] += point_quadrics(points[start:stop], spread[start:stop])

            yield from rest_blocks(even, len(points), workers=workers)
        area = np.maximum(area, 1e-3 * mean_area)
        own = np.zeros(len(points))
        return cls(points, products, quadric, area, own, weights.factor, weights.protected, workers)

    def of(self, going: Ints, staying: Ints) -> Rests[Floats]:
        """Return the cost of each vertex going into another, with rests.

        The error of both quadrics at the vertex that stays, by the root of the area gone into: the
        integral of the squared distance would let large flat parts sink, its mean small features.
        """
        result = np.empty(len(going))

        def kernel(start: int, stop: int) -> None:
            i, j = going[start:stop], staying[start:stop]
            error = np.einsum("ek,ek->e", self.quadric[i], self.products[j])
            cost = np.maximum(error + self.own[j], 0.0) * self.factor[i]
            cost /= np.sqrt(self.area[i])
            cost[self.protected[i]] = np.inf
            result[start:stop] = cost

        yield from rest_blocks(kernel, len(going), workers=self.workers, size=COST_BLOCK)
        return result

    def merge(self, gone: Indices, into: Ints) -> Rests[tuple[Ints, Floats]]:
        """Add up quadrics on the vertices that stay.

        Returns
        -------
        changed : (c,) int
            The vertices that something went into.
        mean_square : (g,) float64
            Mean square distance to the planes of the vertex that each went into.
        """
        np.add.at(self.area, into, self.area[gone])
        changed, place = np.unique(into, return_inverse=True)
        yield
        for k in range(10):
            self.quadric[changed, k] += np.bincount(place, self.quadric[gone, k], len(changed))
            yield
        self.own[changed] = np.einsum(
            "nk,nk->n", self.quadric[changed], self.products[changed]
        ).clip(min=0.0)
        return changed, self.own[into] / self.area[into]

    def keep(self, alive: Indices) -> Rests[None]:
        """Keep the living vertices only, with rests."""
        for name in ("points", "products", "quadric", "area", "own", "factor", "protected"):
            setattr(self, name, getattr(self, name)[alive])
            yield
