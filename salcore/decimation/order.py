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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .collapse import Stars, allowed, clashing
from .costs import Costs, Weights
from .geometry import Floats, Indices
from .pairs import OFF_SEAM, Pairs
from .progress import Rests, Steps
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
MOST_SEAMS = 0.5
"""Share of the edges above which there are no seams: in a texture of single triangles every edge is
one, and no line is left to keep."""
COMPACT = 0.6
"""Share of the vertices still living below which the rest is renumbered."""


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


def eliminate(
    points: Floats,
    faces: NDArray[np.integer],
    links: tuple[Ints, Ints],
    weights: Weights,
    workers: int = 0,
    seams: NDArray[np.integer] | None = None,
) -> Steps[Elimination]:
    """Yield the share of vertices gone, and return the order of elimination.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 3) int
        Triangles without repeated corners; non-manifold ones, and ones of no area, are welcome.
    links : (int32, int32)
        Further edges, along which vertices may go that no face uses.
    weights : Weights
    workers : int
        Threads; 0 takes one per processor.
    seams : (s, 2) int, optional
        Edges that stay as lines, such as those where charts of a texture meet: their vertices go
        along them only, and where they meet or end, last.

    Notes
    -----
    About O(n log n): the rounds shrink geometrically. Some 700 to 850 bytes a vertex at the peak.

    While the surface is a manifold it stays one, of the same topology: the link condition of Dey
    et al. holds for every collapse. Where only forbidden collapses are left, they are done all the
    same, so that every component ends in one vertex.
    """
    lines = np.empty((0, 2), dtype=np.int32) if seams is None else seams
    state = yield from _State.start(points, faces, links, lines, weights, workers)
    count = len(points)
    removed: list[Indices] = []
    costs: list[Floats] = []
    rounds: list[tuple[int, int, float]] = []
    relaxed, since_retry = False, 1
    while True:
        candidates, cheapest = yield from state.candidates()
        exhausted = not len(candidates) or (state.widening > IN_VAIN and not relaxed)
        if exhausted or since_retry > RETRY * state.living:
            if not len(candidates) and relaxed:
                break
            # All pairs have failed, and hardly one has gone: only forbidden ones are left.
            if since_retry <= STALL * state.living:
                relaxed = True
                state.pairs.drop_seams()
                state.patience[:] = np.minimum(state.patience, PENALTY)
            since_retry = 0
            state.widening = 1
            if not (yield from state.pairs.forget_failures(state.costs)):
                break
            continue
        gone, cost = yield from state.collapse(candidates, cheapest, relaxed=relaxed)
        if len(gone):
            since_retry += len(gone)
            removed.append(gone)
            costs.append(cost)
            rounds.append((state.living, len(gone), float(cost[-1])))
        yield 1.0 - state.living / max(count, 1)
    return (yield from _order(state, removed, costs, rounds))


def _order(
    state: _State, removed: list[Indices], costs: list[Floats], rounds: list[tuple[int, int, float]]
) -> Rests[Elimination]:
    """Number the vertices from the last survivor to the first removed."""
    count = len(state.parent)
    nothing = [np.empty(0, dtype=np.intp)]
    gone = np.concatenate(removed or nothing)
    alive = np.ones(count, dtype=bool)
    alive[gone] = False
    survivors = np.flatnonzero(alive)
    # Those that stand for most go last.
    weight = np.zeros(count)
    weight[state.names] = np.where(state.costs.protected, np.inf, state.heaped)
    weight = weight[survivors]
    yield
    survivors = survivors[np.argsort(-weight, kind="stable")]
    yield
    rank = np.empty(count, dtype=np.intp)
    order = np.concatenate([survivors, gone[::-1]])
    rank[order] = np.arange(count)
    yield
    error = np.zeros(count)
    if len(gone):
        error[gone] = np.sqrt(np.maximum.accumulate(state.mean_square[gone]))
        error[survivors] = error[gone[-1]]
    parent = state.parent
    parent[survivors] = np.where(survivors == order[:1], -1, order[:1])
    return Elimination(rank, parent, error, tuple(rounds))


@dataclass(eq=False)
class _State:
    """The surface that is left.

    Living vertices, and dead ones until the next `_compact`, are numbered from 0; `names` are their
    numbers in the whole surface.
    """

    costs: Costs
    pairs: Pairs
    faces: list[Ints]
    """The first, second and third corners of the faces."""
    degree: Indices
    patience: Floats
    """Factor on the cost of a pair that has failed."""
    names: Indices
    heaped: Floats
    """Number of vertices that each stands for."""
    parent: Indices
    mean_square: Floats
    """Of every vertex of the whole surface: whom it went into, and the error then."""
    living: int
    widening: int = 1

    @classmethod
    def start(
        cls,
        points: Floats,
        faces: NDArray[np.integer],
        links: tuple[Ints, Ints],
        seams: NDArray[np.integer],
        weights: Weights,
        workers: int,
    ) -> Rests[_State]:
        """Return the whole surface, with rests."""
        count = len(points)
        edges = yield from find_edges(faces, count, workers)
        seam = edges.among(seams, count)
        if np.count_nonzero(seam) > MOST_SEAMS * len(seam):
            seam[:] = False
        costs = yield from Costs.start(points, faces, edges, seam, weights, workers)
        a = np.concatenate([edges.low, links[0]])
        b = np.concatenate([edges.high, links[1]])
        yield
        seam = np.concatenate([seam, np.zeros(len(links[0]), dtype=bool)])
        pairs = yield from Pairs.start(a, b, seam, costs)
        corners = [np.ascontiguousarray(corner, dtype=np.int32) for corner in faces.T]
        yield
        return cls(
            costs,
            pairs,
            corners,
            degree=np.bincount(a, minlength=count) + np.bincount(b, minlength=count),
            patience=np.where(weights.lenient, 1.0, np.inf),
            names=np.arange(count),
            heaped=np.ones(count),
            parent=np.full(count, -1, dtype=np.intp),
            mean_square=np.zeros(count),
            living=count,
        )

    def candidates(self) -> Rests[tuple[Indices, Floats]]:
        """Return the cheapest vertices, and the least cost of every vertex."""
        cheapest = yield from self.pairs.cheapest(len(self.names))
        finite = cheapest[np.isfinite(cheapest)]
        if not len(finite):
            return np.empty(0, dtype=np.intp), cheapest
        share = (SHARE if self.living > FEW else SHARE_OF_FEW) * self.widening
        place = min(len(finite) - 1, int(share * self.living))
        threshold = np.partition(finite, place)[place]
        yield
        return np.flatnonzero(cheapest <= threshold), cheapest

    def collapse(
        self, candidates: Indices, cheapest: Floats, *, relaxed: bool
    ) -> Rests[tuple[Indices, Floats]]:
        """Do one round, and return the vertices gone, cheapest first, and their costs."""
        costs, pairs = self.costs, self.pairs
        target = yield from pairs.targets(candidates, cheapest)
        chosen = yield from pairs.independent(candidates, cheapest)
        yield
        chosen = chosen[np.argsort(cheapest[chosen], kind="stable")]
        yield
        stars = yield from Stars.find(
            chosen, target[chosen], self.faces, pairs.a, pairs.b, len(self.names)
        )
        good = yield from allowed(stars, costs.points, self.degree, costs.workers)
        broken = good & pairs.break_seams(stars)
        good &= ~broken
        if relaxed and self.widening > 1:
            good[:] = True
        else:
            good |= pairs.put_aside(stars, ~good & ~broken, self.patience)
            if broken.any():
                good |= pairs.put_aside(stars, broken, np.full(len(self.names), OFF_SEAM))
        yield
        good &= ~(yield from clashing(stars, good))
        self.widening = 1 if good.any() else 2 * self.widening
        gone, into = stars.going[good], stars.staying[good]
        named = self.names[gone]
        if len(gone):
            self.parent[named] = self.names[into]
            self.living -= len(gone)
            yield from self._rewire(stars, good)
            yield from pairs.rewire(stars, good, self.degree)
            np.add.at(self.heaped, into, self.heaped[gone])
            changed, self.mean_square[named] = yield from costs.merge(gone, into)
            yield from pairs.renew(changed, costs)
        if self.living < COMPACT * len(self.names):
            yield from self._compact()
        return named, cheapest[gone]

    def _rewire(self, stars: Stars, good: Mask) -> Rests[None]:
        """Drop the faces that vanish and hang the others on the vertices that stay."""
        moving = good[stars.face_owner] & ~stars.vanishing
        face, old = stars.faces[moving], stars.going[stars.face_owner[moving]]
        new = stars.staying[stars.face_owner[moving]]
        yield
        for corner in self.faces:
            here = corner[face] == old
            corner[face[here]] = new[here]
            yield
        keep = np.ones(len(self.faces[0]), dtype=bool)
        keep[stars.faces[good[stars.face_owner] & stars.vanishing]] = False
        for k in range(3):
            self.faces[k] = self.faces[k][keep]
            yield

    def _compact(self) -> Rests[None]:
        """Renumber the living, so that rounds take no time for the dead."""
        alive = np.flatnonzero(self.parent[self.names] < 0)
        number = np.zeros(len(self.names), dtype=np.int32)
        number[alive] = np.arange(len(alive))
        yield from self.pairs.drop_dead()
        self.pairs.a, self.pairs.b = number[self.pairs.a], number[self.pairs.b]
        self.pairs.seams = self.pairs.seams[alive]
        yield
        for k in range(3):
            self.faces[k] = number[self.faces[k]]
            yield
        yield from self.costs.keep(alive)
        for name in ("names", "heaped", "degree", "patience"):
            setattr(self, name, getattr(self, name)[alive])
        yield
