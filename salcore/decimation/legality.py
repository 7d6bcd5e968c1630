# SPDX-License-Identifier: GPL-3.0-or-later
"""Which half-edge collapses a surface can bear, for many at once.

References: the link condition, Dey, Edelsbrunner, Guha and Nekhayev, Topology preserving edge
contraction, 1999.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .blocks import rest_blocks
from .geometry import Floats, Indices, sum_by_label
from .progress import Rests

Mask = NDArray[np.bool_]
Ints = NDArray[np.int32]

LEAST_COSINE = 0.2
"""A face may turn by no more than the angle of this cosine (78 degrees)."""
NO_AREA = 1e-3
"""Twice the area of a face by its squared sides, below which its normal means nothing."""


@dataclass(frozen=True, eq=False)
class Stars:
    """The faces and edges round the vertices of a round, flat: one row a face, one row an edge.

    Attributes
    ----------
    going, staying : (s,) int
        The collapses; no two going vertices are neighbours.
    faces, face_owner : (f,) int
        A face with a going vertex, and the collapse it belongs to.
    left, right : (f,) int32
        Its two other corners, in order.
    vanishing : (f,) bool
        Whether the staying vertex is one of them.
    edges, edge_owner : (e,) int
        An edge of a going vertex, and the collapse it belongs to.
    edge_other, edge_target : (e,) int32
        Its other end, and the collapse's staying vertex.
    common : (e,) bool
        Whether the other end is a neighbour of the staying vertex too.
    key : (e,) int64
        The edge from the other end to the staying vertex, as a number.
    count : int
        Vertices, dead ones included; keys are numbers to this base.
    """

    going: Indices
    staying: Ints
    faces: Indices
    face_owner: Indices
    left: Ints
    right: Ints
    vanishing: Mask
    edges: Indices
    edge_owner: Indices
    edge_other: Ints
    edge_target: Ints
    common: Mask
    key: NDArray[np.int64]
    count: int

    @classmethod
    def find(
        cls, going: Indices, staying: Ints, corners: list[Ints], a: Ints, b: Ints, count: int
    ) -> Rests[Stars]:
        """Gather the stars of the collapses from the corners of all faces and ends of all edges."""
        owner_of = np.full(count, -1, dtype=np.int32)
        owner_of[going] = np.arange(len(going))
        hits, owners = [], []
        for corner in corners:
            owner = owner_of[corner]
            hits.append(np.flatnonzero(owner >= 0))
            owners.append(owner[hits[-1]].astype(np.intp))
            yield
        faces, face_owner = np.concatenate(hits), np.concatenate(owners)
        left = np.concatenate([corners[(k + 1) % 3][hit] for k, hit in enumerate(hits)])
        yield
        right = np.concatenate([corners[(k + 2) % 3][hit] for k, hit in enumerate(hits)])
        target = staying[face_owner]
        vanishing = (left == target) | (right == target)
        yield
        alive = a != b
        at_a = np.flatnonzero((owner_of[a] >= 0) & alive)
        yield
        at_b = np.flatnonzero((owner_of[b] >= 0) & alive)
        yield
        edges = np.concatenate([at_a, at_b])
        edge_owner = np.concatenate([owner_of[a[at_a]], owner_of[b[at_b]]]).astype(np.intp)
        other, edge_target = np.concatenate([b[at_a], a[at_b]]), staying[edge_owner]
        key = _edge_key(other, edge_target, count)
        yield
        is_target, is_other = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        is_target[staying], is_other[other] = True, True
        joined = is_target[a] & is_other[b]
        yield
        joined |= is_target[b] & is_other[a]
        near = np.flatnonzero(joined & alive)
        yield
        present = np.sort(_edge_key(a[near], b[near], count))
        yield
        common = _contains(present, key) & (other != edge_target)
        yield
        return cls(
            going, staying, faces, face_owner, left, right, vanishing,
            edges, edge_owner, other, edge_target, common, key, count,
        )  # fmt: skip


def _edge_key(a: Ints, b: Ints, count: int) -> NDArray[np.int64]:
    """Return one number for each undirected edge."""
    return np.minimum(a, b).astype(np.int64) * count + np.maximum(a, b)


def _contains(table: NDArray[np.int64], keys: NDArray[np.int64]) -> Mask:
    """Return which keys are in the sorted table."""
    if not len(table):
        return np.zeros(len(keys), dtype=bool)
    order = np.argsort(keys)  # sorted look-ups walk the table in order, not all over it
    place = np.minimum(np.searchsorted(table, keys[order]), len(table) - 1)
    found = np.empty(len(keys), dtype=bool)
    found[order] = table[place] == keys[order]
    return found


def allowed(stars: Stars, points: Floats, degree: Indices, workers: int) -> Rests[Mask]:
    """Return which collapses keep the surface's topology and turn no face over, with rests."""
    sound = _keeps_topology(stars, degree)
    yield
    return sound & (yield from _turns_no_face(stars, points, workers))


def _keeps_topology(stars: Stars, degree: Indices) -> Mask:
    """Return where the link condition holds.

    Inside a surface a vertex has as many edges as faces, and shares two neighbours with the vertex
    it goes into; on a border it has one edge more, and goes along the border, sharing one.
    """
    total = len(stars.going)
    faces = np.bincount(stars.face_owner, minlength=total)
    edges = np.bincount(stars.edge_owner, minlength=total)
    vanishing = np.bincount(stars.face_owner[stars.vanishing], minlength=total)
    shared = np.bincount(stars.edge_owner[stars.common], minlength=total)
    inner, border, alone = edges == faces, edges == faces + 1, faces == 0
    good = (shared == vanishing) & ((vanishing >= 1) | alone)
    good &= np.where(inner & ~alone, vanishing == 2, np.where(border, vanishing == 1, True))
    # A tetrahedron, or a single triangle, is as small as a surface gets.
    least = np.where(inner, 3, 2)
    smallest = (edges == least) & (degree[stars.staying] == least)
    good &= ~(smallest & (inner | border) & ~alone)
    return np.asarray(good)


def _turns_no_face(stars: Stars, points: Floats, workers: int) -> Rests[Mask]:
    """Return which collapses turn no face over.

    The normal of a face of hardly any area is noise, and a scan is full of slivers: faces are only
    held against what was there before, and a sliver that grows must face as its whole star does.
    """
    normal = np.empty((len(stars.faces), 3))

    def measure(start: int, stop: int) -> None:
        left, right = points[stars.left[start:stop]], points[stars.right[start:stop]]
        before = points[stars.going[stars.face_owner[start:stop]]] - left
        normal[start:stop] = np.cross(right - left, before)

    yield from rest_blocks(measure, len(normal), workers=workers)
    outward = sum_by_label(normal, stars.face_owner, len(stars.going))
    stay = np.flatnonzero(~stars.vanishing)
    bad = np.empty(len(stay), dtype=bool)
    yield

    def turn(start: int, stop: int) -> None:
        face = stay[start:stop]
        owner, left = stars.face_owner[face], points[stars.left[face]]
        base, before = points[stars.right[face]] - left, points[stars.going[owner]] - left
        after = points[stars.staying[owner]] - left
        old, new = normal[face], np.cross(base, after)
        bad[start:stop] = _turned(base, before, after, old, new, outward[owner])

    yield from rest_blocks(turn, len(stay), workers=workers)
    good = np.ones(len(stars.going), dtype=bool)
    good[stars.face_owner[stay[bad]]] = False
    return good


def _turned(
    base: Floats, before: Floats, after: Floats, old: Floats, new: Floats, outward: Floats
) -> Mask:
    """Return which faces turn over, from their sides and normals before and after."""
    old_square = np.einsum("fc,fc->f", old, old)
    new_square = np.einsum("fc,fc->f", new, new)
    product = np.einsum("fc,fc->f", old, new)
    length = np.einsum("fc,fc->f", base, base)
    old_shape = old_square / (length + np.einsum("fc,fc->f", before, before)) ** 2
    new_shape = new_square / (length + np.einsum("fc,fc->f", after, after)) ** 2
    bad: Mask = product <= LEAST_COSINE * np.sqrt(old_square * new_square)
    grown = (old_shape <= NO_AREA**2) & (new_shape > NO_AREA**2)
    bad &= old_shape > NO_AREA**2
    bad |= grown & (np.einsum("fc,fc->f", new, outward) <= 0.0)
    return bad


def clashing(stars: Stars, good: Mask) -> Rests[Mask]:
    """Return which of the good collapses clash with a cheaper one (of lower number), with rests.

    Each is checked against the surface before the round. Two of them together could still make
    the same edge twice, or close a hole of three from both sides; then the cheaper one is done.
    """
    total = len(stars.going)
    new_edge = good[stars.edge_owner] & ~stars.common & (stars.edge_other != stars.edge_target)
    key, owner = stars.key[new_edge], stars.edge_owner[new_edge]
    yield
    faces = np.bincount(stars.face_owner, minlength=total)
    edges = np.bincount(stars.edge_owner, minlength=total)
    small = good & (edges + (edges != faces) <= 3)
    rim = np.flatnonzero(small[stars.face_owner])
    key = np.concatenate([key, _edge_key(stars.left[rim], stars.right[rim], stars.count)])
    owner = np.concatenate([owner, stars.face_owner[rim]])
    yield
    order = np.argsort(key)
    yield
    key, owner = key[order], owner[order]
    again = np.flatnonzero(key[1:] == key[:-1])
    one, other = owner[again], owner[again + 1]
    clash = np.zeros(total, dtype=bool)
    clash[np.maximum(one, other)[one != other]] = True
    return clash
