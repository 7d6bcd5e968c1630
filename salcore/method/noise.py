# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise of the normals, estimated round every vertex, and what it makes of the measure."""

from __future__ import annotations

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.rows import row_sum
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import cross, dot
from .contraction import NOISE_MEMBERS, Level, directions, sense
from .graph import Graph
from .planes import mean_offset

LEAST = 1e-12
"""Least squared angle, in radians, that is told from none."""
NEIGHBORS_SHARE, CELLS_SHARE = 3.2, 8.0
"""Mean squared angle between the normals of neighbours, and of cells of m vertices: this, and this
over m, times the noise's. Fitted on planes with three strengths of noise and two densities."""
MEAN_OF_SQUARE = 0.886
"""Mean of an angle by the root of its mean square, where noise in two directions makes it."""
HALFWAY = 0.1
"""Noise of a map at which smoothing has half its strength."""


def mean_normals(level: Level, normals: Floats) -> Floats:
    """Return the mean (c, 3) of the neighbours' normals.

    Those without a sign are turned to the cell's own, see `contraction.sense`.
    """
    graph, oriented = level.graph, level.oriented
    if oriented.all():
        mean: Floats = level.mean @ normals
        return mean
    result = np.empty_like(normals)

    def average(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        row, other = edges.row, edges.other
        near = normals.take(other, axis=0)
        cosine = dot(near, normals.take(row, axis=0))
        near *= np.where(oriented[row] & oriented[other], 1.0, sense(cosine))[:, None]
        result[edges.vertices] = mean_offset(near, edges.indptr)

    run_blocks(average, len(normals))
    return result


def normal_noise(levels: tuple[Level, ...]) -> tuple[Floats, ...]:
    """Return the mean squared angle of noise of the input's normals, for the cells of each level.

    A vertex's normal is compared with the surface without it: the first contraction's normals,
    smoothed. The squares of the angles are averaged in cells of some 20 vertices, and then
    harmonically over a cell and its neighbours: creases are lines and drop out, noise is
    everywhere and stays.

    Returns
    -------
    tuple of (c,) float64
        In square radians.
    """
    base = levels[0]
    if len(levels) == 1:
        return (np.zeros(len(base.points)),)
    smooth = levels[1].normals[_cells(levels[1])]
    for _ in range(2):
        average = mean_normals(base, smooth)
        degrees = base.graph.degrees[:, None]
        smooth = directions((average * degrees + smooth) / (degrees + 1))
    residual = _square_angles(base.normals, smooth, base.oriented)
    sizes = np.array([len(base.points) / len(level.points) for level in levels])
    middle = int(np.argmin(np.abs(np.log(sizes / NOISE_MEMBERS))))
    noise: list[Floats] = [residual]
    for k, level in enumerate(levels[1:], 1):
        noise.append(_mean_of_members(noise[-1], levels[k - 1], level))
        if k == middle:
            noise[k] = _among_neighbors(level.graph, noise[k])
    for k in range(middle, 0, -1):
        noise[k - 1] = noise[k][levels[k].cell]
    return tuple(noise)


def _cells(level: Level) -> Indices:
    assert level.cell is not None
    return level.cell


def _square_angles(first: Floats, second: Floats, oriented: Mask) -> Floats:
    """Return the squared angles (n,) between unit normals, zero where one is unknown."""
    product, normal = dot(first, second), cross(first, second)
    sine = np.sqrt(dot(normal, normal))
    angle: Floats = np.arctan2(sine, np.where(oriented, product, np.abs(product)))
    return angle**2


def _mean_of_members(values: Floats, finer: Level, level: Level) -> Floats:
    """Return the mean over the input's vertices in each cell of values of the level before."""
    total = np.bincount(_cells(level), values * finer.members, len(level.points))
    return total / level.members


def _among_neighbors(graph: Graph, values: Floats) -> Floats:
    """Return the harmonic mean over each cell and its neighbours, taken twice."""
    for _ in range(2):
        inverse = 1.0 / np.maximum(values, LEAST)
        total = inverse + row_sum(inverse[graph.indices], graph.indptr)
        values = (graph.degrees + 1) / total
    return values


def map_noise(noise: Floats, members: Indices, full: float) -> Floats:
    """Return what noise alone makes of the share of deviating neighbours, (3.6).

    Parameters
    ----------
    noise : (c,) float64
        Mean squared angle, in square radians, of the input's normals.
    members : (c,) int64
        Vertices of the input in each cell.
    full : float
        Angle, in radians, from which a neighbour counts in full.
    """
    square = noise * np.minimum(NEIGHBORS_SHARE, CELLS_SHARE / members)
    result: Floats = np.minimum(MEAN_OF_SQUARE * np.sqrt(square) / full, 1.0)
    return result


def smooth_normals(level: Level, noise: Floats) -> tuple[Floats, Floats]:
    """Return normals (c, 3), smoothed as far as the map is noisy, and the noise (c,) that is left.

    Parameters
    ----------
    level : Level
    noise : (c,) float64
        As `map_noise` returns it.
    """
    strength = noise / (noise + HALFWAY)
    average = mean_normals(level, level.normals)
    normals = directions(level.normals + 2.0 * strength[:, None] * average)
    return normals, noise / (1.0 + 1.5 * strength)
