# SPDX-License-Identifier: GPL-3.0-or-later
"""The pairs of vertices that an edge joins, and what it costs to go along it, both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .collapse import Stars
from .costs import Costs
from .geometry import Floats, Indices
from .progress import Rests

Mask = NDArray[np.bool_]
Ints = NDArray[np.int32]

OFF_SEAM = 10.0
"""Factor on the cost of leaving a seam, and of laying one upon another edge."""
DEAD = 0.1
"""Share of dead edges that are carried along before they are dropped."""


@dataclass(eq=False)
class Pairs:
    """Edges, each kept once.

    Attributes
    ----------
    a, b : (e,) int32
        Their ends; a dead edge has equal ones.
    a_to_b, b_to_a : (e,) float64
        Cost of a going into b, and of b into a.
    tried_a, tried_b : (e,) bool
        Whether a going into b, or b into a, has failed since its cost was last worked out.
    seam : (e,) bool
        Edges that stay as lines: a vertex on one goes along it, or not at all where seams meet.
    seams : (n,) int32
        Number of seams at each vertex.
    dead : int
        Number of dead edges.
    """

    a: Ints
    b: Ints
    a_to_b: Floats
    b_to_a: Floats
    tried_a: Mask
    tried_b: Mask
    seam: Mask
    seams: Ints
    dead: int = 0

    @classmethod
    def start(cls, a: Ints, b: Ints, seam: Mask, costs: Costs) -> Rests[Pairs]:
        """Work out all costs, with rests."""
        count = len(costs.points)
        seams = np.bincount(a[seam], minlength=count) + np.bincount(b[seam], minlength=count)
        nothing = np.empty(len(a))
        untried = np.zeros(len(a), bool), np.zeros(len(a), bool)
        pairs = cls(a, b, nothing, nothing.copy(), *untried, seam, seams.astype(np.int32))
        for going, staying, cost in pairs.directions():
            cost[:] = yield from costs.of(going, staying)
            pairs._hold_seams(going, cost, seam)
        return pairs

    def _hold_seams(self, going: Ints, cost: Floats, seam: Mask) -> None:
        """Make it dear to leave a seam, or a place where seams meet or end.

        Not impossible: a texture of many small charts would hold on to its seams until all between
        them has gone.
        """
        if seam.any() or self.seams.any():
            lines = self.seams[going]
            cost[(lines > 0) & (~seam | (lines != 2))] *= OFF_SEAM

    def drop_seams(self) -> None:
        """Treat seams as any other edge from now on."""
        self.seam[:], self.seams[:] = False, 0

    def break_seams(self, stars: Stars) -> Mask:
        """Return which collapses would lay a seam upon another edge."""
        broken = np.zeros(len(stars.going), dtype=bool)
        broken[stars.edge_owner[stars.common & self.seam[stars.edges]]] = True
        return broken

    def directions(self) -> tuple[tuple[Ints, Ints, Floats], tuple[Ints, Ints, Floats]]:
        """Return who goes, who stays, and the cost, both ways."""
        return (self.a, self.b, self.a_to_b), (self.b, self.a, self.b_to_a)

    def cheapest(self, count: int) -> Rests[Floats]:
        """Return the least cost of each of `count` vertices, infinite for none, with rests."""
        result = np.full(count, np.inf)
        for going, _, cost in self.directions():
            np.minimum.at(result, going, cost)
            yield
        return result

    def targets(self, candidates: Indices, cheapest: Floats) -> Rests[Ints]:
        """Return the cheapest vertex (n,) to go into, for the candidates, with rests."""
        target = np.zeros(len(cheapest), dtype=np.int32)
        limit = cheapest[candidates].max()
        for going, staying, cost in self.directions():
            best = np.flatnonzero(cost <= limit)
            best = best[cost[best] == cheapest[going[best]]]
            target[going[best]] = staying[best]
            yield
        return target

    def independent(self, candidates: Indices, cheapest: Floats) -> Rests[Indices]:
        """Return candidates of which no two are neighbours; the cheaper of two is preferred."""
        candidate = np.zeros(len(cheapest), dtype=bool)
        candidate[candidates] = True
        both = candidate[self.a] & candidate[self.b]
        yield
        between = np.flatnonzero(both & (self.a != self.b))
        yield
        a, b = self.a[between], self.b[between]
        dearer = (cheapest[a] > cheapest[b]) | ((cheapest[a] == cheapest[b]) & (a > b))
        loser = np.where(dearer, a, b)
        winner = a + b - loser
        yield
        first = candidate.copy()
        first[loser] = False
        # A second helping: those that lost only to losers.
        candidate[first] = False
        candidate[loser[first[winner]]] = False
        rest = candidate[loser] & candidate[winner]
        candidate[loser[rest]] = False
        return np.flatnonzero(first | candidate)

    def put_aside(self, stars: Stars, failed: Mask, patience: Floats) -> Mask:
        """Make failed pairs dearer, so that they do not crowd out the others; return the forgiven.

        A pair is forgiven once it is cheapest again at its raised cost.
        """
        hit = np.flatnonzero(failed[stars.edge_owner] & (stars.edge_other == stars.edge_target))
        edge, owner = stars.edges[hit], stars.edge_owner[hit]
        going = stars.going[owner]
        forgiven = np.zeros(len(failed), dtype=bool)
        outward = self.a[edge] == going
        for side, cost, tried in (
            (outward, self.a_to_b, self.tried_a),
            (~outward, self.b_to_a, self.tried_b),
        ):
            one = edge[side]
            forgiven[owner[side]] = tried[one] & np.isfinite(patience[going[side]])
            with np.errstate(invalid="ignore"):
                cost[one] *= patience[going[side]]
            cost[one[np.isnan(cost[one])]] = np.inf
            tried[one] = np.isfinite(cost[one])
        return forgiven

    def forget_failures(self, costs: Costs) -> Rests[bool]:
        """Work out anew the costs of pairs that were put aside; return whether any edge is left."""
        alive = self.a != self.b
        for going, staying, cost in self.directions():
            aside = np.flatnonzero(np.isinf(cost) & alive)
            again = yield from costs.of(going[aside], staying[aside])
            self._hold_seams(going[aside], again, self.seam[aside])
            cost[aside] = again
        return bool((np.isfinite(self.a_to_b) | np.isfinite(self.b_to_a)).any())

    def rewire(self, stars: Stars, good: Mask, degree: Indices) -> Rests[None]:
        """Let the edges that vanish die, and hang the others on the vertices that stay."""
        owner, other, target = stars.edge_owner, stars.edge_other, stars.edge_target
        mine = good[owner]
        between = other == target
        shared = mine & stars.common & ~between
        moved = mine & ~stars.common & ~between
        yield
        np.subtract.at(degree, other[shared], 1)
        np.subtract.at(degree, target[mine & between], 1)
        np.add.at(degree, target[moved], 1)
        yield
        line = self.seam[stars.edges]
        if (shared & line).any():
            self._lay_seams(stars.key[shared & line])
        np.subtract.at(self.seams, other[shared & line], 1)
        np.subtract.at(self.seams, target[mine & between & line], 1)
        np.add.at(self.seams, target[moved & line], 1)
        yield
        edge = stars.edges[moved]
        at_a = self.a[edge] == stars.going[owner[moved]]
        self.a[edge[at_a]] = target[moved][at_a]
        self.b[edge[~at_a]] = target[moved][~at_a]
        yield
        dead = stars.edges[mine & (stars.common | between)]
        self.a[dead] = self.b[dead] = 0
        self.a_to_b[dead] = self.b_to_a[dead] = np.inf
        self.dead += len(dead)

    def _lay_seams(self, keys: NDArray[np.int64]) -> None:
        """Make seams of the edges of these keys, which others are laid upon."""
        count = len(self.seams)
        own = np.minimum(self.a, self.b).astype(np.int64) * count + np.maximum(self.a, self.b)
        under = np.isin(own, keys) & ~self.seam & (self.a != self.b)
        self.seam |= under
        for end in (self.a[under], self.b[under]):
            np.add.at(self.seams, end, 1)

    def renew(self, changed: Ints, costs: Costs) -> Rests[None]:
        """Work out anew the costs round vertices that changed, with rests."""
        if self.dead > DEAD * len(self.a):
            yield from self.drop_dead()
        dirty = np.zeros(len(costs.points), dtype=bool)
        dirty[changed] = True
        touched = dirty[self.a] | dirty[self.b]
        yield
        edge = np.flatnonzero(touched & (self.a != self.b))
        a, b = self.a[edge], self.b[edge]
        yield
        for going, staying, cost in ((a, b, self.a_to_b), (b, a, self.b_to_a)):
            fresh = yield from costs.of(going, staying)
            self._hold_seams(going, fresh, self.seam[edge])
            cost[edge] = fresh
        self.tried_a[edge] = self.tried_b[edge] = False

    def drop_dead(self) -> Rests[None]:
        """Drop the dead edges, with rests."""
        alive = self.a != self.b
        for name in ("a", "b", "a_to_b", "b_to_a", "tried_a", "tried_b", "seam"):
            setattr(self, name, getattr(self, name)[alive])
            yield
        self.dead = 0
