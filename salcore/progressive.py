# SPDX-License-Identifier: GPL-3.0-or-later
"""Progressive elimination: vertices go one after another, each into a neighbour that stays.

Half-edge collapses, cheapest first (Hoppe, Progressive meshes, SIGGRAPH 1996), by the quadric
error of the planes that a vertex stands for, times its saliency. Every vertex gets a rank, a parent
and an error, so that any count is a cut through one order.

Collapses are done in rounds. A round takes the cheapest vertices, of which no two are neighbours,
checks them all against the surface at its start, and applies those that neither break it nor clash
with a cheaper one. Nothing runs over vertices one by one.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .collapse import Stars, allowed, clashing
from .geometry import Floats, Indices
from .quadrics import monomials, point_quadrics, vertex_quadrics
from .triangles import find_edges

Mask = NDArray[np.bool_]
Ints = NDArray[np.int32]

SHARE = 0.18
"""Share of the living vertices that a round considers; more runs ahead of the order of costs."""
FEW, SHARE_OF_FEW = 2000, 0.04
"""Below so many vertices a smaller share keeps closer to the order; the rounds cost little."""
RETRY = 0.25
"""Share of the living vertices to go before pairs that failed are tried again. Those next to a
collapse are tried again at once; a pair fails anew where nothing round it has changed."""
IN_VAIN = 2**24
"""Widening after which a stall is taken for granted: every vertex has failed into its 20 or so
cheapest neighbours. Fans of hundreds round a non-manifold edge would take as many rounds."""
STALL = 0.01
"""Share of the living vertices that must go before all pairs have failed again."""
PENALTY = 16.0
"""Factor on the cost of a forbidden collapse, once only forbidden ones are left."""
COST_BLOCK = 1 << 16
COMPACT = 0.6
"""Share of the vertices still living below which the rest is renumbered."""
PER_VERTEX = (
    "names", "points", "products", "quadric", "area", "factor", "protected", "own",
    "heaped", "degree", "patience",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Elimination:
    """The order in which vertices go.

    Attributes
    ----------
    rank : (n,) intp
        A permutation: the vertex of rank r is among the kept of every count above r.
    parent : (n,) intp
        Vertex of lower rank that each went into; -1 for rank 0.
    error : (n,) float64
        Estimate of the surface error once the vertex is gone, growing with falling rank: the root
        of the largest mean square distance to the planes of a vertex so far.
    rounds : tuple of (int, int, float)
        Living vertices, collapses and largest cost of every round, for the curious.
    """

    rank: Indices
    parent: Indices
    error: Floats
    rounds: tuple[tuple[int, int, float], ...]


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


def eliminate(
    points: Floats, faces: NDArray[np.integer], links: tuple[Ints, Ints], weights: Weights
) -> Generator[float, None, Elimination]:
    """Yield the share of vertices gone, and return the order of elimination.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 3) int
        Triangles without repeated corners; non-manifold ones, and ones of no area, are welcome.
    links : (int32, int32)
        Further edges, along which vertices may go that no face uses.
    weights : Weights

    Notes
    -----
    About O(n log n): the rounds shrink geometrically. Some 700 to 850 bytes a vertex at the peak.

    While the surface is a manifold it stays one, of the same topology: the link condition of Dey
    et al. holds for every collapse. Where only forbidden collapses are left, they are done all the
    same, so that every component ends in one vertex.
    """
    state = _State(points, faces, links, weights)
    count = len(points)
    removed: list[Indices] = []
    costs: list[Floats] = []
    rounds: list[tuple[int, int, float]] = []
    relaxed, since_retry = False, 1
    while True:
        candidates, cheapest = state.candidates()
        exhausted = not len(candidates) or (state.widening > IN_VAIN and not relaxed)
        if exhausted or since_retry > RETRY * state.living:
            if not len(candidates) and relaxed:
                break
            # All pairs have failed, and hardly one has gone: only forbidden ones are left.
            if since_retry <= STALL * state.living:
                relaxed = True
                state.patience[:] = np.minimum(state.patience, PENALTY)
            since_retry = 0
            state.widening = 1
            if not state.forget_failures():
                break
            continue
        gone, cost = state.collapse(candidates, cheapest, relaxed=relaxed)
        if len(gone):
            since_retry += len(gone)
            removed.append(gone)
            costs.append(cost)
            rounds.append((state.living, len(gone), float(cost[-1])))
        yield 1.0 - state.living / max(count, 1)
    return _order(state, removed, costs, rounds)


def _order(
    state: _State, removed: list[Indices], costs: list[Floats], rounds: list[tuple[int, int, float]]
) -> Elimination:
    """Number the vertices from the last survivor to the first removed."""
    count = len(state.parent)
    nothing = [np.empty(0, dtype=np.intp)]
    gone = np.concatenate(removed or nothing)
    alive = np.ones(count, dtype=bool)
    alive[gone] = False
    survivors = np.flatnonzero(alive)
    # Those that stand for most go last.
    weight = np.zeros(count)
    weight[state.names] = np.where(state.protected, np.inf, state.heaped)
    weight = weight[survivors]
    survivors = survivors[np.argsort(-weight, kind="stable")]
    rank = np.empty(count, dtype=np.intp)
    order = np.concatenate([survivors, gone[::-1]])
    rank[order] = np.arange(count)
    error = np.zeros(count)
    if len(gone):
        error[gone] = np.sqrt(np.maximum.accumulate(state.mean_square[gone]))
        error[survivors] = error[gone[-1]]
    parent = state.parent
    parent[survivors] = np.where(survivors == order[:1], -1, order[:1])
    return Elimination(rank, parent, error, tuple(rounds))


class _State:
    """The surface that is left, and what each further collapse would cost.

    Edges are kept once, as `a` and `b`, with the costs of a going into b and of b into a; a dead
    edge has equal ends.
    """

    def __init__(
        self, points: Floats, faces: NDArray[np.integer], links: tuple[Ints, Ints], weights: Weights
    ) -> None:
        count = len(points)
        edges = find_edges(faces, count)
        self.points, self.products = points, monomials(points)
        self.quadric, self.area = vertex_quadrics(points, faces, edges, weights.border)
        mean_area = self.area.mean() if self.area.any() else 1.0
        if weights.evenness.any():
            spread = weights.evenness * np.maximum(self.area, mean_area) / 3.0
            self.quadric += point_quadrics(points, spread)
        self.area = np.maximum(self.area, 1e-3 * mean_area)
        self.factor, self.protected = weights.factor, weights.protected
        self.patience = np.where(weights.lenient, 1.0, np.inf)
        self.own = np.zeros(count)
        self.heaped = np.ones(count)
        self.mean_square = np.zeros(count)
        self.parent = np.full(count, -1, dtype=np.intp)
        self.faces = [np.ascontiguousarray(corner, dtype=np.int32) for corner in faces.T]
        self.a = np.concatenate([edges.low, links[0]])
        self.b = np.concatenate([edges.high, links[1]])
        self.degree = np.bincount(self.a, minlength=count) + np.bincount(self.b, minlength=count)
        self.a_to_b, self.b_to_a = self.costs(self.a, self.b), self.costs(self.b, self.a)
        self.tried_a, self.tried_b = np.zeros(len(self.a), bool), np.zeros(len(self.a), bool)
        self.names = np.arange(count)
        self.widening = 1
        self.living, self.dead_edges = count, 0

    def costs(self, going: Ints, staying: Ints) -> Floats:
        """Return the cost of one vertex going into another.

        The error of both quadrics at the vertex that stays, by the root of the area gone into: the
        integral of the squared distance would let large flat parts sink, its mean small features.
        """
        result = np.empty(len(going))
        for start in range(0, len(going), COST_BLOCK):
            i, j = going[start : start + COST_BLOCK], staying[start : start + COST_BLOCK]
            error = np.einsum("ek,ek->e", self.quadric[i], self.products[j])
            cost = np.maximum(error + self.own[j], 0.0) * self.factor[i]
            cost /= np.sqrt(self.area[i])
            cost[self.protected[i]] = np.inf
            result[start : start + COST_BLOCK] = cost
        return result

    def candidates(self) -> tuple[Indices, Floats]:
        """Return the cheapest vertices, and the least cost of every vertex."""
        cheapest = np.full(len(self.points), np.inf)
        np.minimum.at(cheapest, self.a, self.a_to_b)
        np.minimum.at(cheapest, self.b, self.b_to_a)
        finite = cheapest[np.isfinite(cheapest)]
        if not len(finite):
            return np.empty(0, dtype=np.intp), cheapest
        share = (SHARE if self.living > FEW else SHARE_OF_FEW) * self.widening
        place = min(len(finite) - 1, int(share * self.living))
        threshold = np.partition(finite, place)[place]
        return np.flatnonzero(cheapest <= threshold), cheapest

    def forget_failures(self) -> bool:
        """Work out anew the costs of pairs that were put aside; return whether any edge is left."""
        alive = self.a != self.b
        for going, staying, cost in (
            (self.a, self.b, self.a_to_b),
            (self.b, self.a, self.b_to_a),
        ):
            aside = np.flatnonzero(np.isinf(cost) & alive)
            cost[aside] = self.costs(going[aside], staying[aside])
        return bool((np.isfinite(self.a_to_b) | np.isfinite(self.b_to_a)).any())

    def collapse(
        self, candidates: Indices, cheapest: Floats, *, relaxed: bool
    ) -> tuple[Indices, Floats]:
        """Do one round, and return the vertices gone, cheapest first, and their costs."""
        target = self._targets(candidates, cheapest)
        chosen = self._independent(candidates, cheapest)
        chosen = chosen[np.argsort(cheapest[chosen], kind="stable")]
        stars = Stars.find(chosen, target[chosen], self.faces, self.a, self.b, len(self.points))
        good = allowed(stars, self.points, self.degree)
        if relaxed and self.widening > 1:
            good[:] = True
        else:
            good |= self._put_aside(stars, ~good)
        good &= ~clashing(stars, good)
        self.widening = 1 if good.any() else 2 * self.widening
        gone, into = stars.going[good], stars.staying[good]
        if len(gone):
            self.parent[self.names[gone]] = self.names[into]
            self.living -= len(gone)
            self._rewire(stars, good)
            self._merge(gone, into)
        named = self.names[gone]
        if self.living < COMPACT * len(self.points):
            self._compact()
        return named, cheapest[gone]

    def _targets(self, candidates: Indices, cheapest: Floats) -> Ints:
        """Return the cheapest vertex to go into, for each candidate."""
        target = np.zeros(len(self.points), dtype=np.int32)
        limit = cheapest[candidates].max()
        for going, staying, cost in (
            (self.a, self.b, self.a_to_b),
            (self.b, self.a, self.b_to_a),
        ):
            best = np.flatnonzero(cost <= limit)
            best = best[cost[best] == cheapest[going[best]]]
            target[going[best]] = staying[best]
        return target

    def _independent(self, candidates: Indices, cheapest: Floats) -> Indices:
        """Return candidates of which no two are neighbours; the cheaper of two is preferred."""
        candidate = np.zeros(len(self.points), dtype=bool)
        candidate[candidates] = True
        between = np.flatnonzero(candidate[self.a] & candidate[self.b] & (self.a != self.b))
        a, b = self.a[between], self.b[between]
        dearer = (cheapest[a] > cheapest[b]) | ((cheapest[a] == cheapest[b]) & (a > b))
        loser = np.where(dearer, a, b)
        winner = a + b - loser
        first = candidate.copy()
        first[loser] = False
        # A second helping: those that lost only to losers.
        candidate[first] = False
        candidate[loser[first[winner]]] = False
        rest = candidate[loser] & candidate[winner]
        candidate[loser[rest]] = False
        return np.flatnonzero(first | candidate)

    def _compact(self) -> None:
        """Renumber the living, so that rounds take no time for the dead."""
        alive = np.flatnonzero(self.parent[self.names] < 0)
        number = np.zeros(len(self.points), dtype=np.int32)
        number[alive] = np.arange(len(alive))
        edge = self.a != self.b
        self.a, self.b = number[self.a[edge]], number[self.b[edge]]
        self.a_to_b, self.b_to_a = self.a_to_b[edge], self.b_to_a[edge]
        self.tried_a, self.tried_b = self.tried_a[edge], self.tried_b[edge]
        self.dead_edges = 0
        self.faces = [number[corner] for corner in self.faces]
        for name in PER_VERTEX:
            setattr(self, name, getattr(self, name)[alive])

    def _put_aside(self, stars: Stars, failed: Mask) -> Mask:
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
            forgiven[owner[side]] = tried[one]
            with np.errstate(invalid="ignore"):
                cost[one] *= self.patience[going[side]]
            cost[one[np.isnan(cost[one])]] = np.inf
            tried[one] = np.isfinite(cost[one])
        return forgiven

    def _rewire(self, stars: Stars, good: Mask) -> None:
        """Drop the faces and edges that vanish and hang the others on the vertices that stay."""
        moving = good[stars.face_owner] & ~stars.vanishing
        face, old = stars.faces[moving], stars.going[stars.face_owner[moving]]
        new = stars.staying[stars.face_owner[moving]]
        for corner in self.faces:
            here = corner[face] == old
            corner[face[here]] = new[here]
        keep = np.ones(len(self.faces[0]), dtype=bool)
        keep[stars.faces[good[stars.face_owner] & stars.vanishing]] = False
        self.faces = [corner[keep] for corner in self.faces]

        owner, other, target = stars.edge_owner, stars.edge_other, stars.edge_target
        mine = good[owner]
        between = other == target
        shared = mine & stars.common & ~between
        moved = mine & ~stars.common & ~between
        np.subtract.at(self.degree, other[shared], 1)
        np.subtract.at(self.degree, target[mine & between], 1)
        np.add.at(self.degree, target[moved], 1)
        edge = stars.edges[moved]
        at_a = self.a[edge] == stars.going[owner[moved]]
        self.a[edge[at_a]] = target[moved][at_a]
        self.b[edge[~at_a]] = target[moved][~at_a]
        dead = stars.edges[mine & (stars.common | between)]
        self.a[dead] = self.b[dead] = 0
        self.a_to_b[dead] = self.b_to_a[dead] = np.inf
        self.dead_edges += len(dead)

    def _merge(self, gone: Indices, into: Ints) -> None:
        """Add up quadrics on the vertices that stay, and renew the costs round them."""
        for total in (self.area, self.heaped):
            np.add.at(total, into, total[gone])
        changed, place = np.unique(into, return_inverse=True)
        for k in range(10):
            self.quadric[changed, k] += np.bincount(place, self.quadric[gone, k], len(changed))
        self.own[changed] = np.einsum(
            "nk,nk->n", self.quadric[changed], self.products[changed]
        ).clip(min=0.0)
        self.mean_square[self.names[gone]] = (self.own / self.area)[into]
        if self.dead_edges > 0.1 * len(self.a):
            alive = self.a != self.b
            self.a, self.b = self.a[alive], self.b[alive]
            self.a_to_b, self.b_to_a = self.a_to_b[alive], self.b_to_a[alive]
            self.tried_a, self.tried_b = self.tried_a[alive], self.tried_b[alive]
            self.dead_edges = 0
        dirty = np.zeros(len(self.points), dtype=bool)
        dirty[changed] = True
        edge = np.flatnonzero((dirty[self.a] | dirty[self.b]) & (self.a != self.b))
        a, b = self.a[edge], self.b[edge]
        self.a_to_b[edge], self.b_to_a[edge] = self.costs(a, b), self.costs(b, a)
        self.tried_a[edge] = self.tried_b[edge] = False
