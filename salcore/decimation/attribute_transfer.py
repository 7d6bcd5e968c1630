# SPDX-License-Identifier: GPL-3.0-or-later
"""Which corner and edge of the input each one of a simplified mesh takes its values from.

Texture coordinates, corner colours and split normals belong to corners, not to vertices: a vertex
on a seam has several values, one for each chart that meets there. Seams, creases and sharpness
belong to edges.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arrays.blocks import worker_count
from ..arrays.edges import edge_key, pairs_at_edges
from ..arrays.types import Floats, Indices, Integers, Ints, Keys
from ..arrays.vectors import dot
from .nearest_faces import Assignment, Triangles
from .samples import Samples


def corner_sources(
    corners: Integers, wanted: Indices, origin: Integers, charts: Floats | None
) -> Keys:
    """Return the corner (K, 3) of the input that each new corner takes its values from.

    A corner whose vertex stayed keeps its own. One whose vertex went into another takes, of all
    corners at that other vertex, the one nearest to it in the charts. The same for wedges, in
    place of vertices.

    Parameters
    ----------
    corners : (F, 3) int
        Vertices, or wedges, of the input's faces.
    wanted : (K, 3) int
        Those of the new faces.
    origin : (K, 3) int
        Input corner that each new one comes from.
    charts : (F, 3, d) float64 or None
        Texture coordinates of the input's corners, or other values that tell charts apart; without
        them the first corner does.

    Returns
    -------
    (K, 3) int64
        Corner c of face f is ``3 f + c``.
    """
    own: Keys = origin.astype(np.int64)  # a copy
    moved = corners.ravel()[own] != wanted
    if not moved.any():
        return own
    if charts is None:
        first = np.empty(int(corners.max()) + 1, dtype=np.int64)
        first[corners.ravel()[::-1]] = np.arange(corners.size)[::-1]
        own[moved] = first[wanted[moved]]
        return own
    vertices, place = np.unique(wanted[moved], return_inverse=True)
    number = np.full(int(corners.max()) + 1, -1, dtype=np.int64)
    number[vertices] = np.arange(len(vertices))
    flat = number[corners.ravel()]
    candidates = np.flatnonzero(flat >= 0)
    values = charts.reshape(corners.size, -1)
    # The vertex is one more coordinate, in steps longer than any distance in the charts.
    step = 2.0 * np.linalg.norm(np.ptp(values, axis=0)) + 1.0
    tree = cKDTree(np.column_stack([values[candidates], step * flat[candidates]]))
    query = np.column_stack([values[own[moved]], step * place.ravel()])
    own[moved] = candidates[tree.query(query, workers=worker_count())[1]]
    return own


def label_charts(faces: Indices, seams: Ints | None) -> Indices:
    """Return the chart (m,) of each face: those linked by edges that are no seams are one."""
    total = len(faces)
    count = int(faces.max(initial=-1)) + 1
    edges, edge, low, _ = pairs_at_edges(faces, np.arange(total), count)
    one, other = low // 3
    if seams is not None and len(seams):
        linked = ~edges.among(seams, count)[edge]
        one, other = one[linked], other[linked]
    links = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(total, total))
    return connected_components(links, directed=False)[1].astype(np.intp)


def place_sources(
    points: Floats, faces: Indices, vertices: Indices, places: Floats
) -> tuple[Keys, Floats]:
    """Return where on a surface places lie that its vertices have moved to.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 3) int
    vertices : (p,) intp
        Vertex that has moved to each place; the face is sought round it.
    places : (p, 3) float64

    Returns
    -------
    face : (p,) int64
        Face nearest to each place; -1 where the vertex has none.
    weights : (p, 3) float64
        Barycentric coordinates of the nearest point in it; values of its corners, so weighted, make
        that of the place.

    Notes
    -----
    O(m + p) time.
    """
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    here = np.flatnonzero(used[vertices])
    face, weights = np.full(len(vertices), -1, dtype=np.int64), np.zeros((len(vertices), 3))
    columns = np.ascontiguousarray(places[here].T)
    samples = Samples(
        columns, np.zeros_like(columns), np.ones(len(here)), vertices[here], len(here)
    )
    face[here] = Assignment.of(samples, points, faces).face
    weights[here] = Triangles.of(points, faces).project(columns, face[here])[0].T
    return face, weights


def edge_sources(
    points: Floats, edges: Indices, ends: Indices, kept: Indices, new_edges: Indices
) -> Keys:
    """Return the input edge (e,) that each new edge takes its values from, or -1.

    Candidates are all edges whose ends went into the ends of the new one; of several, the one that
    lies closest along it is taken, so a crease goes on along what is left of it.

    Parameters
    ----------
    points : (N, 3) float64
    edges : (E, 2) intp
        Ends of the input's edges.
    ends : (E, 2) intp
        What stands for these ends, as positions among the kept points; -1 for nothing.
    kept : (M,) intp
        Kept points.
    new_edges : (e, 2) intp
        Ends of the new edges, as positions among the kept points.
    """
    count = max(len(kept), 1)
    wanted = edge_key(new_edges[:, 0], new_edges[:, 1], count)
    order = np.argsort(wanted)
    result = np.full(len(wanted), -1, dtype=np.int64)
    old = np.flatnonzero((ends[:, 0] != ends[:, 1]) & (ends >= 0).all(axis=1))
    if not len(old) or not len(wanted):
        return result
    key = edge_key(ends[old, 0], ends[old, 1], count)
    place = order[np.searchsorted(wanted, key, sorter=order).clip(max=len(order) - 1)]
    hit = wanted[place] == key
    old, place = old[hit], place[hit]
    start, stop = points[kept[new_edges[place]]].transpose(1, 0, 2)
    along = stop - start
    length = np.maximum(dot(along, along), np.finfo(np.float64).tiny)
    away = np.zeros(len(old))
    for end in edges[old].T:
        offset = points[end] - start
        share = dot(offset, along) / length
        across = offset - share[:, None] * along
        away += dot(across, across)
    worst_first = np.lexsort((-old, -away))  # what is written last stays
    result[place[worst_first]] = old[worst_first]
    return result
