# SPDX-License-Identifier: GPL-3.0-or-later
"""One round of the elimination after another: candidates, legal collapses, and parts that go."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from .costs import Costs
from .half_edges import HalfEdges
from .legality import (
    BROKEN_SEAM,
    FORBIDDEN,
    FORBIDDEN_AT_LAST,
    GUESSED,
    conflicting,
    leaves_plane,
    legal,
    would_break_seam,
)
from .one_rings import Corners, OneRings
from .parts import Parts, faces_without
from .thresholds import Thresholds
from .wedge_collapses import WedgeCollapses

# The schedule of the rounds. Shares are of the living vertices where nothing else is said.
CANDIDATES = 0.18
"""Share that a round considers; more runs ahead of the order of costs."""
SMALL, CANDIDATES_IF_SMALL = 2000, 0.04
"""Below so many vertices a smaller share keeps closer to the order; the rounds cost little."""
MAX_CANDIDATE_FACTOR = 2**24
"""Factor on the share, doubled by every round in vain, beyond which the rounds have stalled: every
vertex has failed into its 20 or so cheapest neighbours. Fans of hundreds round a non-manifold edge
would take as many rounds."""
AHEAD = 2.0
"""Factor on the least cost of a collapse up to which parts go in the same round: in a mesh of many
small parts the larger ones are a small share, of which a round collapses some only."""
RETRY = 0.25
"""Share to go before collapses that failed are tried again. Those next to a collapse are tried
again at once; a collapse fails anew where nothing round it has changed."""
STALL = 0.01
"""Share that must go before all collapses have failed again; else forbidden ones are done."""


@dataclass(eq=False)
class State:
    """The surface that is left, and what has happened to it.

    Living vertices, and dead ones until the next `compact`, are numbered from 0. Arrays over the
    whole surface are `parent`, whom each vertex went into, and `mean_square`, the error then.
    """

    costs: Costs
    half_edges: HalfEdges
    corners: Corners
    degree: Integers
    guessed: Mask
    vertex_id: Indices
    """Numbers in the whole surface."""
    cluster_size: Floats
    """Number of vertices that each stands for, itself included."""
    parent: Indices
    mean_square: Floats
    living: int
    wedges: WedgeCollapses | None = None
    charts_hold: bool = False
    """Whether collapses that tear charts are put off."""
    candidate_factor: int = 1
    relaxed: bool = False
    """Whether only forbidden collapses are left, and are done."""
    parts: Parts | None = None
    gone_parts: list[tuple[Indices, Ints]] = field(default_factory=list)
    """Vertices of the whole surface that went with their parts, and these."""
    keep_topology: bool = False
    """Whether the end is where only forbidden collapses are left."""
    topology_count: int | None = None
    """Vertices left then."""
    since_retry: int = 1
    """Vertices removed since failed collapses were last tried again."""
    removed: list[Indices] = field(default_factory=list)
    """The vertices of the whole surface that each round removed, cheapest first."""
    rounds: list[tuple[int, int, float]] = field(default_factory=list)
    thresholds: Thresholds | None = None
    is_tile: bool = False
    """Whether the surface is a part of one that may have many more vertices."""
    steps: list[int] = field(default_factory=list)
    """Step of the threshold of each round."""
    costs_then: list[Floats] = field(default_factory=list)
    """Costs of what each round removed."""
    on_plane: Mask | None = None
    """Vertices on the plane of symmetry where the surface ends."""

    def find_cheapest(self) -> Floats:
        """Return the cost (n,) of every vertex's cheapest collapse; infinite for none."""
        least = self.half_edges.find_cheapest()
        if self.parts is not None and self.relaxed:
            least = self.parts.spare_largest(least)
        return least

    def pick_candidates(self, least: Floats) -> tuple[Mask, Mask]:
        """Return the cheapest vertices (n,), and those whose parts go whole.

        The costs `least` (n,) of the latter become the prices of their parts.
        """
        leaving = np.zeros(len(least), dtype=bool)
        if self.parts is not None:
            price = self.parts.prices(least)
            leaving = np.isfinite(price) & (self.parent[self.vertex_id] < 0)
            np.copyto(least, price, where=leaving)
        finite = least[np.isfinite(least)]
        if not len(finite):
            return np.zeros(len(least), dtype=bool), leaving
        if self.thresholds is not None and (self.is_tile or self.living > SMALL):
            cheap = self.thresholds.candidates(least)
            return cheap & ~leaving, cheap & leaving
        share = CANDIDATES if self.living > SMALL else CANDIDATES_IF_SMALL
        place = min(len(finite) - 1, int(share * self.candidate_factor * self.living))
        cheap = np.asarray(least <= np.partition(finite, place)[place])
        soon = least <= AHEAD * least[~leaving].min(initial=np.inf)
        return cheap & ~leaving, cheap & leaving & soon

    def must_retry(self, candidates: Mask) -> bool:
        """Return whether to try again what has failed, for want of candidates or after a while."""
        stalled = self.candidate_factor > MAX_CANDIDATE_FACTOR and not self.relaxed
        enough = self.since_retry > RETRY * self.living
        return stalled or enough or not candidates.any()

    def retry(self, candidates: Mask) -> bool:
        """Allow what has failed to be tried again; return whether anything is left to try."""
        if self.relaxed and not candidates.any():
            return False
        # All collapses have failed, and hardly one vertex has gone: only forbidden ones are left.
        if self.keep_topology and self.since_retry == 0:
            return False
        if not self.keep_topology and self.since_retry <= STALL * self.living:
            self.relaxed = True
            self.topology_count = self.topology_count or self.living
            self.charts_hold = False
            self.half_edges.drop_seams()
        self.since_retry = 0
        self.candidate_factor = 1
        return self.half_edges.forget_failures(self.costs)

    def select_legal(self, rings: OneRings) -> Mask:
        """Return which collapses (s,) to perform, and make those dearer that have failed."""
        good = legal(rings, self.costs.points, self.degree)
        if self.on_plane is not None:
            good &= ~leaves_plane(rings, self.on_plane)
        broken = would_break_seam(rings, self.half_edges.seam)
        if self.wedges is not None and self.charts_hold:
            broken |= self.wedges.tearing(rings, self.vertex_id)
        broken &= good
        good &= ~broken
        if self.relaxed and self.candidate_factor > 1:
            good[:] = True
        else:
            factor = np.where(broken, BROKEN_SEAM, self._failure_factors(rings.removed))
            forced = ~good & self.half_edges.failed[rings.collapses] & np.isfinite(factor)
            self.half_edges.penalize(rings.collapses[~good], factor[~good])
            good |= forced
        return good & ~conflicting(rings, good)

    def _failure_factors(self, vertices: Integers) -> Floats:
        """Return the factors on the costs of failed collapses, by the vertices they remove."""
        forbidden = FORBIDDEN_AT_LAST if self.relaxed else FORBIDDEN
        return np.where(self.guessed[vertices], GUESSED, forbidden)

    def perform(self, rings: OneRings, performed: Mask, least: Floats, leaving: Mask) -> None:
        """Do the collapses that are chosen, let parts go, and work out the costs round them."""
        leaves = np.flatnonzero(leaving)
        done = len(leaves) > 0 or bool(performed.any())
        # Among many small parts wait until all that is cheaper has failed: their prices come then.
        patient = self.parts is not None and self.living <= SMALL and not self.relaxed
        self.candidate_factor = 1 if done or patient else 2 * self.candidate_factor
        if not done:
            return
        removed, kept = rings.removed[performed], rings.kept[performed]
        self._count_removed(removed, leaves, least)
        if len(removed):
            self._collapse(rings, performed, removed, kept)
        if len(leaves):
            self._remove_parts(leaves, leaving)

    def _count_removed(self, removed: Ints, leaves: Indices, least: Floats) -> None:
        """Note what a round removes: collapsed vertices and, part by part, those of parts."""
        together = removed.astype(np.intp)
        if self.parts is not None:
            by_part = np.argsort(self.parts.label[leaves], kind="stable")
            together = np.concatenate([leaves[by_part], together])
            together = together[np.argsort(least[together], kind="stable")]
            self.parts.remove(together)
        self.removed.append(self.vertex_id[together])
        if self.thresholds is not None:
            self.costs_then.append(least[together])
            self.steps.append(self.thresholds.step)
        self.living -= len(together)
        self.since_retry += len(together)
        self.rounds.append((self.living, len(together), float(least[together[-1]])))

    def _remove_parts(self, leaves: Indices, leaving: Mask) -> None:
        """Let the vertices of whole parts go, with all their faces and edges."""
        assert self.parts is not None
        vertices, part = self.vertex_id[leaves], self.parts.label[leaves]
        self.gone_parts.append((vertices, part))
        self.parent[vertices] = vertices
        self.mean_square[vertices] = self.parts.move[part]
        left = faces_without(leaving, self.corners)
        self.corners = [corner[left] for corner in self.corners]
        if self.wedges is not None:
            self.wedges.corners = [wedge[left] for wedge in self.wedges.corners]
        self.half_edges.remove(leaving)

    def _collapse(self, rings: OneRings, performed: Mask, removed: Ints, kept: Ints) -> None:
        """Do the collapses that are chosen."""
        vertices = self.vertex_id[removed]
        if self.wedges is not None:
            self.wedges.perform(rings, performed, self.vertex_id)
        self._rewire_faces(rings, performed)
        self.half_edges.rewire(rings, performed, self.degree)
        np.add.at(self.cluster_size, kept, self.cluster_size[removed])
        changed = self.costs.merge(removed, kept)
        self.parent[vertices] = self.vertex_id[kept]
        self.mean_square[vertices] = self.costs.mean_square(kept)
        self.half_edges.renew(changed, self.costs)

    def _rewire_faces(self, rings: OneRings, performed: Mask) -> None:
        """Drop the faces that vanish, and hang the others of the removed on the kept."""
        mine = performed[rings.face_owner]
        moving = mine & ~rings.vanishing
        face, owner = rings.faces[moving], rings.face_owner[moving]
        old, new = rings.removed[owner], rings.kept[owner]
        for corner in self.corners:
            here = corner[face] == old
            corner[face[here]] = new[here]
        left = np.ones(len(self.corners[0]), dtype=bool)
        left[rings.faces[mine & rings.vanishing]] = False
        self.corners = [corner[left] for corner in self.corners]

    def compact(self) -> None:
        """Renumber the living, so that rounds take no time for the dead."""
        alive = np.flatnonzero(self.parent[self.vertex_id] < 0)
        number = np.zeros(len(self.vertex_id), dtype=np.int32)
        number[alive] = np.arange(len(alive))
        self.half_edges.renumber(number, alive)
        self.corners = [number.take(corner) for corner in self.corners]
        self.costs.compact(alive)
        self.vertex_id = self.vertex_id.take(alive)
        self.cluster_size = self.cluster_size.take(alive)
        self.degree = self.degree.take(alive)
        self.guessed = self.guessed.take(alive)
        if self.on_plane is not None:
            self.on_plane = self.on_plane.take(alive)
        if self.parts is not None:
            self.parts.compact(alive)
