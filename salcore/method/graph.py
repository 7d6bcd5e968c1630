# SPDX-License-Identifier: GPL-3.0-or-later
"""The neighbourhood graph (paper §2.1).

D(i) are the neighbours of vertex i: its one-ring on a mesh, its star in the Delaunay triangulation
of the tangent plane on a cloud, or its star in the 3D Delaunay triangulation (as published).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import Delaunay, QhullError

from ..arrays.types import Floats, Indices, Integers, Ints
from ..input.geometry import Geometry
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .stars import build_stars

STARS_SHARE = 0.9  # of the time that building a graph takes
WIDE_BLOCK = 1 << 15
"""Rows of a product of adjacency matrices at once: most entries fall together when it is summed."""


@dataclass(frozen=True, eq=False)
class Graph:
    """Symmetric neighbourhood graph without loops, in compressed sparse rows.

    Attributes
    ----------
    indptr : (n + 1,) int64
    indices : (e,) int32
        ``indices[indptr[i]:indptr[i + 1]]`` is D(i), ascending; every edge stands in both rows.
    plane_normals : (n, 3) float64 or None
        Normals of the planes that the stars were made in, zero where there is none.
    stars : (n, w) int32 or None
        The star of each vertex by angle in its plane, filled up with -1.
    """

    indptr: NDArray[np.int64]
    indices: Ints
    plane_normals: Floats | None = None
    stars: Ints | None = None

    @property
    def degrees(self) -> NDArray[np.int64]:
        """Number of neighbours of each vertex."""
        return np.diff(self.indptr)

    def rows(self) -> Indices:
        """Return the row of every edge."""
        return np.repeat(np.arange(len(self.indptr) - 1), self.degrees)

    def edges(self, start: int, stop: int) -> EdgeBlock:
        """Return the edges of the vertices from `start` to `stop`."""
        where = slice(int(self.indptr[start]), int(self.indptr[stop]))
        indptr = self.indptr[start : stop + 1] - where.start
        row = np.repeat(np.arange(start, stop), np.diff(indptr))
        return EdgeBlock(slice(start, stop), where, row, self.indices[where], indptr)

    def matrix(self) -> sparse.csr_array:
        """Return the adjacency matrix; it shares the graph's arrays."""
        count = len(self.indptr) - 1
        ones = np.ones(len(self.indices), dtype=bool)
        return sparse.csr_array((ones, self.indices, self.indptr), shape=(count, count))


@dataclass(frozen=True, eq=False)
class EdgeBlock:
    """The directed edges (i, j) of a run of vertices.

    Attributes
    ----------
    vertices, edges : slice
        Which vertices and edges of the graph they are.
    row, other : (b,) int
        Their ends i and j.
    indptr : (v + 1,) int64
        Bounds of each vertex's edges in the block.
    """

    vertices: slice
    edges: slice
    row: Indices
    other: Ints
    indptr: NDArray[np.int64]

    @property
    def local(self) -> Indices:
        """(b,) int, i counted from the block's first vertex."""
        local: Indices = self.row - self.vertices.start
        return local


Ends = tuple[Integers, Integers]
"""First and second ends of directed edges."""


def build_graph(geometry: Geometry, parameters: Parameters, progress: Progress = SILENT) -> Graph:
    """Return the neighbourhood graph of `geometry`.

    Notes
    -----
    Surface graphs take O(n log n) time and about 250 bytes a point. The 3D Delaunay triangulation
    takes some 25 microseconds and 2 kB a point; where there is none, because the points span no
    volume or qhull cannot tell them apart, the stars take its place.
    """
    count = len(geometry.points)
    progress(0.0)
    part = progress.part(0.0, STARS_SHARE)
    normals: Floats | None = None
    stars: Ints | None = None
    if parameters.graph == "delaunay" and count:
        try:
            edges = _delaunay_edges(geometry.points)
        except (QhullError, MemoryError):  # which qhull says of points too close to each other
            stars_instead, _ = build_stars(
                geometry.points, geometry.number, parameters.neighbors, part
            )
            edges = _star_edges(stars_instead)
    elif len(geometry.faces):
        edges = _face_edges(geometry.faces)
        loose = np.flatnonzero(np.bincount(geometry.faces.ravel(), minlength=count) == 0)
        if len(loose):
            stars, normals = _loose_stars(geometry.points, loose, parameters.neighbors, part)
            rows, columns = _star_edges(stars)
            edges = np.concatenate([edges[0], rows]), np.concatenate([edges[1], columns])
    else:
        stars, normals = build_stars(geometry.points, geometry.number, parameters.neighbors, part)
        edges = _star_edges(stars)
    progress(STARS_SHARE)
    matrix = _widen(_symmetric(edges, count), parameters.level)
    progress(1.0)
    indptr, indices = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int32, copy=False)
    return Graph(indptr, indices, normals, stars)


def _delaunay_edges(points: Floats) -> Ends:
    """Return the edges of the 3D Delaunay triangulation, and of points it merged into others."""
    triangulation = Delaunay(points)
    start, columns = triangulation.vertex_neighbor_vertices
    rows = np.repeat(np.arange(len(points)), np.diff(start))
    merged, _, nearest = triangulation.coplanar.T
    return np.concatenate([rows, merged]), np.concatenate([columns, nearest])


def _face_edges(faces: Indices) -> Ends:
    """Return the directed edges of all faces."""
    return faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()


def _star_edges(stars: Ints) -> Ends:
    """Return the edges from every vertex to its star."""
    member = stars >= 0
    return np.repeat(np.arange(len(stars)), np.count_nonzero(member, axis=1)), stars[member]


def _loose_stars(
    points: Floats, loose: Indices, neighbors: int, progress: Progress
) -> tuple[Ints, Floats]:
    """Return stars and plane normals over all points, of the `loose` ones among themselves."""
    members, fitted = build_stars(points[loose], np.arange(len(loose)), neighbors, progress)
    normals = np.zeros((len(points), 3))
    normals[loose] = fitted
    stars = np.full((len(points), members.shape[1]), -1, dtype=np.int32)
    stars[loose] = np.where(members >= 0, loose[members], -1)
    return stars, normals


def _symmetric(edges: Ends, count: int) -> sparse.csr_array:
    """Return the adjacency matrix with every edge in both directions, once."""
    ones = np.ones(len(edges[0]), dtype=bool)
    half = sparse.coo_array((ones, edges), shape=(count, count)).tocsr()
    matrix = sparse.csr_array(half + half.T)
    matrix.sort_indices()
    return matrix


def _widen(matrix: sparse.csr_array, level: int) -> sparse.csr_array:
    """Return the graph that joins vertices up to `level` edges apart."""
    if level == 1 or not matrix.shape[0]:
        return matrix
    reach = matrix
    for _ in range(level - 1):
        blocks = [
            reach[start : start + WIDE_BLOCK] @ matrix + reach[start : start + WIDE_BLOCK]
            for start in range(0, matrix.shape[0], WIDE_BLOCK)
        ]
        reach = sparse.csr_array(sparse.vstack(blocks, format="csr"))
    reach.setdiag(False)
    reach.eliminate_zeros()
    reach.sort_indices()
    return reach
