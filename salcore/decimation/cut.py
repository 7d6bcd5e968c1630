# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts through the order of elimination: kept vertices, what stands for the rest, faces, positions.

Every cut is worked out from ranks and parents alone, so levels nest: what a count keeps, every
larger count keeps too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.edges import find_edges, sort_rows
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import face_normals, sum_by_label
from ..input.constraints import Constraints
from ..input.geometry import Geometry
from .attribute_transfer import corner_sources
from .kept_points import first_points
from .legality import turned_over
from .order import Elimination
from .quadrics import minimizers, vertex_quadrics
from .wedge_collapses import last_wedges

MAX_UNDO_ROUNDS = 8
"""Rounds in which corners of faces that turn over go back; in each, others may turn."""


def living_ancestors(elimination: Elimination, count: int) -> Indices:
    """Return the kept vertex (n,) that each vertex went into, for the first `count` ranks.

    O(n log n) at the most.
    """
    vertices = np.arange(len(elimination.rank))
    parent = np.where(elimination.rank < count, vertices, elimination.parent)
    return last_ancestors(parent)[0]


def last_ancestors(parent: Indices) -> tuple[Indices, int]:
    """Return the last ancestor of each, and the doublings it took; the last are their own parents.

    Pointer jumping: every step doubles the generations passed.
    """
    ancestor = parent
    doublings = 0
    while True:
        further = ancestor[ancestor]
        if np.array_equal(further, ancestor):
            return ancestor, doublings
        ancestor, doublings = further, doublings + 1


def cut_faces(faces: Indices, source: Indices) -> tuple[Indices, Indices]:
    """Return the faces (k, 3) that are left when every vertex joins its source, and which (k,).

    Faces keep the order of their corners; those that lost a corner, and all but the first of those
    with the same corners, are left out.
    """
    distinct = np.empty(len(faces), dtype=bool)

    def compare_corners(start: int, stop: int) -> None:
        a, b, c = source.take(faces[start:stop]).T
        distinct[start:stop] = (a != b) & (b != c) & (c != a)

    run_blocks(compare_corners, len(faces))
    left = np.flatnonzero(distinct)
    corners: Indices = source.take(faces.take(left, axis=0))
    order, same = sort_rows(np.sort(corners, axis=1), len(source))
    again = order[1:][same]
    if len(again):
        first = np.ones(len(left), dtype=bool)
        first[again] = False
        left, corners = left[first], corners[first]
    return corners, left


def wedges_of_cut(
    elimination: Elimination, constraints: Constraints, count: int, origin: Indices
) -> Indices | None:
    """Return the wedges (k, 3) of the corners of a cut, by those they come from, or None."""
    wedges, parent = constraints.wedges, elimination.wedge_parent
    if wedges is None or parent is None:
        return None
    last = last_wedges(wedges, parent, elimination.rank < count)
    return last[wedges.corners.ravel()[origin]]


def corners_of_cut(
    geometry: Geometry,
    elimination: Elimination,
    constraints: Constraints,
    count: int,
    origin: Indices,
) -> tuple[Indices | None, Indices | None]:
    """Return where the corners of a cut take their values from, and the heirs of split points.

    Parameters
    ----------
    geometry : Geometry
    elimination : Elimination
    constraints : Constraints
    count : int
        Ranks that are kept.
    origin : (k, 3) intp
        Corner of the clean faces that each corner comes from.

    Returns
    -------
    corners : (k, 3) intp or None
        Corners of the clean faces; None without wedges, where the first corner at a vertex does.
    heirs : (N,) intp or None
        Input point of the wedge that the wedge of each input point went into; -1 for points that
        no face uses.
    """
    wedges, parent = constraints.wedges, elimination.wedge_parent
    if wedges is None or parent is None:
        return None, None
    last = last_wedges(wedges, parent, elimination.rank < count)
    layers = [constraints.layers[k] for k in wedges.without_seams if constraints.layers[k].given]
    charts = None
    if layers:
        rows = [wedges.values[wedges.corners.ravel()], *(layer.scaled() for layer in layers)]
        charts = np.hstack(rows).reshape(len(geometry.faces), 3, -1)
    corners = corner_sources(wedges.corners, last[wedges.corners.ravel()[origin]], origin, charts)
    heirs = np.full(geometry.input_count, -1, dtype=np.intp)
    if geometry.corner_points is not None:
        point = np.empty(len(last), dtype=np.intp)
        flat = geometry.corner_points.ravel()
        point[wedges.corners.ravel()[::-1]] = flat[::-1]
        if not layers:  # all points of a wedge are alike: one will do
            first = np.empty(len(last), dtype=np.intp)
            first[wedges.corners.ravel()[::-1]] = np.arange(len(flat))[::-1]
            corners = first[wedges.corners.ravel()[corners]]
        heirs[flat] = point[last[wedges.corners.ravel()]]
    return corners, heirs


def optimal_positions(
    points: Floats,
    faces: Indices,
    border_weight: float,
    source: Indices,
    left: Indices,
    fixed: Mask | None = None,
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
    fixed : (n,) bool, optional
        Vertices that do not move.

    Returns
    -------
    (n, 3) float64
        Rows of vertices that are not kept mean nothing.
    """
    count = len(points)
    quadrics, _ = vertex_quadrics(points, faces, find_edges(faces, count), border_weight)
    accumulated = sum_by_label(quadrics, source, count)
    kept = np.flatnonzero(np.bincount(left.ravel(), minlength=count))
    if fixed is not None:
        kept = kept[~fixed[kept]]
    moved = points.copy()

    def move(start: int, stop: int) -> None:
        block = kept[start:stop]
        moved[block] = minimizers(accumulated[block], points[block])

    run_blocks(move, len(kept))
    for _ in range(MAX_UNDO_ROUNDS + 1):
        turned = _turned_faces(points, moved, left)
        if not turned.any():
            break
        back = np.unique(left[turned])
        moved[back] = points[back]
    return moved


def _turned_faces(before: Floats, after: Floats, faces: Indices) -> Mask:
    """Return the faces (k,) that turn over, from where the points were to where they are."""
    turned = np.empty(len(faces), dtype=bool)

    def compare(start: int, stop: int) -> None:
        old, new = (face_normals(at, faces[start:stop]) for at in (before, after))
        turned[start:stop] = turned_over(old, new) & old.any(axis=1)

    run_blocks(compare, len(faces))
    return turned


@dataclass(frozen=True, eq=False)
class Ranking:
    """The order of elimination in the input's own numbers, for hosts that cut it themselves.

    Attributes
    ----------
    rank : (N,) int64
        The points of rank below a count are those that this count keeps. A permutation, but for
        parts of a mesh that go whole: their points share the highest of their ranks. Points that
        equal another come after all distinct ones, first those that no face uses; points that are
        not finite last. Protected points come first.
    parent : (N,) int64
        Point of lower rank that each goes into; -1 for rank 0.
    generations : int
        Doublings (``parent[parent]``) after which every point has found its last ancestor.
    least : int
        Fewest points that keep what is to be kept: protected points, borders, the topology.
    """

    rank: Indices
    parent: Indices
    generations: int
    least: int = 1


def input_ranking(
    geometry: Geometry, elimination: Elimination, constraints: Constraints
) -> Ranking:
    """Return the order of elimination over input points, in O(N log N)."""
    vertex_of, protected = geometry.vertex_of, constraints.protected_points
    standing = first_points(geometry, protected)
    finite = vertex_of >= 0
    held = int(np.count_nonzero(constraints.staying))
    others = finite.copy()
    others[standing] = False
    protected_copies = np.zeros(len(finite), dtype=bool)
    if protected is not None:
        protected_copies = others & protected & geometry.loose
    copies = np.count_nonzero(protected_copies)
    last = np.concatenate(
        [
            np.flatnonzero(others & ~protected_copies & geometry.loose),
            np.flatnonzero(others & ~geometry.loose),
            np.flatnonzero(~finite),
        ]
    )
    rank = np.empty(len(vertex_of), dtype=np.int64)
    rank[standing] = elimination.rank + np.where(elimination.rank >= held, copies, 0)
    rank[protected_copies] = held + np.arange(copies)
    rank[last] = len(standing) + copies + np.arange(len(last))
    root = standing[elimination.rank == 0]
    parent = np.full(len(rank), root[0] if len(root) else 0, dtype=np.int64)
    parent[finite] = standing[vertex_of[finite]]
    parent[standing] = standing[elimination.parent]
    parent[root] = root
    generations = last_ancestors(parent)[1]
    parent[root] = -1
    least = max(held, 1)
    if constraints.keep_topology:
        least = max(least, elimination.topology_count)
    least += constraints.protected_copies
    return Ranking(rank, parent, generations, least)
