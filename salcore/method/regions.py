# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of like saliency and their boundaries (paper §4.1: 4.1, 4.2, algorithm 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..arrays.blocks import run_blocks
from ..arrays.edges import find_edges
from ..arrays.types import Floats, Indices, Integers, Mask
from ..input.geometry import Geometry
from .graph import Graph


@dataclass(frozen=True, eq=False)
class Regions:
    """Labels, boundary vertices, and the boundaries in order.

    Attributes
    ----------
    labels : (n,) intp
        Region of each vertex, numbered from 0.
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
    boundary: Mask
    chains: Indices
    offsets: Indices
    branching: Mask


def similar(first: Floats, second: Floats, tolerance: float) -> Mask:
    """Return F of (4.1): whether two saliencies differ by at most the tolerance."""
    return np.abs(first - second) <= tolerance


def build_regions(geometry: Geometry, graph: Graph, saliency: Floats, tolerance: float) -> Regions:
    """Segment the graph into components of like saliency and order their boundaries.

    Regions are the connected components of the edges between similar vertices, (4.2), which is what
    algorithm 1 labels, in the order of their first vertices. The published concave hull is not
    defined for a piece of a surface in space; the boundary is read off the graph instead.

    Parameters
    ----------
    geometry : Geometry
    graph : Graph
    saliency : (n,) float64
    tolerance : float
        σ of (4.1).

    Notes
    -----
    O(e log e) time for e edges, about 60 bytes an edge between boundary vertices.
    """
    labels = _in_order(grow_regions(graph, saliency, tolerance), geometry.number)
    return outline(geometry, graph, labels)


def outline(geometry: Geometry, graph: Graph, labels: Indices) -> Regions:
    """Return the regions that labels (n,) from 0 on make, with their boundaries in order."""
    boundary = boundary_vertices(geometry.faces, graph, labels)
    row, other = _edges_along(graph, labels, boundary)
    members = np.flatnonzero(boundary)
    members = members[np.argsort(geometry.number[members])]
    chains, offsets, branching = _chains(geometry.points, row, other, members)
    return Regions(labels, int(labels.max(initial=-1)) + 1, boundary, chains, offsets, branching)


def grow_regions(graph: Graph, saliency: Floats, tolerance: float) -> Indices:
    """Return the region (n,) of every vertex, (4.2)."""
    joined = np.empty(len(graph.indices), dtype=bool)

    def join(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        alike = similar(saliency[edges.row], saliency[edges.other], tolerance)
        joined[edges.edges] = alike & (edges.row < edges.other)  # one direction will do

    run_blocks(join, len(saliency))
    indptr = np.concatenate([[0], np.cumsum(joined)])[graph.indptr]
    indices = graph.indices[joined]
    ones = np.ones(len(indices), dtype=np.int8)
    matrix = sparse.csr_array((ones, indices, indptr), shape=(len(saliency), len(saliency)))
    labels: Indices = csgraph.connected_components(matrix, directed=False)[1].astype(np.intp)
    return labels


def _in_order(labels: Indices, number: Indices) -> Indices:
    """Number regions from 0 in the order of their first vertices in the input."""
    first = np.full(int(labels.max(initial=-1)) + 1, len(labels))
    np.minimum.at(first, labels, number)
    rank = np.empty_like(first)
    rank[np.argsort(first)] = np.arange(len(first))
    ordered: Indices = rank[labels]
    return ordered


def boundary_vertices(faces: Indices, graph: Graph, labels: Indices) -> Mask:
    """Return the vertices (n,) next to another region, on a mesh's border, or isolated."""
    boundary: Mask = graph.degrees == 0
    row = graph.rows()
    boundary[row[labels[row] != labels[graph.indices]]] = True
    boundary[border_vertices(faces, len(labels))] = True
    return boundary


def border_vertices(faces: Indices, count: int) -> Indices:
    """Return the vertices on edges that belong to one face only."""
    edges = find_edges(faces, count)
    border = edges.uses == 1
    return np.unique(np.concatenate([edges.low[border], edges.high[border]])).astype(np.intp)


def _edges_along(graph: Graph, labels: Indices, boundary: Mask) -> tuple[Indices, Integers]:
    """Return the ends of the edges within regions that join boundary vertices, each once."""
    row = graph.rows()
    other = graph.indices
    along = (row < other) & boundary[row] & boundary[other]
    along &= labels[row] == labels[other]
    return row[along], other[along]


def _chains(
    points: Floats, row: Indices, other: Integers, boundary: Indices
) -> tuple[Indices, Indices, Mask]:
    """Order boundary vertices into chains along the shortest tree that spans each boundary.

    Returns
    -------
    chains, offsets, branching
        As in `Regions`. Chains are what is left of the trees without the branching vertices; each
        starts at the end that comes first in `boundary`.
    """
    total, count = len(points), len(boundary)
    place = np.full(total, -1, dtype=np.intp)
    place[boundary] = np.arange(count)
    length = np.linalg.norm(points[row] - points[other], axis=1)
    low, high = np.sort(np.stack([place[row], place[other]]), axis=0)
    matrix = sparse.csr_array((length, (low, high)), shape=(count, count))
    tree = csgraph.minimum_spanning_tree(matrix).tocoo()
    degree = np.bincount(np.concatenate([tree.row, tree.col]), minlength=count)
    simple = degree <= 2
    branching = np.zeros(total, dtype=bool)
    branching[boundary[~simple]] = True

    inner = simple[tree.row] & simple[tree.col]
    ends = (tree.row[inner], tree.col[inner])
    paths = sparse.csr_array((np.ones(len(ends[0])), ends), shape=(count, count))
    path = csgraph.connected_components(paths, directed=False)[1]
    free = np.flatnonzero(simple & (np.bincount(np.concatenate(ends), minlength=count) <= 1))
    start = free[np.unique(path[free], return_index=True)[1]]
    if not len(start):
        return np.empty(0, dtype=np.intp), np.zeros(1, dtype=np.intp), branching
    position = csgraph.dijkstra(
        paths, directed=False, indices=start, unweighted=True, min_only=True
    )
    members = np.flatnonzero(simple)
    members = members[np.lexsort((position[members], path[members]))]
    sizes = np.bincount(path[members])
    offsets = np.concatenate([[0], np.cumsum(sizes[sizes > 0])])
    return boundary[members], offsets, branching
