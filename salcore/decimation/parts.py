# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that go whole: what a mesh of many parts gives up where its points do not feed them all.

Within a part the collapses end at its least count: a tetrahedron, a triangle. A part of few
vertices left has a price, at which it goes as a whole once that is cheaper than any collapse in it.
The largest part never goes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from ..arrays.vectors import hash01, sum_by_label
from .costs import Costs, Weights

PRICE = 1.4
"""A part that goes counts as though all of it moved by its radius: 1.4 times the root mean square
distance from its centre."""
WHOLE = 2.0
"""A part goes whole once that costs no more than so many times its cheapest collapse: better one
leaf less than two halves."""
SMALL_PART = 32
"""Vertices up to which a part may go; larger ones are simplified first."""
SCATTER = 0.1
"""Share by which prices are scattered, so that equal parts do not go from one side on."""


@dataclass(eq=False)
class Parts:
    """The p connected parts of a surface, as far as they are left.

    Attributes
    ----------
    label : (n,) int32
        Part of every vertex that lives.
    move : (p,) float64
        Mean square distance that the loss of each counts for.
    weight : (p,) float64
        Its price times the root of its number of vertices; infinite for parts that may not go.
    size : (p,) int
        Vertices that are left of each.
    largest : int
        The part that never goes.
    """

    label: Ints
    move: Floats
    weight: Floats
    size: Indices
    largest: int

    @classmethod
    def find(
        cls, ends: tuple[Ints, Ints], costs: Costs, weights: Weights, priority: Integers | None
    ) -> Parts | None:
        """Return the parts of a surface with edges between `ends`; None if there is only one."""
        count = len(costs.points)
        links = coo_array((np.ones(len(ends[0]), dtype=bool), ends), shape=(count, count))
        parts, label = connected_components(links, directed=False)
        if parts < 2:
            return None
        order = np.arange(count) if priority is None else np.argsort(priority)
        # Numbered by their first vertices; sums depend on their order.
        _, first, place = np.unique(label[order], return_index=True, return_inverse=True)
        number = np.argsort(np.argsort(first))[place.ravel()]
        size = np.bincount(number, minlength=parts)
        points = costs.points[order]
        centre = sum_by_label(points, number, parts) / size[:, None]
        spread = ((points - centre[number]) ** 2).sum(axis=1)
        move = PRICE**2 * np.bincount(number, spread, parts) / size
        area = np.bincount(number, costs.area[order], parts)
        factor = np.bincount(number, weights.factor[order], parts) / size
        weight = np.sqrt(area) * move * factor * (1.0 + SCATTER * hash01(np.sort(first)))
        largest = int(np.argmax(np.where(np.isfinite(weight), np.sqrt(area) * move, 0.0)))
        fixed = (weights.protected | weights.guessed_surface)[order]
        weight[number[fixed]] = np.inf
        weight[largest] = np.inf
        label = np.empty(count, dtype=np.int32)
        label[order] = number
        return cls(label, move, weight, size, largest)

    def prices(self, least: Floats) -> Floats:
        """Return the price (n,) of a vertex as one of a part that goes; infinite where none does.

        Parameters
        ----------
        least : (n,) float64
            Cost of each vertex's cheapest collapse; infinite for dead vertices.
        """
        price = np.full(len(self.weight), np.inf)
        small = (self.size > 0) & (self.size <= SMALL_PART)
        price[small] = self.weight[small] / np.sqrt(self.size[small])
        if np.isinf(price).all():
            return np.full(len(least), np.inf)
        cheapest = np.full(len(price), np.inf)
        np.minimum.at(cheapest, self.label, least)
        price[price > WHOLE * cheapest] = np.inf
        return price.take(self.label)

    def spare_largest(self, least: Floats) -> Floats:
        """Return costs (n,) without the largest part's, as long as others can go before it."""
        others = np.isfinite(least) & (self.label != self.largest)
        if self.size[self.largest] > SMALL_PART or not others.any():
            return least
        return np.where(others, least, np.inf)

    def remove(self, vertices: Integers) -> None:
        """Count vertices that went."""
        self.size -= np.bincount(self.label[vertices], minlength=len(self.size))

    def compact(self, alive: Indices) -> None:
        """Keep the living vertices only."""
        self.label = self.label.take(alive)


def share_ranks(rank: Indices, gone: list[tuple[Indices, Ints]]) -> Indices:
    """Give the vertices of a part that went whole its highest rank; return these, ascending.

    Parameters
    ----------
    rank : (n,) intp
        Changed in place.
    gone : list of ((v,) intp, (v,) int32)
        Vertices that went with their parts, and these.
    """
    if not gone:
        return np.empty(0, dtype=np.intp)
    vertices, part = (np.concatenate(arrays) for arrays in zip(*gone, strict=True))
    top = np.full(int(part.max()) + 1, -1)
    np.maximum.at(top, part, rank[vertices])
    rank[vertices] = top[part]
    return np.sort(top[top >= 0])


def faces_without(gone: Mask, corners: list[Ints]) -> Mask:
    """Return which faces have no corner among vertices (n,) that are gone."""
    return np.asarray(~(gone[corners[0]] | gone[corners[1]] | gone[corners[2]]))
