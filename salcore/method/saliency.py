# SPDX-License-Identifier: GPL-3.0-or-later
"""The saliency of every vertex (paper §3.3, equations 3.4 to 3.9)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .blocks import run_blocks
from .frames import Frames
from .geometry import Floats, Geometry
from .graph import Graph
from .parameters import Parameters
from .patches import (
    PERCENT,
    deviation_factor,
    mean_of_cells,
    normal_angle,
    patch_cells,
    patch_side,
)
from .progress import Steps
from .rows import row_mean, row_sum

FAINT = 0.25
"""Least spread that scaling stretches to [0, 1]: below, a map has nothing that stands out, and
stretching it would show the sampling instead."""


@dataclass(frozen=True, eq=False)
class Saliency:
    """Saliency and the quantities it is made of.

    Attributes
    ----------
    deviation : (e,) float64
        Deviation factor DF of every edge of the graph, (3.3), in per cent of a full turn.
    descriptor : (n,) float64
        Mean of the patch's filled cells, A of (3.4), in per cent.
    dissimilarity : (n,) float64
        Share of deviating neighbours, (3.6), or its entropy, (3.7).
    patch : (n,) float64
        Patch saliency, (3.8).
    raw : (n,) float64
        SL of (3.9) before it is scaled.
    scaled : (n,) float64
        SL in [0, 1]; high is salient.
    """

    deviation: Floats
    descriptor: Floats
    dissimilarity: Floats
    patch: Floats
    raw: Floats
    scaled: Floats


def similarity(curvature: Floats, scale: Floats, difference: Floats, deviation: Floats) -> Floats:
    """Return the weight ω of edges (i, j), (3.4), in [0, 1].

    Parameters
    ----------
    curvature, scale : (e,) float64
        Mean curvature K and scale σ (3.5) at the neighbour j. Their product has no unit; the
        printed quotient would change with the unit of length.
    difference : (e,) float64
        A_j - A_i, in per cent; it enters as a share.
    deviation : (e,) float64
        DF of the edge, in per cent; it stands for the printed angle, and is at least 1 to avoid
        the quotient 0/0 of equal normals.
    """
    share = np.abs(difference) / PERCENT
    return np.exp(-np.abs(curvature) * scale * share / np.maximum(deviation, 1.0))


def deviating(deviation: Floats, threshold: float, counting: str) -> Floats:
    """Return how far each neighbour counts into C_x of (3.6), in [0, 1].

    "step" counts deviation factors above the threshold x, as printed. "ramp" counts DF/x up to
    one, so that no neighbour flickers in and out at the threshold; x = 0 makes both the same.
    """
    if counting == "step" or threshold == 0.0:
        return (deviation > threshold).astype(np.float64)
    return np.minimum(deviation, threshold) / threshold


def entropy(probability: Floats) -> Floats:
    """Return -p log2 p, (3.7); zero at p = 0."""
    return -probability * np.log2(np.where(probability > 0.0, probability, 1.0))


def scale_saliency(raw: Floats, scaling: str) -> Floats:
    """Bring raw saliency to [0, 1], after (3.9).

    "range" maps the least and largest value to 0 and 1; all equal gives 0. "percentile" does so
    with the 1st and 99th percentile, which a few outliers cannot move, and takes a spread of at
    least `FAINT`.
    """
    if not len(raw):
        return raw.copy()
    if scaling == "range":
        low, high = raw.min(), raw.max()
        spread = high - low if high > low else 1.0
    else:
        low, high = np.quantile(raw, [0.01, 0.99])
        spread = max(high - low, FAINT)
    scaled: Floats = np.clip((raw - low) / spread, 0.0, 1.0)
    return scaled


def build_saliency(
    geometry: Geometry, graph: Graph, frames: Frames, parameters: Parameters
) -> Steps[Saliency]:
    """Yield the fraction done and return the saliency of every vertex.

    Notes
    -----
    Three passes over the edges in O(e) time, 8 bytes an edge and 40 bytes a vertex for the result.

    Measured on Bunny, Laurana and Rocker arm with Gaussian noise of 0.1 % of the diagonal: the
    rank correlation of clean and noisy maps is 0.40 to 0.74 for the default and -0.15 to 0.32 for
    the printed difference times height; without noise the printed map doubles every crease.
    """
    points, count = geometry.points, len(geometry.points)
    deviation = np.empty(len(graph.indices))
    descriptor, share, patch, raw = (np.empty(count) for _ in range(4))
    oriented = _oriented(frames, parameters)

    def describe(block: _Block) -> None:
        row, other = block.row, block.other
        angle = normal_angle(
            frames.normals[row],
            frames.normals[other],
            oriented[row] & oriented[other],
            squared=parameters.angle == "squared",
        )
        factor = deviation_factor(angle, whole_percent=parameters.whole_percent)
        offsets = points[other] - points[row]
        u = np.einsum("ec,ec->e", offsets, frames.minor[row])
        v = np.einsum("ec,ec->e", offsets, frames.major[row])
        local = row - block.vertices.start
        side = patch_side(u, v, block.indptr)[local]
        cell = patch_cells(u, v, side, parameters.cells)
        deviation[block.edges] = factor
        descriptor[block.vertices] = mean_of_cells(
            factor, cell, local, block.indptr, parameters.cells
        )
        share[block.vertices] = row_mean(
            deviating(factor, parameters.deviation_threshold, parameters.counting), block.indptr
        )

    yield from _pass(describe, graph, parameters, 0.0, 0.6)
    # One length for all vertices: scaling by the range takes it out again, as published.
    spacing = frames.scale.mean() if frames.scale.any() else 1.0
    dissimilarity = entropy(share) if parameters.dissimilarity == "entropy" else share

    def compare(block: _Block) -> None:
        row, other = block.row, block.other
        values = dissimilarity[other]
        if parameters.contrast == "difference":
            height = np.einsum("ec,ec->e", points[other] - points[row], frames.normals[row])
            values = np.abs(values - dissimilarity[row]) * np.abs(height) / spacing
        patch[block.vertices] = row_mean(values, block.indptr)

    yield from _pass(compare, graph, parameters, 0.6, 0.8)

    def gather(block: _Block) -> None:
        row, other = block.row, block.other
        weight = similarity(
            frames.curvature[other],
            frames.scale[other],
            descriptor[other] - descriptor[row],
            deviation[block.edges],
        )
        total = row_sum(patch[other] * weight, block.indptr)
        if parameters.averaging == "weighted":
            weights = row_sum(weight, block.indptr)
            total = np.divide(total, weights, out=np.zeros_like(total), where=weights > 0.0)
        else:
            total /= np.maximum(np.diff(block.indptr), 1)
        raw[block.vertices] = total

    yield from _pass(gather, graph, parameters, 0.8, 1.0)
    scaled = scale_saliency(raw, parameters.scaling)
    return Saliency(deviation, descriptor, dissimilarity, patch, raw, scaled)


@dataclass(frozen=True)
class _Block:
    """The edges of a run of vertices."""

    vertices: slice
    edges: slice
    row: NDArray[np.intp]
    other: NDArray[np.int32]
    indptr: NDArray[np.int64]


def _pass(
    kernel: Callable[[_Block], None],
    graph: Graph,
    parameters: Parameters,
    begin: float,
    end: float,
) -> Steps[None]:
    """Run `kernel` over all blocks, yielding fractions from `begin` to `end`."""

    def run(start: int, stop: int) -> None:
        edges, row, other = graph.edges(start, stop)
        indptr = graph.indptr[start : stop + 1] - edges.start
        kernel(_Block(slice(start, stop), edges, row, other, indptr))

    count = len(graph.indptr) - 1
    for fraction in run_blocks(run, count, workers=parameters.workers):
        yield begin + (end - begin) * fraction


def _oriented(frames: Frames, parameters: Parameters) -> NDArray[np.bool_]:
    """Return where the sign of a normal counts in (3.2)."""
    if parameters.angle in ("auto", "oriented"):
        return frames.oriented
    return np.zeros(len(frames.normals), dtype=bool)
