# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts through the order of elimination: kept vertices, what stands for the rest, faces, positions.

Every cut is worked out from ranks and parents alone, so levels nest: what a count keeps, every
larger count keeps too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .geometry import Floats, Indices, unit
from .planes import face_normals
from .progressive import Elimination
from .quadrics import minimizers, vertex_quadrics
from .triangles import LARGEST_KEY, find_edges

LEAST_COSINE = 0.2
"""A face may turn by no more than the angle of this cosine when its corners move."""
UNDOINGS = 8


def living_ancestors(elimination: Elimination, count: int) -> Indices:
    """Return the kept vertex (n,) that each vertex went into, for the first `count` ranks.

    Pointer jumping: every step doubles the generations passed, O(n log n) at the most.
    """
    vertices = np.arange(len(elimination.rank))
    ancestor: Indices = np.where(elimination.rank < count, vertices, elimination.parent)
    while True:
        further = ancestor[ancestor]
        if np.array_equal(further, ancestor):
            return ancestor
        ancestor = further


def cut_faces(faces: Indices, source: Indices) -> tuple[Indices, Indices]:
    """Return the faces (k, 3) that are left when every vertex joins its source, and which (k,).

    Faces keep the order of their corners; those that lost a corner, and all but the first of those
    with the same corners, are left out.
    """
    corners: Indices = source[faces]
    a, b, c = corners.T
    left = np.flatnonzero((a != b) & (b != c) & (c != a))
    corners = corners[left]
    ordered = np.sort(corners, axis=1)
    if len(source) > LARGEST_KEY:
        _, first = np.unique(ordered, axis=0, return_index=True)
    else:
        key = (ordered[:, 0] * len(source) + ordered[:, 1]) * len(source) + ordered[:, 2]
        _, first = np.unique(key, return_index=True)
    if len(first) < len(left):
        first.sort()
        left, corners = left[first], corners[first]
    return corners, left


def optimal_positions(
    points: Floats, faces: Indices, border_weight: float, source: Indices, left: Indices
) -> Floats:
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

    Returns
    -------
    (n, 3) float64
        Rows of vertices that are not kept mean nothing.
    """
    count = len(points)
    quadrics, _ = vertex_quadrics(points, faces, find_edges(faces, count), border_weight)
    heaped = np.empty_like(quadrics)
    for k in range(10):
        heaped[:, k] = np.bincount(source, quadrics[:, k], count)
    kept = np.unique(left)
    moved = points.copy()
    moved[kept] = minimizers(heaped[kept], points[kept])
    before = unit(face_normals(points, left))
    for _ in range(UNDOINGS):
        turned = _turned(before, moved, left)
        if not turned.any():
            return moved
        back = np.unique(left[turned])
        moved[back] = points[back]
    back = np.unique(left[_turned(before, moved, left)])
    moved[back] = points[back]
    return moved


def _turned(before: Floats, points: Floats, faces: Indices) -> NDArray[np.bool_]:
    """Return the faces whose normals turned too far from `before`."""
    after = unit(face_normals(points, faces))
    cosine = np.einsum("mc,mc->m", before, after)
    turned: NDArray[np.bool_] = (cosine < LEAST_COSINE) & before.any(axis=1)
    return turned
