# SPDX-License-Identifier: GPL-3.0-or-later
"""Which collapses a surface can bear, for many at once.

Every rule of what a vertex may do stands in the tables of kinds below, in the manner of
meshoptimizer's `kCanCollapse`. The link condition is that of Dey, Edelsbrunner, Guha and Nekhayev,
Topology preserving edge contraction, 1999.
"""

from __future__ import annotations

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.edges import edge_key
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import cross, dot, sum_by_label
from .one_rings import OneRings

MANY = np.iinfo(np.int32).max

MANIFOLD, BORDER, LINKED, COMPLEX = range(4)
KINDS = np.array(
    [
        (2, 2, 3),
        (1, 1, 2),
        (0, 0, 0),
        (1, MANY, 0),
    ]
)
"""What a removed vertex asks of its collapse, by the kind of its one-ring: the least and the most
faces that may vanish, and the edges of the smallest one-ring, at which both ends must not be.

MANIFOLD  as many edges as faces. Two faces vanish: along a border edge, where one does, the border
          would move. A tetrahedron is as small as a closed surface gets.
BORDER    one edge more than faces. One face vanishes: along an inner edge, two borders would meet.
          A triangle is as small as a surface gets. (One link and no face counts as a border, too:
          nothing holds such a vertex but the surface's end.)
LINKED    no face. It goes along any link.
COMPLEX   any other: several sheets meet. Any face may vanish, as long as one does.
"""

FREE, ON_SEAM, SEAM_END = range(3)
SEAM_FACTORS = np.array(
    [
        (1.0, 1.0),
        (10.0, 1.0),
        (10.0, 10.0),
    ]
)
"""Factors on the cost of a collapse off a seam and along it, by what the removed vertex is on.

FREE      no seam.
ON_SEAM   two seam edges. It should stay on the line.
SEAM_END  one, or three and more: where seams end or meet, a corner of the line would move.

Not infinite: a texture of many small charts would hold on to its seams until all between them has
gone. Protected vertices cost infinitely much, seam or not (`Costs.evaluate`).
"""
BROKEN_SEAM = 10.0
"""Factor on the cost of a collapse that failed because it lays a seam upon another edge."""
FORBIDDEN, FORBIDDEN_AT_LAST, GUESSED = np.inf, 16.0, 1.0
"""Factors on the cost of a collapse that failed for any other reason: on a surface that is known;
there, once only forbidden collapses are left; and where the surface is only guessed. A collapse
that is cheapest again in spite of a finite factor is done all the same."""

LEAST_COSINE = 0.2
"""A face may turn by no more than the angle of this cosine (78 degrees)."""
NO_AREA = 1e-3
"""Twice the area of a face by its squared sides, below which its normal means nothing."""


def classify(rings: OneRings) -> Indices:
    """Return the kind (s,) of each removed vertex, a row of `KINDS`."""
    faces = rings.count_faces()
    surplus = rings.count_edges() - faces
    others = np.where(faces == 0, LINKED, COMPLEX)
    return np.where(surplus == 0, MANIFOLD, np.where(surplus == 1, BORDER, others))


def seam_factors(seams: Integers, along: Mask) -> Floats:
    """Return the factors on the costs of removing vertices with so many seams, along one or not."""
    kind = np.where(seams == 0, FREE, np.where(seams == 2, ON_SEAM, SEAM_END))
    factors: Floats = SEAM_FACTORS[kind, along.astype(np.intp)]
    return factors


def legal(rings: OneRings, points: Floats, degree: Integers) -> Mask:
    """Return which collapses (s,) keep the surface's topology and turn no face over."""
    return _keeps_topology(rings, degree) & _turns_no_face(rings, points)


def _keeps_topology(rings: OneRings, degree: Integers) -> Mask:
    """Return where the link condition holds, and the table of kinds agrees."""
    total = len(rings.removed)
    vanishing = np.bincount(rings.face_owner[rings.vanishing], minlength=total)
    shared = np.bincount(rings.edge_owner[rings.shared], minlength=total)
    least, most, smallest = KINDS[classify(rings)].T
    good = (shared == vanishing) & (least <= vanishing) & (vanishing <= most)
    too_small = (rings.count_edges() == smallest) & (degree[rings.kept] == smallest)
    return np.asarray(good & ~too_small)


def _turns_no_face(rings: OneRings, points: Floats) -> Mask:
    """Return which collapses turn no face over.

    The normal of a face of hardly any area is noise, and a scan is full of slivers: faces are only
    held against what was there before, and a sliver that grows must face as its whole ring does.
    """
    total = len(rings.faces)
    normal = np.empty((total, 3))
    bad, appears = np.empty(total, dtype=bool), np.empty(total, dtype=bool)

    def compare(start: int, stop: int) -> None:
        base, before, after = _sides(rings, points, np.arange(start, stop))
        old, new = cross(base, before), cross(base, after)
        was_sliver = _is_sliver(old, base, before)
        normal[start:stop] = old
        bad[start:stop] = turned_over(old, new) & ~was_sliver
        appears[start:stop] = was_sliver & ~_is_sliver(new, base, after)

    run_blocks(compare, total)
    bad &= ~rings.vanishing
    grown = np.flatnonzero(appears & ~rings.vanishing)
    if len(grown):
        outward = sum_by_label(normal, rings.face_owner, len(rings.removed))
        base, _, after = _sides(rings, points, grown)
        bad[grown] |= dot(cross(base, after), outward[rings.face_owner[grown]]) <= 0.0
    good = np.ones(len(rings.removed), dtype=bool)
    good[rings.face_owner[bad]] = False
    return good


def _sides(rings: OneRings, points: Floats, face: Indices) -> tuple[Floats, Floats, Floats]:
    """Return three sides (f, 3) of faces: the one that stays, one before, and one after."""
    owner = rings.face_owner.take(face)
    left = points.take(rings.left.take(face), axis=0)
    base = points.take(rings.right.take(face), axis=0) - left
    before = points.take(rings.removed.take(owner), axis=0) - left
    after = points.take(rings.kept.take(owner), axis=0) - left
    return base, before, after


def turned_over(before: Floats, after: Floats) -> Mask:
    """Return which normals (m, 3), of any length, turn too far; or vanish."""
    lengths = np.sqrt(dot(before, before) * dot(after, after))
    return np.asarray(dot(before, after) <= LEAST_COSINE * lengths)


def _is_sliver(normal: Floats, side: Floats, other: Floats) -> Mask:
    """Return which faces have hardly any area for two of their sides (m, 3)."""
    squares = dot(side, side) + dot(other, other)
    return np.asarray(dot(normal, normal) / squares**2 <= NO_AREA**2)


def would_break_seam(rings: OneRings, seam: Mask) -> Mask:
    """Return which collapses (s,) would lay a seam, one of the edges (e,), upon another edge."""
    broken = np.zeros(len(rings.removed), dtype=bool)
    laid = rings.shared & seam[rings.edges % len(seam)]
    broken[rings.edge_owner[laid]] = True
    return broken


def leaves_plane(rings: OneRings, on_plane: Mask) -> Mask:
    """Return which collapses (s,) a surface cannot bear that ends at a plane of symmetry.

    Vertices (n,) on the plane stay on it; and no edge off its border joins two of them, or else
    that edge would be its own twin.
    """
    gone, stays = on_plane[rings.removed], on_plane[rings.kept]
    joined = on_plane[rings.other] & ~rings.shared & (rings.other != rings.edge_kept)
    joins = np.zeros(len(gone), dtype=bool)
    joins[rings.edge_owner[joined]] = True
    return np.asarray((gone & ~stays) | (~gone & stays & joins))


def conflicting(rings: OneRings, good: Mask) -> Mask:
    """Return which of the good collapses conflict with a cheaper one, which has a lower number.

    Each is checked against the surface before the round. Two of them together could still make
    the same edge twice, or close a hole of three from both sides; then the cheaper one is done.
    """
    new_edge = good[rings.edge_owner] & ~rings.shared & (rings.other != rings.edge_kept)
    faces, edges = rings.count_faces(), rings.count_edges()
    small = good & (edges + (edges != faces) <= 3)
    rim = np.flatnonzero(small[rings.face_owner])
    rim_key = edge_key(rings.left[rim], rings.right[rim], rings.count)
    key = np.concatenate([rings.key[new_edge], rim_key])
    owner = np.concatenate([rings.edge_owner[new_edge], rings.face_owner[rim]])
    order = np.argsort(key)
    key, owner = key[order], owner[order]
    first = np.flatnonzero(np.append(True, key[1:] != key[:-1])[: len(key)])
    cheapest = np.minimum.reduceat(owner, first)
    dearer = owner != np.repeat(cheapest, np.diff(np.append(first, len(key))))
    conflict = np.zeros(len(rings.removed), dtype=bool)
    conflict[owner[dearer]] = True
    return conflict
