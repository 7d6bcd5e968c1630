# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges that are left, as half-edges: each is a collapse of its source into its target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.edges import edge_key
from ..arrays.types import Floats, Indices, Integers, Ints, Keys, Mask
from .costs import Costs
from .legality import seam_factors
from .one_rings import OneRings, twin

MAX_DEAD = 0.1
"""Share of dead edges that are carried along before they are dropped."""


@dataclass(frozen=True, eq=False)
class Ties:
    """What decides between equal costs where vertices do not bear the input's numbers.

    Attributes
    ----------
    vertex : (n,) int32
        The input's numbers of the vertices.
    edge : (e,) int32
        What the numbers of the edges would be.
    """

    vertex: Ints
    edge: Ints

    @classmethod
    def of_edges(cls, low: Ints, high: Ints, links: int, priority: Integers) -> Ties:
        """Return the ties of edges (e,), of which the last are `links`, by their sorted ends."""
        vertex = priority.astype(np.int32)
        is_link = np.arange(len(low)) >= len(low) - links
        order = np.lexsort((vertex.take(high), vertex.take(low), is_link))
        edge = np.empty(len(low), dtype=np.int32)
        edge[order] = np.arange(len(low))
        return cls(vertex, edge)


@dataclass(eq=False)
class HalfEdges:
    """The e undirected edges, both ways: half-edge i runs back along half-edge i ± e, its twin.

    Attributes
    ----------
    source : (2 e,) int32
        Where each begins; its target is where its twin begins. On a dead edge they are equal.
    cost : (2 e,) float64
        Of the collapse of source into target; infinite where there must be none.
    failed : (2 e,) bool
        Whether the collapse has failed since its cost was last worked out.
    seam : (e,) bool
        Edges that stay as lines.
    seams : (n,) int32
        Number of seams at each vertex.
    ties : Ties or None
        Without them the numbers of vertices and half-edges decide between equal costs.
    dead : int
        Number of dead edges.
    """

    source: Ints
    cost: Floats
    failed: Mask
    seam: Mask
    seams: Ints
    ties: Ties | None = None
    dead: int = 0

    @classmethod
    def of_edges(
        cls, low: Ints, high: Ints, seam: Mask, costs: Costs, ties: Ties | None
    ) -> HalfEdges:
        """Return the half-edges of edges (e,), with their costs."""
        source = np.concatenate([low, high])
        seams = np.bincount(low[seam], minlength=len(costs.points))
        seams += np.bincount(high[seam], minlength=len(costs.points))
        failed = np.zeros(len(source), dtype=bool)
        half_edges = cls(source, np.empty(0), failed, seam, seams.astype(np.int32), ties)
        half_edges.cost = half_edges._evaluate(np.arange(len(source), dtype=np.int32), costs)
        return half_edges

    def target(self, half: Integers) -> Ints:
        """Return where half-edges end."""
        return self.source.take(twin(half, len(self.seam)))

    def _evaluate(self, half: Integers, costs: Costs) -> Floats:
        """Return the costs of half-edges, seams included."""
        source = self.source.take(half)
        cost = costs.evaluate(source, self.target(half))
        if self.seams.any():
            cost *= seam_factors(self.seams[source], self.seam[half % len(self.seam)])
        return cost

    def find_cheapest(self) -> Floats:
        """Return the least cost (n,) of every vertex as a source; infinite for none."""
        least = np.full(len(self.seams), np.inf)
        np.minimum.at(least, self.source, self.cost)
        return least

    def pick_collapses(self, candidates: Mask, least: Floats) -> Indices:
        """Return the cheapest half-edge of each candidate that has no cheaper neighbour.

        Parameters
        ----------
        candidates : (n,) bool
        least : (n,) float64
            Cost of each vertex's cheapest half-edge.

        Returns
        -------
        (s,) intp
            Cheapest first.
        """
        chosen = np.flatnonzero(self._independent(candidates, least))
        if self.ties is not None:
            chosen = chosen[np.argsort(self.ties.vertex[chosen])]
        chosen = chosen[np.argsort(least[chosen], kind="stable")]
        return self._find_cheapest_of(least, least[candidates].max(initial=0.0))[chosen]

    def _independent(self, candidates: Mask, least: Floats) -> Mask:
        """Return candidates (n,), no two of them neighbours; of two the cheaper is preferred."""
        low, high = self.source.reshape(2, -1)
        between = np.flatnonzero(candidates.take(low) & candidates.take(high))
        low, high = low.take(between), high.take(between)
        cost_low, cost_high = least.take(low), least.take(high)
        later = low > high if self.ties is None else self.ties.vertex[low] > self.ties.vertex[high]
        dearer = (cost_low > cost_high) | ((cost_low == cost_high) & later)
        loser, winner = np.where(dearer, low, high), np.where(dearer, high, low)
        alive = loser != winner
        loser, winner = loser[alive], winner[alive]
        first = candidates.copy()
        first[loser] = False
        # A second choice: those that have lost to losers only, and not to each other.
        second = candidates & ~first
        second[loser[first[winner]]] = False
        second[loser[second[loser] & second[winner]]] = False
        return first | second

    def _find_cheapest_of(self, least: Floats, limit: float) -> Indices:
        """Return the half-edge (n,) that costs the least of each vertex's, up to a limit."""
        half = np.flatnonzero(self.cost <= limit)
        source = self.source.take(half)
        cheapest = self.cost.take(half) == least.take(source)
        half, source = half[cheapest], source[cheapest]
        found = np.empty(len(least), dtype=np.intp)
        found[source] = half  # of several that cost the same, the last
        if self.ties is not None:
            tied = np.zeros(len(least), dtype=bool)
            tied[source[found[source] != half]] = True
            half = half[tied[source]]
            edges = len(self.seam)
            half = half[np.lexsort((self.ties.edge[half % edges], half >= edges))]
            found[self.source[half]] = half
        return found

    def penalize(self, half: Integers, factor: Floats) -> None:
        """Raise the costs of collapses that have failed, so that they do not crowd out others."""
        with np.errstate(invalid="ignore"):
            cost = self.cost[half] * factor
        cost[np.isnan(cost)] = np.inf  # of nothing by infinity
        self.cost[half] = cost
        self.failed[half] = np.isfinite(cost)

    def forget_failures(self, costs: Costs) -> bool:
        """Work out anew all costs that are infinite; return whether one is left that is not."""
        low, high = self.source.reshape(2, -1)
        refused = np.isinf(self.cost)
        refused &= np.tile(low != high, 2)
        half = np.flatnonzero(refused)
        self.cost[half] = self._evaluate(half, costs)
        return bool(np.isfinite(self.cost).any())

    def drop_seams(self) -> None:
        """Treat seams as any other edge from now on."""
        self.seam[:], self.seams[:] = False, 0

    def rewire(self, rings: OneRings, performed: Mask, degree: Integers) -> None:
        """Let the edges that vanish die, and hang the others of the removed on the kept."""
        mine = performed[rings.edge_owner]
        between = mine & (rings.other == rings.edge_kept)
        shared = mine & rings.shared
        moved = mine & ~shared & ~between
        np.subtract.at(degree, rings.other[shared], 1)
        np.subtract.at(degree, rings.edge_kept[between], 1)
        np.add.at(degree, rings.edge_kept[moved], 1)
        if self.seams.any():
            line = self.seam[rings.edges % len(self.seam)]
            self._lay_seams(rings.key[shared & line])
            np.subtract.at(self.seams, rings.other[shared & line], 1)
            np.subtract.at(self.seams, rings.edge_kept[between & line], 1)
            np.add.at(self.seams, rings.edge_kept[moved & line], 1)
        self.source[rings.edges[moved]] = rings.edge_kept[moved]
        gone = rings.edges[shared | between]
        for half in (gone, twin(gone, len(self.seam))):
            self.source[half], self.cost[half] = 0, np.inf
        self.dead += len(gone)

    def remove(self, leaving: Mask) -> None:
        """Let all edges of vertices (n,) die that go with their parts."""
        low, high = self.source.reshape(2, -1)
        gone = np.flatnonzero(leaving.take(low) & (low != high))
        for half in (gone, gone + len(self.seam)):
            self.source[half], self.cost[half] = 0, np.inf
        self.dead += len(gone)

    def _lay_seams(self, keys: Keys) -> None:
        """Make seams of the edges of these keys, which others are laid upon."""
        if not len(keys):
            return
        low, high = self.source.reshape(2, -1)
        under = np.isin(edge_key(low, high, len(self.seams)), keys) & ~self.seam & (low != high)
        self.seam |= under
        for end in (low[under], high[under]):
            np.add.at(self.seams, end, 1)

    def renew(self, changed: Integers, costs: Costs) -> None:
        """Work out anew the costs round vertices that changed."""
        if self.dead > MAX_DEAD * len(self.seam):
            self.drop_dead()
        dirty = np.zeros(len(self.seams), dtype=bool)
        dirty[changed] = True
        low, high = self.source.reshape(2, -1)
        edge = np.flatnonzero(dirty.take(low) | dirty.take(high))
        edge = edge[low[edge] != high[edge]]
        half = np.concatenate([edge, edge + len(self.seam)])
        self.cost[half] = self._evaluate(half, costs)
        self.failed[half] = False

    def drop_dead(self) -> None:
        """Drop the dead edges."""
        low, high = self.source.reshape(2, -1)
        half = np.flatnonzero(np.tile(low != high, 2))
        edge = half[: len(half) // 2]
        self.seam = self.seam.take(edge)
        if self.ties is not None:
            self.ties = Ties(self.ties.vertex, self.ties.edge.take(edge))
        self.source = self.source.take(half)
        self.cost = self.cost.take(half)
        self.failed = self.failed.take(half)
        self.dead = 0

    def renumber(self, number: Ints, alive: Indices) -> None:
        """Give the living vertices, and their half-edges, new numbers."""
        self.drop_dead()
        self.source = number.take(self.source)
        self.seams = self.seams.take(alive)
        if self.ties is not None:
            self.ties = Ties(self.ties.vertex.take(alive), self.ties.edge)
