# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts through the order of elimination: kept vertices, what stands for the rest, faces, positions.

Every cut is worked out from ranks and parents alone, so levels nest: what a count keeps, every
larger count keeps too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .blocks import rest_blocks
from .geometry import Floats, Indices, unit
from .planes import face_normals
from .progress import Rests
from .progressive import Elimination
from .quadrics import minimizers, vertex_quadrics
from .triangles import find_edges, sort_rows

LEAST_COSINE = 0.2
"""A face may turn by no more than the angle of this cosine when its corners move."""
UNDOINGS = 8


def living_ancestors(elimination: Elimination, count: int) -> Rests[Indices]:
    """Return the kept vertex (n,) that each vertex went into, for the first `count` ranks.

    All functions here rest between the parts of their work.

    Pointer jumping: every step doubles the generations passed, O(n log n) at the most.
    """
    vertices = np.arange(len(elimination.rank))
    ancestor: Indices = np.where(elimination.rank < count, vertices, elimination.parent)
    while True:
        further = ancestor[ancestor]
        if np.array_equal(further, ancestor):
            return ancestor
        ancestor = further
        yield


def cut_faces(faces: Indices, source: Indices, workers: int = 0) -> Rests[tuple[Indices, Indices]]:
    """Return the faces (k, 3) that are left when every vertex joins its source, and which (k,).

    Faces keep the order of their corners; those that lost a corner, and all but the first of those
    with the same corners, are left out.
    """
    distinct = np.empty(len(faces), dtype=bool)

    def look(start: int, stop: int) -> None:
        a, b, c = source[faces[start:stop]].T
        distinct[start:stop] = (a != b) & (b != c) & (c != a)

    yield from rest_blocks(look, len(faces), workers=workers)
    left = np.flatnonzero(distinct)
    corners: Indices = source[faces[left]]
    yield
    ordered = np.sort(corners, axis=1)
    yield
    order, same = yield from sort_rows(ordered, len(source), workers)
    again = order[1:][same]
    if len(again):
        first = np.ones(len(left), dtype=bool)
        first[again] = False
        left, corners = left[first], corners[first]
    return corners, left


def optimal_positions(
    points: Floats,
    faces: Indices,
    border_weight: float,
    source: Indices,
    left: Indices,
    workers: int = 0,
) -> Rests[Floats]:
    """Return positions (n, 3) with each kept vertex at the minimum of its accumulated quadric.

    The quadric is that of the faces round all vertices that joined it. Where moving turns a face
    over, its corners stay where they were.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 3) intp
        All faces.
    border_weight : float
    source : (n,) intp
        Kept vertex that stands for each.
    left : (k, 3) intp
        Faces of the cut.
    workers : int
        Threads; 0 takes one per processor.

    Returns
    -------
    (n, 3) float64
        Rows of vertices that are not kept mean nothing.
    """
    count = len(points)
    edges = yield from find_edges(faces, count, workers)
    quadrics, _ = yield from vertex_quadrics(points, faces, edges, border_weight, workers)
    heaped = np.empty_like(quadrics)
    for k in range(10):
        heaped[:, k] = np.bincount(source, quadrics[:, k], count)
        yield
    kept = np.flatnonzero(np.bincount(left.ravel(), minlength=count))
    moved = points.copy()

    def move(start: int, stop: int) -> None:
        block = kept[start:stop]
        moved[block] = minimizers(heaped[block], points[block])

    yield from rest_blocks(move, len(kept), workers=workers)
    for _ in range(UNDOINGS + 1):
        turned = yield from _turned(points, moved, left, workers)
        if not turned.any():
            break
        back = np.unique(left[turned])
        moved[back] = points[back]
    return moved


def _turned(
    before: Floats, after: Floats, faces: Indices, workers: int
) -> Rests[NDArray[np.bool_]]:
    """Return the faces whose normals turn too far from where the points were to where they are."""
    turned = np.empty(len(faces), dtype=bool)

    def look(start: int, stop: int) -> None:
        old, new = (unit(face_normals(at, faces[start:stop])) for at in (before, after))
        cosine = np.einsum("mc,mc->m", old, new)
        turned[start:stop] = (cosine < LEAST_COSINE) & old.any(axis=1)

    yield from rest_blocks(look, len(faces), workers=workers)
    return turned
