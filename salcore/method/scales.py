# SPDX-License-Identifier: GPL-3.0-or-later
"""Saliency at every scale: the paper's measure on a hierarchy of contracted graphs.

One ring of neighbours sees one scale, that of the sampling: the same surface sampled more densely
looks flatter, and noise looks like features. So the measure is taken at physical scales, noise is
estimated round every vertex, and each scale counts as far as noise leaves it something to say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.rows import row_mean
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import dot
from ..input.geometry import Geometry
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .contraction import EQUAL, Level, build_levels
from .frames import Frames
from .graph import EdgeBlock, Graph
from .noise import map_noise, normal_noise, smooth_normals
from .patches import FULL_TURN, PERCENT
from .saliency import (
    Saliency,
    deviating,
    edge_deviation,
    entropy,
    patch_saliency,
    scale_saliency,
    signs_count,
    vertex_saliency,
)

HALF_TURN = 50.0
"""Deviation factor, in per cent, of opposite normals."""
FLOOR = 1.2
"""Times the noise that is taken from a map."""
REMAINDER = 0.6
"""Share of the map that is left at least: its order stays."""
ROUNDING = 1e-12
"""Saliency below which it is none: roots and squares leave that of nothing."""
OFFSET = 0.02
"""Saliency and noise too small to matter: no level counts without bound, none wipes out another."""


@dataclass(frozen=True, eq=False)
class Scale:
    """The measure at one scale.

    Attributes
    ----------
    length : float
        Length of the edges that were contracted, in the geometry's unit; 0 for the input itself.
    saliency : (c,) float64
        SL of (3.9) of each cell, before scaling.
    noise : (c,) float64
        What noise alone makes of it.
    cells : (n,) intp
        Cell of each vertex.
    """

    length: float
    saliency: Floats
    noise: Floats
    cells: Indices


@dataclass(frozen=True, eq=False)
class ScaleSpace:
    """Saliency at every scale.

    Attributes
    ----------
    scales : tuple of Scale
        From fine to coarse.
    noise : (n,) float64
        Root of the mean squared angle of noise of the normals round each vertex, in degrees.
    raw : (n,) float64
        The scales together, before scaling.
    scaled : (n,) float64
        In [0, 1]; high is salient.
    """

    scales: tuple[Scale, ...]
    noise: Floats
    raw: Floats
    scaled: Floats


def size_of(points: Floats) -> float:
    """Return the diagonal of the box whose even filling has the points' second moments.

    Unlike that of the bounding box it does not change when the points are turned, and hardly with a
    few stray ones. Measured on scans it is 0.75 to 1.05 of that, mostly 0.9.
    """
    return float(np.sqrt(12.0 * points.var(axis=0).sum())) if len(points) else 0.0


def scale_bounds(geometry: Geometry, parameters: Parameters) -> tuple[float, float]:
    """Return the finest and coarsest length, in the geometry's unit; zero for one level alone."""
    size = size_of(geometry.points)
    unit = geometry.to_unit if parameters.scale_unit == "length" else size / PERCENT
    coarsest = min(parameters.coarsest * unit, size)
    return min(parameters.finest * unit, coarsest), coarsest


def build_scales(
    geometry: Geometry,
    graph: Graph,
    frames: Frames,
    saliency: Saliency,
    parameters: Parameters,
    progress: Progress = SILENT,
) -> ScaleSpace:
    """Return the saliency of every vertex at every scale.

    Parameters
    ----------
    geometry : Geometry
    graph : Graph
    frames : Frames
    saliency : Saliency
        The one-level map, which is the result where `Parameters.coarsest` is 0.
    parameters : Parameters

    Notes
    -----
    O(e) time for e edges: half to all of what the one-level analysis takes.
    """
    finest, coarsest = scale_bounds(geometry, parameters)
    if coarsest == 0.0:
        return ScaleSpace((), np.zeros(len(saliency.raw)), saliency.raw, saliency.scaled)
    levels = build_levels(geometry, graph, frames, coarsest, progress.part(0.0, 0.4))
    noise = normal_noise(levels)
    progress(0.5)
    used = _used(levels, finest, coarsest)
    full = np.radians(max(parameters.deviation_threshold, 1.0) * FULL_TURN / PERCENT)
    maps, part = [], progress.part(0.5, 0.95)
    for k in used:
        maps.append(_measure(levels[k], map_noise(noise[k], levels[k].members, full), parameters))
        part((k - used.start + 1) / len(used))
    raw = _combine(levels, used, maps)
    cells, scales = np.arange(len(geometry.points)), []
    for k in range(used.stop):
        of = levels[k].cell
        cells = cells if of is None else of[cells]
        if k in used:
            scales.append(Scale(levels[k].length, *maps[k - used.start], cells))
    scaled = scale_saliency(raw, parameters.scaling)
    return ScaleSpace(tuple(scales), np.degrees(np.sqrt(noise[0])), raw, scaled)


def _used(levels: tuple[Level, ...], finest: float, coarsest: float) -> range:
    """Return which levels are physical scales: from the one before the first of `finest` on."""
    lengths = np.array([level.length for level in levels])
    stop = int(np.count_nonzero(lengths <= coarsest * (1.0 + EQUAL)))
    first = int(np.count_nonzero(lengths < finest * (1.0 - EQUAL))) - 1
    return range(min(max(first, 0), stop - 1), stop)


def _measure(level: Level, noise: Floats, parameters: Parameters) -> tuple[Floats, Floats]:
    """Return the paper's measure (c,) on one level, and the noise (c,) in it.

    As `saliency.build_saliency`, but for the weight of (3.9): it compares the mean deviation round
    two cells, which says the same as that of their patches in a third of the time.
    """
    normals, noise = smooth_normals(level, noise)
    points, graph, count = level.points, level.graph, len(level.points)
    signed = signs_count(level.oriented, parameters)
    mean, share, patch, raw = (np.empty(count) for _ in range(4))

    def describe(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        factor = _deviation(edges, normals, signed, parameters)
        counted = deviating(factor, parameters.deviation_threshold, parameters.counting)
        mean[edges.vertices] = row_mean(factor, edges.indptr)
        share[edges.vertices] = row_mean(counted, edges.indptr)

    run_blocks(describe, count)
    dissimilarity = entropy(share) if parameters.dissimilarity == "entropy" else share
    spacing = float(np.sqrt(level.area.mean()))

    def compare(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        own, other = dissimilarity.take(edges.row), dissimilarity.take(edges.other)
        height = None
        if parameters.contrast == "difference":
            offsets = points[edges.other] - points[edges.row]
            height = np.abs(dot(offsets, normals[edges.row]))
        patch[edges.vertices] = patch_saliency(own, other, edges.indptr, height, spacing)

    run_blocks(compare, count)

    def gather(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        difference = np.abs(mean.take(edges.other) - mean.take(edges.row))
        weight = np.exp(-difference / HALF_TURN)
        raw[edges.vertices] = vertex_saliency(
            patch.take(edges.other), weight, edges.indptr, parameters.averaging
        )

    run_blocks(gather, count)
    return raw, noise


def _deviation(edges: EdgeBlock, normals: Floats, signed: Mask, parameters: Parameters) -> Floats:
    """Return DF (e,) of edges as `saliency.edge_deviation`, from the chords between normals."""
    if parameters.angle == "squared" or parameters.whole_percent:
        return edge_deviation(edges, normals, signed, parameters)
    first, second = normals.take(edges.row, axis=0), normals.take(edges.other, axis=0)
    if not signed.all():
        product = dot(first, second)
        turn = ~(signed[edges.row] & signed[edges.other]) & (product < 0.0)
        second[turn] *= -1.0
    first -= second
    angle = 2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(dot(first, first)), 1.0))
    # An unknown normal deviates from nothing; its chord to a unit vector is 60 degrees long.
    far = np.flatnonzero(angle > 1.0)
    row, other = normals[edges.row[far]], normals[edges.other[far]]
    angle[far] *= row.any(axis=1) & other.any(axis=1)
    factor: Floats = angle * (PERCENT / (2.0 * np.pi))
    return factor


def _combine(levels: tuple[Level, ...], used: range, maps: list[tuple[Floats, Floats]]) -> Floats:
    """Return the weighted mean (n,) of the levels' saliency without its noise.

    Brought down level by level: copied to the members, then averaged with the neighbours.
    """
    total = weights = np.zeros(len(levels[used.stop - 1].points))
    for k in range(used.stop - 1, -1, -1):
        if k in used:
            saliency, noise = maps[k - used.start]
            rest = saliency**2 - (FLOOR * noise) ** 2
            clean = np.sqrt(np.maximum(rest, (REMAINDER * saliency) ** 2))
            weight = 1.0 / (OFFSET + noise)
            total, weights = total + weight * np.sqrt(clean + OFFSET), weights + weight
        if k > 0:
            both = np.column_stack([total, weights])[levels[k].cell]
            both = 0.5 * (both + levels[k - 1].mean @ both)
            total, weights = both[:, 0], both[:, 1]
    raw: Floats = (total / weights) ** 2 - OFFSET
    raw[raw < ROUNDING] = 0.0
    return raw
