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
from scipy.spatial import Delaunay, QhullError, cKDTree

from .blocks import rest_blocks, run_blocks
from .geometry import Floats, Geometry, Indices
from .parameters import Parameters
from .planes import fit_normals, tangent_basis
from .progress import Rests, Steps

STAR_BLOCK = 4096
WIDE_BLOCK = 1 << 15
STARS_SHARE = 0.9  # of the time that building a graph takes
NUDGE = 2.5e-5
"""Share of the squared distance to the nearest point by which points are told apart that lie on one
circle. Like powers on all its four points let a square's two triangles be the same in all stars,
and keep rounding from choosing between them. They follow from the numbers of the points: a
lattice's diagonals are the same wherever it lies, but not in whatever order its points come."""
COCIRCULAR = 1e-9
FEWEST = 3
"""Nearest points that a star is sought among at least, though it be a tie which they are."""


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
    indices: NDArray[np.int32]
    plane_normals: Floats | None = None
    stars: NDArray[np.int32] | None = None

    @property
    def degrees(self) -> NDArray[np.int64]:
        """Number of neighbours of each vertex."""
        return np.diff(self.indptr)

    def rows(self, start: int = 0, stop: int | None = None) -> Indices:
        """Return the row of every edge of the vertices from `start` to `stop`."""
        stop = len(self.indptr) - 1 if stop is None else stop
        return np.repeat(np.arange(start, stop), np.diff(self.indptr[start : stop + 1]))

    def edges(self, start: int, stop: int) -> tuple[slice, Indices, NDArray[np.int32]]:
        """Return where the edges of the vertices from `start` to `stop` are, and their two ends."""
        where = slice(int(self.indptr[start]), int(self.indptr[stop]))
        return where, self.rows(start, stop), self.indices[where]

    def matrix(self) -> sparse.csr_array:
        """Return the adjacency matrix; it shares the graph's arrays."""
        count = len(self.indptr) - 1
        ones = np.ones(len(self.indices), dtype=np.int8)
        return sparse.csr_array((ones, self.indices, self.indptr), shape=(count, count))


def build_graph(geometry: Geometry, parameters: Parameters) -> Steps[Graph]:
    """Yield the fraction done and return the neighbourhood graph of `geometry`.

    Notes
    -----
    Surface graphs take O(n log n) time and about 250 bytes a point. The 3D Delaunay triangulation
    takes some 25 microseconds and 2 kB a point; where there is none, because the points span no
    volume or qhull cannot tell them apart, the stars take its place.
    """
    points, count = geometry.points, len(geometry.points)
    normals: Floats | None = None
    stars: NDArray[np.int32] | None = None
    if parameters.graph == "delaunay" and count:
        yield 0.0
        try:
            edges = _delaunay_edges(points)
        except (QhullError, MemoryError):  # which qhull says of points too close to each other
            stars_instead, _ = yield from _build_stars(points, parameters)
            edges = yield from _edges(stars_instead)
    elif len(geometry.faces):
        edges = _face_edges(geometry.faces)
        yield None
        loose = np.flatnonzero(np.bincount(geometry.faces.ravel(), minlength=count) == 0)
        yield None
        if len(loose):
            local, fitted = yield from _build_stars(points[loose], parameters)
            normals = np.zeros((count, 3))
            normals[loose] = fitted
            stars = np.full((count, local.shape[1]), -1, dtype=np.int32)
            stars[loose] = np.where(local >= 0, loose[local], -1)
            rows, columns = yield from _edges(stars)
            edges = np.concatenate([edges[0], rows]), np.concatenate([edges[1], columns])
    else:
        stars, normals = yield from _build_stars(points, parameters)
        edges = yield from _edges(stars)
    yield STARS_SHARE
    matrix = yield from _symmetric(edges, count, parameters.workers)
    matrix = yield from _widen(matrix, parameters.level)
    yield None
    return Graph(
        matrix.indptr.astype(np.int64), matrix.indices.astype(np.int32, copy=False), normals, stars
    )


Edges = tuple[NDArray[np.integer], NDArray[np.integer]]


def _face_edges(faces: Indices) -> Edges:
    """Return the directed edges of all faces."""
    return faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()


def _delaunay_edges(points: Floats) -> Edges:
    """Return the edges of the 3D Delaunay triangulation, and of points it merged into others."""
    triangulation = Delaunay(points)
    start, columns = triangulation.vertex_neighbor_vertices
    rows = np.repeat(np.arange(len(points)), np.diff(start))
    merged, _, nearest = triangulation.coplanar.T
    return np.concatenate([rows, merged]), np.concatenate([columns, nearest])


def _symmetric(edges: Edges, count: int, workers: int) -> Rests[sparse.csr_array]:
    """Return the adjacency matrix with every edge in both directions, once."""
    ones = np.ones(len(edges[0]), dtype=np.int8)
    entries = sparse.coo_array((ones, edges), shape=(count, count))
    yield
    entries.has_canonical_format = True  # it has not, but that is put right block by block
    half = entries.tocsr()
    yield
    other = half.T.tocsr()
    yield
    blocks: list[sparse.csr_array] = [half] * -(-count // WIDE_BLOCK)

    def add(start: int, stop: int) -> None:
        one, two = half[start:stop], other[start:stop]
        one.sum_duplicates()
        two.sum_duplicates()
        blocks[start // WIDE_BLOCK] = one + two

    yield from rest_blocks(add, count, workers=workers, size=WIDE_BLOCK)
    matrix = sparse.csr_array(sparse.vstack(blocks, format="csr") if blocks else half)
    yield
    matrix.sort_indices()
    return matrix


def _widen(matrix: sparse.csr_array, level: int) -> Rests[sparse.csr_array]:
    """Return the graph that joins vertices up to `level` edges apart."""
    if level == 1 or not matrix.shape[0]:
        return matrix
    step = sparse.csr_array(matrix.astype(bool))
    reach = step
    for _ in range(level - 1):
        blocks = []
        for start in range(0, step.shape[0], WIDE_BLOCK):
            block = reach[start : start + WIDE_BLOCK]
            blocks.append(block @ step + block)
            yield
        reach = sparse.csr_array(sparse.vstack(blocks, format="csr"))
        yield
    reach.setdiag(False)
    yield
    reach.eliminate_zeros()
    yield
    reach.sort_indices()
    return reach


def _edges(stars: NDArray[np.int32]) -> Rests[Edges]:
    """Return the edges from every vertex to its star."""
    member = stars >= 0
    yield
    rows = np.repeat(np.arange(len(stars)), np.count_nonzero(member, axis=1))
    yield
    return rows, stars[member]


def _build_stars(points: Floats, parameters: Parameters) -> Steps[tuple[NDArray[np.int32], Floats]]:
    """Yield the fraction done; return the stars, as in `Graph`, and their planes' normals."""
    count = len(points)
    width = min(parameters.neighbors, count - 1)
    normals = np.zeros((count, 3))
    if width < 1:
        return np.empty((count, 0), dtype=np.int32), normals
    yield None
    tree = cKDTree(points)
    yield None
    nearest = np.empty((count, width), dtype=np.int32)
    powers, reach = np.empty(count), np.empty(count)
    stars = np.full((count, width), -1, dtype=np.int32)

    def search(start: int, stop: int) -> None:
        # The tree's own order keeps the points of a block together in space.
        block = tree.indices[start:stop]
        distance, found = map(np.asarray, tree.query(points[block], k=width + 2))
        nearest[block] = _without_self(found[:, :-1], block)
        reach[block] = distance[:, -1] ** 2
        powers[block] = NUDGE * distance[:, 1] ** 2 * scrambled(block)

    def choose(start: int, stop: int) -> None:
        block = tree.indices[start:stop]
        other = nearest[block]
        offsets = points[other] - points[block, None, :]
        square = np.einsum("bkc,bkc->bk", offsets, offsets)
        near = _nearer(square, reach[block])
        nudged = square + powers[block, None] - powers[other]
        normals[block], row, slot = _stars(offsets, nudged, near)
        place = np.arange(len(row)) - np.searchsorted(row, row)
        stars[block[row], place] = other[row, slot]

    for done in run_blocks(search, count, workers=parameters.workers, size=STAR_BLOCK):
        yield 0.4 * done
    for done in run_blocks(choose, count, workers=parameters.workers, size=STAR_BLOCK):
        yield 0.4 + (STARS_SHARE - 0.4) * done
    widest = int(np.count_nonzero(stars >= 0, axis=1).max())
    yield None
    stars = np.ascontiguousarray(stars[:, :widest])
    yield None
    return stars, normals


def _without_self(found: Indices, block: Indices) -> Indices:
    """Drop each point itself from its nearest points (else the farthest), keeping the order."""
    keep = found != block[:, None]
    keep[keep.all(axis=1), -1] = False
    other: Indices = found[keep].reshape(len(found), -1)
    return other


def scrambled(vertices: NDArray[np.integer]) -> Floats:
    """Return a number in [0, 1) for each vertex number, far apart for neighbouring ones."""
    # Murmur3's last steps permute the numbers of 32 bits. A product alone would not do: it gives
    # the two diagonals of a lattice's square the same sum.
    number: NDArray[np.uint32] = vertices.astype(np.uint32)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        number = (number ^ (number >> np.uint32(shift))) * np.uint32(factor)
    return number / 2.0**32


def _nearer(square: Floats, reach: Floats) -> NDArray[np.bool_]:
    """Return which squared distances (b, k) are less than those of the next points (b,).

    Where others are as far, rounding would decide which of them are among the k nearest, so none
    of them is; unless there would be too few left.
    """
    near: NDArray[np.bool_] = square < (1.0 - COCIRCULAR) * reach[:, None]
    near[np.count_nonzero(near, axis=1) < FEWEST] = True
    return near


def _stars(
    offsets: Floats, square: Floats, near: NDArray[np.bool_]
) -> tuple[Floats, Indices, Indices]:
    """Return plane normals (b, 3) of nearest points at `offsets` (b, k, 3), and the stars.

    The stars come as the rows and slots of their members in `offsets`, by row and angle. Only the
    offsets that are `near` (b, k) count.

    The star of the origin in a Delaunay triangulation consists of the vertices of the convex hull
    of the other points after inversion in a circle round the origin. Inverting in a sphere and
    projecting then does the same in the plane, and pushes points off the plane back. Differences
    of powers in the squared distances `square` (b, k) make it the regular triangulation.
    """
    centred = np.concatenate([offsets, np.zeros_like(offsets[:, :1])], axis=1)
    all_near = near.all()
    if all_near:
        centred -= centred.mean(axis=1, keepdims=True)
    else:
        weight = np.concatenate([near, np.ones_like(near[:, :1])], axis=1)[:, :, None]
        centred *= weight
        centred -= centred.sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
        centred *= weight
    normals = fit_normals(np.matmul(centred.transpose(0, 2, 1), centred))
    frame = np.stack(tangent_basis(normals), axis=2)
    inverted = np.matmul(offsets, frame) / square[:, :, None]
    x, y = inverted[:, :, 0], inverted[:, :, 1]
    order = np.argsort(_pseudo_angle(x, y), axis=1)
    width = order.shape[1]
    flat = (order + np.arange(0, order.size, width)[:, None]).ravel()
    if not all_near:
        flat = flat[near.ravel()[flat]]
    hull = _hull_vertices(x.ravel()[flat], y.ravel()[flat], flat // width)
    return normals, flat[hull] // width, flat[hull] % width


def _pseudo_angle(x: Floats, y: Floats) -> Floats:
    """Return a number that grows with the angle of (x, y), without trigonometry."""
    total = np.abs(x) + np.abs(y)
    cosine = np.divide(x, total, out=np.zeros_like(x), where=total > 0.0)
    angle: Floats = np.copysign(1.0 - cosine, y)
    return angle


def _on_ray(
    x: Floats, y: Floats, other_x: Floats, other_y: Floats
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which points lie on the same ray from the origin as others, and which nearer to it."""
    along = x * other_x + y * other_y
    across = np.abs(x * other_y - y * other_x)
    on_ray = across <= COCIRCULAR * along
    return on_ray, on_ray & (x * x + y * y < along)


def _hull_vertices(x: Floats, y: Floats, row: Indices) -> Indices:
    """Return the positions of the hull vertices of many small point sets at once.

    Points of one set share a `row`, are sorted by angle round the origin, and the origin counts
    as a member. A point inside the triangle of the origin and its two neighbours in angle is no
    hull vertex, nor is one behind another; dropping all such points again and again leaves the
    hulls.
    """
    alive = np.arange(len(row))
    done: list[Indices] = []
    while len(alive):
        last = np.append(row[1:] != row[:-1], True)
        first = np.roll(last, 1)
        after, before = np.arange(1, len(row) + 1), np.arange(-1, len(row) - 1)
        after[last], before[first] = np.flatnonzero(first), np.flatnonzero(last)
        ax, ay, cx, cy = x[before], y[before], x[after], y[after]
        span = ax * cy - ay * cx
        turn = (x - ax) * (cy - y) - (y - ay) * (cx - x)
        inside = (span > 0.0) & (turn < -COCIRCULAR * span)
        # The turn between two points on one ray is rounding: there the nearer to the origin goes.
        (on_one, shadow), (on_other, other_shadow) = _on_ray(x, y, ax, ay), _on_ray(x, y, cx, cy)
        inside = (inside & ~on_one & ~on_other) | shadow | other_shadow
        # Sets that lost no point are finished; the others go round again without the lost ones.
        busy = np.logical_or.reduceat(inside, np.flatnonzero(first))
        again = np.repeat(busy, np.diff(np.append(np.flatnonzero(first), len(row))))
        done.append(alive[~again])
        stay = again & ~inside
        alive, x, y, row = alive[stay], x[stay], y[stay], row[stay]
    return np.sort(np.concatenate(done))
