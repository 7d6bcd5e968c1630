# SPDX-License-Identifier: GPL-3.0-or-later
"""Edge flips: two faces at an edge become the two at the other diagonal of their quadrilateral.

Which edges may be flipped, what a flip gains, and which flips can be done together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.edges import contains, edge_key, find_edges
from ..arrays.rows import row_entries
from ..arrays.types import Floats, Indices, Keys, Mask
from ..arrays.vectors import cross, dot
from .legality import turned_over
from .nearest_faces import Assignment, Triangles, product
from .samples import Samples

EDGE_BLOCK = 1 << 10
"""Edges whose samples are looked at together: temporaries about the size of a cache."""
HELPINGS = 3
"""Times that further flips are picked among those that conflict with none picked so far."""
FOLD_COSINE = -0.2
"""Cosine between the normals of faces at an edge below which they fold back on each other."""


@dataclass(frozen=True, eq=False)
class Quads:
    """Edges between two faces, each with the quadrilateral that these make.

    Attributes
    ----------
    corners : (4, e) intp
        The edge runs from the first to the second vertex in the left face, whose other corner is
        the third, and back in the right face, whose other corner is the fourth.
    left, right : (e,) intp
        The faces' sides at the edge: from corner c of face f to the next, ``3 f + c``.
    """

    corners: Indices
    left: Indices
    right: Indices

    def take(self, chosen: Indices | Mask) -> Quads:
        """Return some of the quads."""
        return Quads(self.corners[:, chosen], self.left[chosen], self.right[chosen])

    def flipped(self) -> tuple[Indices, Indices]:
        """Return the faces (e, 3) that a flip puts in place of the left and of the right one."""
        a, b, c, d = self.corners
        return np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)


@dataclass(eq=False)
class FlipMesh:
    """Faces whose edges can be flipped.

    Attributes
    ----------
    faces : (k, 3) intp
    corners : (k, 3) intp
        What belongs to the corners of the faces; flips move it along.
    twins : (3 k,) intp
        The side at the same edge of the face beyond it; -1 where the edge must not be flipped.
    keys : (e,) int64
        Ascending keys of all edges that are there, or were before they were flipped.
    count : int
        Number of vertices.
    apart : (n,) bool or None
        Vertices of which no two may be joined.
    """

    faces: Indices
    corners: Indices
    twins: Indices
    keys: Keys
    count: int
    apart: Mask | None = None

    @classmethod
    def of(
        cls,
        faces: Indices,
        corners: Indices,
        count: int,
        fixed: Keys,
        apart: Mask | None = None,
    ) -> FlipMesh:
        """Return a copy of faces whose edges may be flipped.

        But for those of one face, of more than two, of two that do not wind alike, and `fixed`
        ones, whose keys ascend.
        """
        edges = find_edges(faces, count)
        keys = edge_key(edges.low, edges.high, count)
        first = np.cumsum(edges.uses) - edges.uses
        inner = first[(edges.uses == 2) & ~contains(fixed, keys)]
        one, other = edges.sides[inner], edges.sides[inner + 1]
        alike = edges.forward[one] != edges.forward[other]
        one, other = (3 * (s % len(faces)) + s // len(faces) for s in (one[alike], other[alike]))
        twins = np.full(faces.size, -1)
        twins[one], twins[other] = other, one
        return cls(faces.copy(), corners.copy(), twins, keys, count, apart)

    def forget(self) -> None:
        """Let edges that were flipped away come back; within one series of flips they do not."""
        edges = find_edges(self.faces, self.count)
        self.keys = edge_key(edges.low, edges.high, self.count)

    def sides_of(self, chosen: Mask) -> Indices:
        """Return one side (e,) of each edge of the chosen faces (k,) that may be flipped."""
        side = (3 * np.flatnonzero(chosen)[:, None] + np.arange(3)).ravel()
        twin = self.twins[side]
        one: Indices = side[(twin >= 0) & ((side < twin) | ~chosen[twin // 3])]
        return one

    def quads(self, left: Indices) -> Quads:
        """Return the edges at sides (e,)."""
        right = self.twins[left]
        flat = self.faces.ravel()
        sides = left, following(left), following(left, 2), following(right, 2)
        return Quads(np.stack([flat[s] for s in sides]), left, right)

    def legal(self, quads: Quads, points: Floats) -> Mask:
        """Return which flips (e,) make a new edge, and neither turn a face over nor make a fold."""
        _, _, c, d = quads.corners
        good = (c != d) & ~contains(self.keys, edge_key(c, d, self.count))
        if self.apart is not None:
            good &= ~(self.apart[c] & self.apart[d])
        rows = np.flatnonzero(good)

        def check(start: int, stop: int) -> None:
            row = rows[start:stop]
            p, q, r, s = (points.take(corner[row], axis=0) for corner in quads.corners)
            one, other = cross(s - p, r - p), cross(q - s, r - s)
            outward = one + other  # that of the old faces, too
            bad = turned_over(outward, one) | turned_over(outward, other)
            old = cosines(cross(q - p, r - p), cross(s - p, q - p))
            good[row] = ~(bad | folds(old, cosines(one, other)))

        run_blocks(check, len(rows))
        return np.asarray(good)

    def flip(self, quads: Quads) -> None:
        """Flip edges, of which no two quads share a vertex."""
        one, other = 3 * (quads.left // 3), 3 * (quads.right // 3)
        ends = [following(side, turn) for side in (quads.left, quads.right) for turn in (1, 2)]
        to_third, from_third, to_fourth, from_fourth = (self.twins[end] for end in ends)
        flat = self.corners.ravel()
        a, c = flat[quads.left], flat[following(quads.left, 2)]
        b, d = flat[quads.right], flat[following(quads.right, 2)]
        new_twins = [
            (one, to_fourth), (one + 1, other + 2), (one + 2, from_third),
            (other, from_fourth), (other + 1, to_third), (other + 2, one + 1),
        ]  # fmt: skip
        for side, twin in new_twins:
            self.twins[side] = twin
            self.twins[twin[twin >= 0]] = side[twin >= 0]
        self.faces[one // 3], self.faces[other // 3] = quads.flipped()
        self.corners[one // 3] = np.stack([a, d, c], axis=1)
        self.corners[other // 3] = np.stack([d, b, c], axis=1)
        new = np.sort(edge_key(quads.corners[2], quads.corners[3], self.count))
        self.keys = np.insert(self.keys, np.searchsorted(self.keys, new), new)


def cosines(first: Floats, second: Floats) -> Floats:
    """Return the cosines (e,) of the angles between vectors (e, 3); zero where one vanishes."""
    lengths = np.sqrt(dot(first, first) * dot(second, second))
    cosine: Floats = np.divide(
        dot(first, second), lengths, out=np.zeros_like(lengths), where=lengths > 0.0
    )
    return cosine


def folds(before: Floats, after: Floats) -> Mask:
    """Return where faces at an edge fold back that did so less, by the cosines (e,) of normals."""
    return np.asarray((after < FOLD_COSINE) & (after < before))


def following(side: Indices, turns: int = 1) -> Indices:
    """Return the side one or two after each, round its face."""
    after: Indices = side + turns
    after[side % 3 + turns > 2] -= 3
    return after


def gains(
    quads: Quads,
    points: Floats,
    samples: Samples,
    at: Assignment,
    stiffness: float,
    flatness: float,
    count: int,
) -> Floats:
    """Return by how much each flip (e,) lowers the energy of the samples of its two faces.

    The energy is the weighted sum of the squared distances, and of the squared differences of
    normals, times the area of the two faces and `stiffness`; less the cosine between the two, times
    their area and `flatness`. `count` is the number of faces.
    """
    order, bounds = at.samples_of(np.concatenate([quads.left, quads.right]) // 3, count)
    result = np.empty(len(quads.left))
    one, other = quads.flipped()

    def measure(start: int, stop: int) -> None:
        edges = stop - start
        faces = np.concatenate([quads.left[start:stop], quads.right[start:stop]]) // 3
        places, ends = row_entries(bounds, faces)
        sample = order[places]
        edge = np.repeat(np.tile(np.arange(edges), 2), np.diff(ends))
        both = Triangles.of(points, np.concatenate([one[start:stop], other[start:stop]]))
        queries = samples.points.take(sample, axis=1)
        square, chosen = nearer_of_two(both, queries, edge, edges)
        normal = samples.normals.take(sample, axis=1)
        turn = product(normal, both.normals, chosen) - at.cosine.take(sample)
        scale = 2.0 * stiffness * both.areas().reshape(2, -1).sum(axis=0)
        gain = at.square.take(sample) - square + scale.take(edge) * turn
        result[start:stop] = np.bincount(edge, samples.weights.take(sample) * gain, edges)

    run_blocks(measure, len(result), size=EDGE_BLOCK)
    weight = flatness * float(samples.weights.sum()) / max(count, 1)
    flatter: Floats = result + weight * flattening(quads, points)
    return flatter


def flattening(quads: Quads, points: Floats) -> Floats:
    """Return the rise of the cosine between the faces of each flip (e,), times their area."""
    p, q, r, s = (points.take(corner, axis=0) for corner in quads.corners)
    left, right = cross(q - p, r - p), cross(s - p, q - p)
    turn = cosines(cross(s - p, r - p), cross(q - s, r - s)) - cosines(left, right)
    return np.asarray(0.5 * (np.sqrt(dot(left, left)) + np.sqrt(dot(right, right))) * turn)


def nearer_of_two(
    both: Triangles, queries: Floats, edge: Indices, edges: int
) -> tuple[Floats, Indices]:
    """Return squared distances to, and numbers of, the nearer of the triangles e and e + edges."""
    square, second = (both.square_distances(queries, edge + k * edges) for k in (0, 1))
    nearer = second < square
    return np.where(nearer, second, square), edge + edges * nearer


def independent(quads: Quads, gain: Floats, count: int) -> Indices:
    """Return flips of which no two share one of `count` vertices, those that gain most first."""
    order = np.argsort(-gain, kind="stable")
    corners = quads.corners[:, order]
    free = np.ones(count, dtype=bool)
    chosen: list[Indices] = []
    left = np.arange(len(order))
    for _ in range(HELPINGS):
        best = np.full(count, len(order))
        for corner in corners[:, left]:
            np.minimum.at(best, corner, left)
        wins = left[(best[corners[:, left]] == left).all(axis=0)]
        chosen.append(wins)
        free[corners[:, wins]] = False
        left = left[free[corners[:, left]].all(axis=0)]
        if not len(left):
            break
    return order[np.concatenate(chosen)]
