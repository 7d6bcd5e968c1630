# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of like saliency and their boundaries (paper §4.1: 4.1, 4.2, algorithm 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from .blocks import BLOCK, rest_blocks
from .geometry import Floats, Geometry, Indices
from .graph import Graph
from .progress import Rests
from .rows import row_max
from .sorting import sort


@dataclass(frozen=True, eq=False)
class Regions:
    """Labels, boundary vertices, and the boundaries in order.

    Attributes
    ----------
    labels : (n,) intp
        Region of each vertex, numbered from 0 in the order of their first vertices.
    count : int
        Number of regions.
    boundary : (n,) bool
        Vertices with a neighbour of another region, on the border of a mesh, or isolated.
    chains : (c,) intp
        Boundary vertices between the branchings of the boundaries, chain after chain, in order.
    offsets : (k + 1,) intp
        ``chains[offsets[q]:offsets[q + 1]]`` is chain q.
    branching : (n,) bool
        Boundary vertices where more than two chains meet; they belong to no chain.
    """

    labels: Indices
    count: int
    boundary: NDArray[np.bool_]
    chains: Indices
    offsets: Indices
    branching: NDArray[np.bool_]


def similar(first: Floats, second: Floats, tolerance: float) -> NDArray[np.bool_]:
    """Return F of (4.1): whether two saliencies differ by at most the tolerance."""
    return np.abs(first - second) <= tolerance


def build_regions(
    geometry: Geometry, graph: Graph, saliency: Floats, tolerance: float, workers: int = 0
) -> Rests[Regions]:
    """Segment the graph into regions and order their boundaries, resting between the parts.

    Regions are the connected components of the edges between similar vertices, which is what
    algorithm 1 labels. The published concave hull is not defined for a piece of a surface in
    space; the boundary is read off the graph instead.

    Parameters
    ----------
    geometry : Geometry
    graph : Graph
    saliency : (n,) float64
    tolerance : float
        σ of (4.1).
    workers : int
        Threads; 0 takes one per processor.

    Notes
    -----
    O(e log e) time for e edges, about 60 bytes an edge between boundary vertices.
    """
    joined = np.empty(len(graph.indices), dtype=bool)

    def join(start: int, stop: int) -> None:
        edges, row, other = graph.edges(start, stop)
        joined[edges] = similar(saliency[row], saliency[other], tolerance) & (row < other)

    yield from rest_blocks(join, len(saliency), workers=workers)
    labels = yield from _components(graph, joined)
    yield
    boundary, row, other = yield from _boundaries(geometry, graph, labels, workers)
    chains, offsets, branching = yield from _chains(
        geometry.points, row, other, np.flatnonzero(boundary)
    )
    return Regions(labels, int(labels.max(initial=-1)) + 1, boundary, chains, offsets, branching)


def _boundaries(
    geometry: Geometry, graph: Graph, labels: Indices, workers: int
) -> Rests[tuple[NDArray[np.bool_], Indices, NDArray[np.int32]]]:
    """Return the boundary vertices, and the ends of the edges within regions that join them.

    Each edge comes once.
    """
    boundary = graph.degrees == 0
    inner = np.empty(len(graph.indices), dtype=bool)
    nothing = np.empty(0, dtype=np.intp), np.empty(0, dtype=np.int32)
    joins = [nothing] * (len(labels) // BLOCK + 1)

    def part(start: int, stop: int) -> None:
        edges, row, other = graph.edges(start, stop)
        differs = labels[row] != labels[other]
        boundary[start:stop] |= row_max(differs, graph.indptr[start : stop + 1] - edges.start) > 0.0
        inner[edges] = ~differs & (row < other)

    yield from rest_blocks(part, len(labels), workers=workers)
    rim = yield from border_vertices(geometry.faces, workers)
    boundary[rim] = True

    def follow(start: int, stop: int) -> None:
        edges, row, other = graph.edges(start, stop)
        along = inner[edges] & boundary[row] & boundary[other]
        joins[start // BLOCK] = row[along], other[along]

    yield from rest_blocks(follow, len(labels), workers=workers)
    rows, others = zip(*joins, strict=True)
    return boundary, np.concatenate(rows), np.concatenate(others)


def border_vertices(faces: Indices, workers: int = 0) -> Rests[Indices]:
    """Return the vertices on edges that belong to one face only."""
    if not len(faces):
        return np.empty(0, dtype=np.intp)
    count = int(faces.max()) + 1
    start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    yield
    key = np.minimum(start, end) * count + np.maximum(start, end)
    yield
    _, key = yield from sort(key, workers=workers)
    differs = np.concatenate([[True], key[1:] != key[:-1], [True]])
    ends = np.divmod(key[differs[1:] & differs[:-1]], count)
    return np.unique(np.concatenate(ends))


def _components(graph: Graph, joined: NDArray[np.bool_]) -> Rests[Indices]:
    """Return the connected component of every vertex along the `joined` edges (e,).

    One direction of an edge will do. Components are numbered in the order of first vertices.
    """
    count = len(graph.indptr) - 1
    indptr = np.concatenate([[0], np.cumsum(joined)])[graph.indptr]
    yield
    indices = graph.indices[joined]
    ones = np.ones(len(indices), dtype=np.int8)
    yield
    matrix = sparse.csr_array((ones, indices, indptr), shape=(count, count))
    yield
    return csgraph.connected_components(matrix, directed=False)[1].astype(np.intp)


def _chains(
    points: Floats, row: Indices, other: NDArray[np.integer], boundary: Indices
) -> Rests[tuple[Indices, Indices, NDArray[np.bool_]]]:
    """Order boundary vertices into chains along the shortest tree that spans each boundary.

    Returns
    -------
    chains, offsets, branching
        As in `Regions`. Chains are what is left of the trees without the branching vertices; each
        starts at its end of lower index.
    """
    total, count = len(points), len(boundary)
    number = np.full(total, -1, dtype=np.intp)
    number[boundary] = np.arange(count)
    yield
    length = np.linalg.norm(points[row] - points[other], axis=1)
    yield
    matrix = sparse.csr_array((length, (number[row], number[other])), shape=(count, count))
    yield
    tree = csgraph.minimum_spanning_tree(matrix).tocoo()
    yield
    degree = np.bincount(np.concatenate([tree.row, tree.col]), minlength=count)
    simple = degree <= 2
    branching = np.zeros(total, dtype=bool)
    branching[boundary[~simple]] = True
    yield

    inner = simple[tree.row] & simple[tree.col]
    ends = (tree.row[inner], tree.col[inner])
    paths = sparse.csr_array((np.ones(len(ends[0])), ends), shape=(count, count))
    yield
    path = csgraph.connected_components(paths, directed=False)[1]
    yield
    free = np.flatnonzero(simple & (np.bincount(np.concatenate(ends), minlength=count) <= 1))
    start = free[np.unique(path[free], return_index=True)[1]]
    if not len(start):
        return np.empty(0, dtype=np.intp), np.zeros(1, dtype=np.intp), branching
    yield
    position = csgraph.dijkstra(
        paths, directed=False, indices=start, unweighted=True, min_only=True
    )
    yield
    members = np.flatnonzero(simple)
    members = members[np.lexsort((position[members], path[members]))]
    yield
    sizes = np.bincount(path[members])
    offsets = np.concatenate([[0], np.cumsum(sizes[sizes > 0])])
    return boundary[members], offsets, branching
