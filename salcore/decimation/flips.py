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
from .samples import Assignment, Samples, Triangles

EDGE_BLOCK = 1 << 11
"""Edges whose samples are looked at together."""
HELPINGS = 3
"""Times that further flips are picked among those which conflict with none picked so far."""


@dataclass(frozen=True, eq=False)
class Quads:
    """Edges between two faces, each with the quadrilateral that these make.

    Attributes
    ----------
    corners : (4, e) intp
        The edge runs from the first to the second in the left face, whose other corner is the
        third, and back in the right face, whose other corner is the fourth.
    left, right : (e,) intp
        Sides of the faces at the edge: corner c to the next of face f is ``3 f + c``.
    """

    corners: Indices
    left: Indices
    right: Indices

    @classmethod
    def find(cls, faces: Indices, count: int, fixed: Keys) -> tuple[Quads, Keys]:
        """Return the quads that may be flipped as far as the edge goes, and all edges' keys.

        Edges of one face, of more than two, of two that do not wind alike, and `fixed` ones, may
        not.
        """
        edges = find_edges(faces, count)
        keys = edge_key(edges.low, edges.high, count)
        first = np.cumsum(edges.uses) - edges.uses
        inner = np.flatnonzero((edges.uses == 2) & ~contains(fixed, keys))
        one, other = edges.sides[first[inner]], edges.sides[first[inner] + 1]
        alike = edges.forward[one] != edges.forward[other]
        one, other = one[alike], other[alike]
        left, right = (3 * (side % len(faces)) + side // len(faces) for side in (one, other))
        flat = faces.ravel()
        corners = [flat[left], flat[_next(left)], flat[_next(_next(left))]]
        corners.append(flat[_next(_next(right))])
        return cls(np.stack(corners), left, right), keys

    def take(self, chosen: Indices | Mask) -> Quads:
        """Return some of the quads."""
        return Quads(self.corners[:, chosen], self.left[chosen], self.right[chosen])

    def flipped(self) -> tuple[Indices, Indices]:
        """Return the faces (e, 3) that a flip puts in place of the left and of the right one."""
        a, b, c, d = self.corners
        return np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)

    def flipped_corners(self, corners: Indices) -> tuple[Indices, Indices]:
        """Return what belongs to the corners (e, 3) of the new faces, by `corners` of the old."""
        flat = corners.ravel()
        a, c = flat[self.left], flat[_next(_next(self.left))]
        b, d = flat[self.right], flat[_next(_next(self.right))]
        return np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)

    def legal(self, points: Floats, keys: Keys) -> Mask:
        """Return which flips (e,) make a new edge and turn no face over."""
        _, _, c, d = self.corners
        good = (c != d) & ~contains(keys, edge_key(c, d, len(points)))
        rows = np.flatnonzero(good)

        def check(start: int, stop: int) -> None:
            row = rows[start:stop]
            p, q, r, s = (points.take(corner[row], axis=0) for corner in self.corners)
            one, other = cross(s - p, r - p), cross(q - s, r - s)
            outward = one + other  # that of the old faces, too
            good[row] = ~(turned_over(outward, one) | turned_over(outward, other))

        run_blocks(check, len(rows))
        return good


def _next(side: Indices) -> Indices:
    """Return the side after each, round its face."""
    after: Indices = np.where(side % 3 == 2, side - 2, side + 1)
    return after


def gains(
    quads: Quads, points: Floats, samples: Samples, at: Assignment, stiffness: float
) -> Floats:
    """Return by how much the energy of the samples of two faces falls with each flip (e,)."""
    order, bounds = at.by_face()
    result = np.empty(len(quads.left))
    one, other = quads.flipped()

    def measure(start: int, stop: int) -> None:
        count = stop - start
        faces = np.concatenate([quads.left[start:stop], quads.right[start:stop]]) // 3
        places, ends = row_entries(bounds, faces)
        sample = order[places]
        edge = np.repeat(np.tile(np.arange(count), 2), np.diff(ends))
        both = Triangles.of(points, np.concatenate([one[start:stop], other[start:stop]]))
        queries = samples.points.take(sample, axis=0)
        square = both.square_distances(queries, edge)
        second = both.square_distances(queries, edge + count)
        nearer = second < square
        square = np.where(nearer, second, square)
        gain = at.square[sample] - square
        if stiffness:
            normal = samples.normals.take(sample, axis=0)
            cosine = dot(normal, both.normals.take(edge + count * nearer, axis=0))
            area = _areas(both, count)
            gain += 2.0 * stiffness * area[edge] * (cosine - at.cosine[sample])
        result[start:stop] = np.bincount(edge, samples.weights[sample] * gain, count)

    run_blocks(measure, len(result), size=EDGE_BLOCK)
    return result


def _areas(both: Triangles, count: int) -> Floats:
    """Return the area (e,) of each pair of triangles."""
    p, m, q = both.squares.T
    double = np.sqrt(np.maximum(p * q - m * m, 0.0))
    return 0.5 * (double[:count] + double[count:])


def independent(quads: Quads, gain: Floats, count: int) -> Indices:
    """Return flips of which no two share a corner, those of the largest gains first."""
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
