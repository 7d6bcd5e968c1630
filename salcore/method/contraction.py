# SPDX-License-Identifier: GPL-3.0-or-later
"""Contracted graphs: the surface at coarser and coarser scales, each a graph of cells.

One contraction chooses vertices no two of which are joined by an edge up to some length, lets every
other vertex join the nearest chosen one, and joins the cells that its edges joined.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from ..arrays.blocks import run_blocks
from ..arrays.rows import row_mean
from ..arrays.types import Floats, Indices, Ints, Mask
from ..arrays.vectors import dot, hash01, sum_by_label
from ..input.geometry import Geometry
from ..progress import SILENT, Progress
from .frames import Frames
from .graph import Graph

LEAST_SHRINK = 0.1
"""Share of its vertices that a contraction has to save, else it is left out."""
EQUAL = 1e-9
"""Lengths that differ by less than this share count as equal: rounding must not decide."""
NOISE_MEMBERS = 20.0
"""Vertices of the input a cell that noise is averaged over; levels reach there at least."""
MOST_DOUBLINGS = 48
MOST_SAMPLES = 1 << 16
"""About how many edges the median length is taken of."""


@dataclass(frozen=True, eq=False)
class Level:
    """A graph of cells: the input's vertices at first, then cells of cells.

    Attributes
    ----------
    length : float
        Length of the edges that were contracted; 0 for the input's vertices.
    graph : Graph
        Which cells touch.
    points : (c, 3) float64
        Mean positions, by area.
    normals : (c, 3) float64
        Unit mean normals, by area; zero where there is none. Normals without a sign are
        turned to that of the chosen vertex.
    oriented : (c,) bool
        Whether the normal's sign means something.
    area : (c,) float64
        Sum over the members of the mean squared length of their edges.
    members : (c,) int64
        Vertices of the input in each cell.
    number : (c,) intp
        Number of the vertex that each cell grew round, in the order of the input.
    cell : (p,) intp or None
        Cell of each vertex of the level before; None for the input's vertices.
    """

    length: float
    graph: Graph
    points: Floats
    normals: Floats
    oriented: Mask
    area: Floats
    members: Indices
    number: Indices
    cell: Indices | None = None

    @cached_property
    def mean(self) -> sparse.csr_array:
        """The matrix that averages over a cell's neighbours; of the cell itself without any."""
        count, degrees = len(self.points), self.graph.degrees
        weight = np.repeat(1.0 / np.maximum(degrees, 1), degrees)
        ends = self.graph.indices, self.graph.indptr
        matrix = sparse.csr_array((weight, *ends), shape=(count, count))
        alone = degrees == 0
        if alone.any():
            matrix = sparse.csr_array(matrix + sparse.diags_array(alone.astype(np.float64)))
        return matrix


def build_levels(
    geometry: Geometry,
    graph: Graph,
    frames: Frames,
    coarsest: float,
    progress: Progress = SILENT,
) -> tuple[Level, ...]:
    """Return the input's graph and its contractions, from fine to coarse.

    The lengths are `coarsest` times powers of two: physical scales, whatever the sampling. They
    begin about the median edge, and go on beyond `coarsest` until a cell has `NOISE_MEMBERS`
    vertices, which noise is averaged over.

    Parameters
    ----------
    geometry : Geometry
    graph : Graph
    frames : Frames
    coarsest : float
        Above 0, in the unit of the geometry.

    Notes
    -----
    O(e) time for e edges: each level has about a quarter of the vertices of the one before. The
    independent sets are Luby's (SIAM J. Comput. 15(4), 1986). Priorities are hashed numbers of
    vertices: cells follow from the input's order alone, not from where and how it lies.
    """
    square = _square_lengths(geometry.points, graph)
    count = len(geometry.points)
    area = row_mean(square, graph.indptr)
    area[graph.degrees == 0] = 1.0  # a cell of its own for good: any weight will do
    level = Level(
        0.0,
        graph,
        geometry.points,
        frames.normals,
        frames.oriented,
        area,
        np.ones(count, dtype=np.int64),
        geometry.number,
    )
    levels = [level]
    if not len(square):
        return tuple(levels)
    typical = np.median(square[:: max(len(square) // MOST_SAMPLES, 1)])
    doublings = int(np.rint(0.5 * np.log2(typical) - np.log2(coarsest)))
    doublings = max(doublings, -MOST_DOUBLINGS)
    for exponent in range(doublings, max(doublings, 0) + 8):
        if exponent > 0 and count >= NOISE_MEMBERS * len(level.points):
            break
        contracted = contract(level, float(np.ldexp(coarsest, exponent)), square)
        if contracted is not None:
            levels.append(contracted)
            level = contracted
            square = _square_lengths(level.points, level.graph)
        progress(1.0 - len(level.points) / count)
    return tuple(levels)


def directions(vectors: Floats) -> Floats:
    """Return the unit vectors of vectors (c, 3); zero for none.

    As `vectors.unit` in a third of the time, for what is neither tiny nor huge.
    """
    length = np.sqrt(dot(vectors, vectors))
    inverse = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0.0)
    unit: Floats = vectors * inverse[:, None]
    return unit


def sense(cosine: Floats) -> Floats:
    """Return by what to turn normals without a sign, from their cosines with another: 1 or -1.

    Nearly perpendicular ones count less, so that rounding does not choose between two senses.
    """
    return np.clip(4.0 * cosine, -1.0, 1.0)


def _square_lengths(points: Floats, graph: Graph) -> Floats:
    """Return the squared length (e,) of every edge."""
    square = np.empty(len(graph.indices))

    def measure(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        offsets = points.take(edges.other, axis=0) - points.take(edges.row, axis=0)
        square[edges.edges] = dot(offsets, offsets)

    run_blocks(measure, len(points))
    return square


def contract(level: Level, length: float, square: Floats) -> Level | None:
    """Return a level's contraction over its edges up to `length`; None where it saves too little.

    Parameters
    ----------
    level : Level
    length : float
    square : (e,) float64
        Squared lengths of the level's edges.
    """
    count = len(level.points)
    short = np.flatnonzero(square <= length**2 * (1.0 + EQUAL))
    row = np.repeat(np.arange(count, dtype=np.int32), level.graph.degrees).take(short)
    other = level.graph.indices.take(short)
    if np.count_nonzero(np.bincount(row, minlength=count)) < LEAST_SHRINK * count:
        return None
    priority = hash01(level.number)
    chosen = _independent(row, other, priority)
    centre = _nearest_chosen(row, other, square.take(short), priority, chosen)
    kept = np.flatnonzero(chosen)
    if len(kept) > (1.0 - LEAST_SHRINK) * count:
        return None
    cell = (np.cumsum(chosen) - 1)[centre]
    area: Floats = np.bincount(cell, level.area, len(kept)).astype(np.float64)
    signed = level.oriented & level.oriented[centre]
    cosine = dot(level.normals, level.normals.take(centre, axis=0))
    turn = np.where(signed, 1.0, sense(cosine))
    normals = level.normals * (level.area * turn)[:, None]
    return Level(
        length,
        _cell_graph(level.graph, cell, len(kept)),
        sum_by_label(level.points * level.area[:, None], cell, len(kept)) / area[:, None],
        directions(sum_by_label(normals, cell, len(kept))),
        level.oriented[kept],
        area,
        np.bincount(cell, level.members, len(kept)).astype(np.int64),
        level.number[kept],
        cell,
    )


def _independent(row: Ints, other: Ints, priority: Floats) -> Mask:
    """Return a maximal set of vertices (n,) no two of which are joined; edges stand in rows."""
    chosen = np.zeros(len(priority), dtype=bool)
    free = np.ones(len(priority), dtype=bool)
    waiting = np.arange(len(priority))
    while len(waiting):
        highest = np.full(len(priority), -1.0)
        first = _first_of_rows(row)
        if len(first):
            highest[row[first]] = np.maximum.reduceat(priority[other], first)
        winners = waiting[priority[waiting] > highest[waiting]]
        chosen[winners] = True
        free[winners] = False
        free[other[chosen[row]]] = False
        waiting = waiting[free[waiting]]
        both = np.flatnonzero(free[row] & free[other])
        row, other = row[both], other[both]
    return chosen


def _first_of_rows(row: Ints) -> Indices:
    """Return where runs of equal numbers begin."""
    return np.flatnonzero(np.append(True, row[1:] != row[:-1])[: len(row)])


def _nearest_chosen(
    row: Ints, other: Ints, square: Floats, priority: Floats, chosen: Mask
) -> Indices:
    """Return the chosen vertex (n,) that each one joins: itself, or its nearest neighbour."""
    centre = np.arange(len(priority))
    joins = np.flatnonzero(~chosen[row] & chosen[other])
    row, other, square = row[joins], other[joins], square[joins]
    first = _first_of_rows(row)
    if len(first):
        size = np.diff(np.append(first, len(row)))
        nearest = np.repeat(np.minimum.reduceat(square, first), size)
        rank = np.where(square <= nearest * (1.0 + EQUAL), priority[other], -1.0)
        best = rank == np.repeat(np.maximum.reduceat(rank, first), size)
        centre[row[best]] = other[best]
    return centre


def _cell_graph(graph: Graph, cell: Indices, count: int) -> Graph:
    """Return which cells touch."""
    short = cell.astype(np.int32)
    row, other = np.repeat(short, graph.degrees), short.take(graph.indices)
    apart = np.flatnonzero(row != other)
    ends = (row.take(apart), other.take(apart))
    ones = np.ones(len(apart), dtype=bool)
    matrix = sparse.coo_array((ones, ends), shape=(count, count)).tocsr()
    matrix.sort_indices()
    return Graph(matrix.indptr.astype(np.int64), matrix.indices.astype(np.int32, copy=False))
