# SPDX-License-Identifier: GPL-3.0-or-later
"""Interest points (paper §4.2, equations 4.3 to 4.7): which points stay for a threshold α."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..arrays.blocks import worker_count
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import cross, dot, sum_by_label
from ..input.geometry import Geometry
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .coverage import close_gaps
from .graph import Graph
from .regions import Regions

STRAIGHT = 1e-9
"""Least turn, in radians, that is told from rounding."""
TURN_QUANTUM = 1e-12
"""Radians in which turns are summed, as whole numbers: their sums round nothing, however many."""
TURN_SLACK = 1e-6
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
    normal = cross(second - first, third - first)
    area: Floats = 0.5 * np.sqrt(dot(normal, normal))
    return area


def boundary_extremities(points: Floats, regions: Regions, angle: float) -> Mask:
    """Return the boundary vertices that are no mere members of a collinear run.

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
    turn = _turns(points[chains], ~end)
    total = np.cumsum(np.rint(turn / TURN_QUANTUM).astype(np.int64))
    total -= np.repeat(total[regions.offsets[:-1]], np.diff(regions.offsets))
    if angle > 0.0:
        # An angle less than the least turn makes every turn pass a multiple, as it is to be.
        step = np.floor(total * (TURN_QUANTUM / max(np.radians(angle), STRAIGHT)) + TURN_SLACK)
        bend = step != np.roll(step, 1)
    else:
        bend = turn > 0.0
    keep[chains[bend | end]] = True
    return keep


def _turns(chain: Floats, inner: Mask) -> Floats:
    """Return by what angle (c,) chains of points (c, 3) turn at their inner ones; zero at ends."""
    at = np.flatnonzero(inner)
    before, here, after = chain[at - 1], chain[at], chain[at + 1]
    angle = np.arctan2(2.0 * triangle_areas(before, here, after), dot(here - before, after - here))
    turn = np.zeros(len(chain))
    turn[at] = np.where(angle < STRAIGHT, 0.0, angle)
    return turn


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


def gap_fillers(points: Floats, regions: Regions, extremities: Mask, salient: Mask) -> Mask:
    """Return the low points that the gap rule keeps (end of §4.2, figure 11).

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
    has_salient = np.bincount(labels[salient], minlength=regions.count) > 0
    member = salient | ~has_salient[labels]
    size = np.maximum(np.bincount(labels[member], minlength=regions.count), 1)
    centre = sum_by_label(points[member], labels[member], regions.count) / size[:, None]
    # A region without low points has nothing to fill, and would find another region's.
    has_low = np.bincount(labels[low], minlength=regions.count) > 0
    edge = edge[has_low[labels[edge]]]
    places = np.column_stack([points[low], 2.0 * labels[low]])
    tree = cKDTree(places, balanced_tree=False, compact_nodes=False)
    midpoint = 0.5 * (points[edge] + centre[labels[edge]])
    queries = np.column_stack([midpoint, 2.0 * labels[edge]])
    fillers[low[tree.query(queries, workers=worker_count())[1]]] = True
    return fillers


def select(
    geometry: Geometry,
    graph: Graph,
    saliency: Floats,
    regions: Regions,
    extremities: Mask,
    alpha: float,
    parameters: Parameters,
    progress: Progress = SILENT,
) -> tuple[Interest, Indices]:
    """Return the interest points for a threshold α, and the kept vertex that stands for each.

    Where the threshold lies above all saliency, the most salient vertex stays without a coverage
    guard: a result is never empty.

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
        most = np.flatnonzero(saliency == saliency.max())
        salient[most[np.argmin(geometry.number[most])]] = True
    fillers = gap_fillers(geometry.points, regions, extremities, salient)
    progress(0.3)
    kept = extremities | salient | fillers
    guards, source = close_gaps(geometry, graph, kept, parameters.max_gap, progress.part(0.3, 1.0))
    return Interest(extremities, salient, fillers, guards), source
