# SPDX-License-Identifier: GPL-3.0-or-later
"""Interest points (paper §4.2, equations 4.3 to 4.7): which points stay for a threshold α."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .blocks import rest_blocks
from .coverage import close_gaps
from .geometry import Floats, Geometry, Indices, sum_by_label
from .graph import Graph
from .parameters import Parameters
from .progress import Rests
from .regions import Regions, build_regions

Mask = NDArray[np.bool_]

STRAIGHT = 1e-9
"""Least turn, in radians, that is told from rounding."""
UNIT = 1e-12
"""Radians in which turns are summed, as whole numbers: their sums round nothing, however many."""
REACHED = 1e-6
"""Share of the angle that may be missing where a sum of turns counts as a multiple of it."""


@dataclass(frozen=True, eq=False)
class Interest:
    """Why each vertex stays; the kept vertices are the union.

    Attributes
    ----------
    extremities : (n,) bool
        Ends, bends and branchings of the regions' boundaries, (4.3) (4.4).
    salient : (n,) bool
        Vertices with ITP = 1, (4.7).
    fillers : (n,) bool
        Low points that the gap rule keeps (figure 11).
    guards : (n,) bool
        Points that the coverage guard adds; none without it.
    """

    extremities: Mask
    salient: Mask
    fillers: Mask
    guards: Mask

    @property
    def kept(self) -> Mask:
        """(n,) bool, all interest points."""
        return self.extremities | self.salient | self.fillers | self.guards


def triangle_areas(first: Floats, second: Floats, third: Floats) -> Floats:
    """Return the areas (m,) of triangles of corners (m, 3): A of (4.4).

    By the cross product; Heron's formula on the sides (4.3) loses all digits on flat triangles.
    """
    cross = np.cross(second - first, third - first)
    area: Floats = 0.5 * np.sqrt(np.einsum("mc,mc->m", cross, cross))
    return area


def boundary_extremities(
    points: Floats, regions: Regions, angle: float, workers: int = 0
) -> Rests[Mask]:
    """Return the boundary vertices that are no mere members of a collinear run, with rests.

    The ends of every chain and the vertices where chains branch stay. Between them a vertex stays
    whenever the turns summed from the chain's start pass a multiple of `angle`. So a straight run
    leaves its two ends, a slow bend still leaves a vertex per `angle`, and no two neighbours are
    dropped for each other's sake.

    Parameters
    ----------
    points : (n, 3) float64
    regions : Regions
    angle : float
        Degrees; 0 keeps every vertex that turns at all.

    Returns
    -------
    (n,) bool
    """
    keep = regions.branching.copy()
    chains = regions.chains
    if not len(chains):
        return keep
    end = np.zeros(len(chains), dtype=bool)
    end[regions.offsets[:-1]] = True
    end[regions.offsets[1:] - 1] = True
    inner = np.flatnonzero(~end)
    turn = np.zeros(len(chains))

    def measure(start: int, stop: int) -> None:
        block = inner[start:stop]
        before, at, after = (points[chains[block + step]] for step in (-1, 0, 1))
        along = np.einsum("mc,mc->m", at - before, after - at)
        turn[block] = np.arctan2(2.0 * triangle_areas(before, at, after), along)

    yield from rest_blocks(measure, len(inner), workers=workers)
    turn[turn < STRAIGHT] = 0.0
    total = np.cumsum(np.rint(turn / UNIT).astype(np.int64))
    total -= np.repeat(total[regions.offsets[:-1]], np.diff(regions.offsets))
    if angle > 0.0:
        # An angle less than the least turn makes every turn pass a multiple, as it is to be.
        step = np.floor(total * (UNIT / max(np.radians(angle), STRAIGHT)) + REACHED)
        bend = step != np.roll(step, 1)
    else:
        bend = turn > 0.0
    keep[chains[bend | end]] = True
    return keep


def segment_steps(
    geometry: Geometry, graph: Graph, saliency: Floats, parameters: Parameters
) -> Rests[tuple[Regions, Mask]]:
    """Return the regions, and the extremities of their boundaries, with rests."""
    workers = parameters.workers
    regions = yield from build_regions(geometry, graph, saliency, parameters.tolerance, workers)
    yield
    extremities = yield from boundary_extremities(
        geometry.points, regions, parameters.collinear_angle, workers
    )
    return regions, extremities


def global_mean(saliency: Floats) -> float:
    """Return GMS of (4.6)."""
    return float(saliency.mean()) if len(saliency) else 0.0


def local_means(saliency: Floats, regions: Regions) -> Floats:
    """Return LMS of every region, (4.5), as (count,) float64."""
    size = np.bincount(regions.labels, minlength=regions.count)
    return np.bincount(regions.labels, saliency, regions.count) / np.maximum(size, 1)


def salient_points(saliency: Floats, regions: Regions, alpha: float, rule: str) -> Mask:
    """Return ITP of (4.7) for every vertex.

    Parameters
    ----------
    saliency : (n,) float64 in [0, 1]
    regions : Regions
    alpha : float
        In per cent. The printed sign keeps more for a larger α, against text and tables; here
        more α keeps fewer.
    rule : {"add", "multiply"}
        The threshold is the smaller mean plus α/100, or times 1 + α/100.
    """
    mean = np.minimum(local_means(saliency, regions), global_mean(saliency))[regions.labels]
    threshold = mean + alpha / 100.0 if rule == "add" else mean * (1.0 + alpha / 100.0)
    # The mean of equal numbers may be larger than they are, by rounding.
    return saliency >= threshold * (1.0 - 1e-12)


def gap_fillers(
    points: Floats, regions: Regions, extremities: Mask, salient: Mask, workers: int = 0
) -> Rests[Mask]:
    """Return the low points that the gap rule keeps (end of §4.2, figure 11), with rests.

    From each boundary interest point halfway to the centre of its region's salient points (of the
    whole region where none is salient), the nearest low point of the same region stays.

    Notes
    -----
    One nearest-neighbour query over all regions at once: the label is a fourth coordinate, in
    steps longer than any distance.
    """
    labels, fillers = regions.labels, np.zeros(len(points), dtype=bool)
    low = np.flatnonzero(~salient & ~extremities)
    edge = np.flatnonzero(extremities)
    if not len(low) or not len(edge):
        return fillers
    yield
    has_salient = np.bincount(labels[salient], minlength=regions.count) > 0
    member = salient | ~has_salient[labels]
    yield
    size = np.maximum(np.bincount(labels[member], minlength=regions.count), 1)
    centre = sum_by_label(points[member], labels[member], regions.count) / size[:, None]
    yield
    # A region without low points has nothing to fill, and would find another region's.
    has_low = np.bincount(labels[low], minlength=regions.count) > 0
    edge = edge[has_low[labels[edge]]]
    places = np.column_stack([points[low], 2.0 * labels[low]])
    yield
    tree = cKDTree(places, balanced_tree=False, compact_nodes=False)
    yield
    nearest = np.empty(len(edge), dtype=np.intp)

    def find(start: int, stop: int) -> None:
        block = edge[start:stop]
        midpoint = 0.5 * (points[block] + centre[labels[block]])
        nearest[start:stop] = tree.query(np.column_stack([midpoint, 2.0 * labels[block]]))[1]

    yield from rest_blocks(find, len(edge), workers=workers)
    fillers[low[nearest]] = True
    return fillers


def select(
    geometry: Geometry,
    graph: Graph,
    saliency: Floats,
    regions: Regions,
    extremities: Mask,
    alpha: float,
    parameters: Parameters,
) -> Rests[tuple[Interest, Indices]]:
    """Return the interest points for a threshold α, and the kept vertex that stands for each.

    It rests between the parts of the work. Where the threshold lies above all saliency, the most
    salient vertex stays without a coverage guard: a result is never empty.

    Returns
    -------
    Interest
    source : (n,) intp
        See `coverage.close_gaps`.

    Notes
    -----
    O(n log n) time; nothing is computed again that does not depend on α.
    """
    salient = salient_points(saliency, regions, alpha, parameters.alpha_rule)
    if not parameters.max_gap and len(salient) and not (salient | extremities).any():
        salient[np.argmax(saliency)] = True
    yield
    fillers = yield from gap_fillers(
        geometry.points, regions, extremities, salient, parameters.workers
    )
    kept = extremities | salient | fillers
    guards, source = yield from close_gaps(
        geometry.points, graph, kept, parameters.max_gap, parameters.workers
    )
    return Interest(extremities, salient, fillers, guards), source
