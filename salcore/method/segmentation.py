# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of three kinds, numbered by falling saliency, and what is known of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.types import Floats, Indices, Integers, Ints
from ..arrays.vectors import sum_by_label
from ..input.geometry import Geometry
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .basins import find_basins
from .graph import Graph
from .islands import find_islands
from .merging import vertex_areas
from .patches import PERCENT
from .regions import Regions, grow_regions, outline
from .scales import ScaleSpace, size_of

SMALLEST = 5e-4
"""Share of the whole area under which an island or a basin joins a neighbour."""
QUANTUM = 1e-6
"""Mean saliencies this near count as equal where regions are numbered."""


def segment(
    geometry: Geometry,
    graph: Graph,
    scales: ScaleSpace,
    parameters: Parameters,
    progress: Progress = SILENT,
) -> Regions:
    """Return the regions of the kind that `Parameters.segmentation` names, by falling saliency.

    Regions whose mean saliencies are equal come in the order of their first vertices.
    """
    saliency, area = scales.scaled, vertex_areas(geometry, graph)
    smallest = SMALLEST * float(area.sum())
    part = progress.part(0.0, 0.8)
    if parameters.segmentation == "components":
        labels = grow_regions(graph, saliency, parameters.tolerance)
    elif parameters.segmentation == "basins":
        depth = parameters.persistence
        labels = find_basins(graph, geometry.number, area, saliency, depth, smallest, part)
    else:
        size = parameters.region_size / PERCENT * size_of(geometry.points)
        price = 0.5 * parameters.region_contrast**2 * size
        cells = scales.scales[0].cells if scales.scales else np.arange(len(saliency))
        labels = find_islands(geometry.points, graph, cells, area, saliency, price, smallest, part)
    progress(0.8)
    return outline(geometry, graph, _by_saliency(labels, area, saliency, geometry.number))


def _by_saliency(labels: Indices, area: Floats, saliency: Floats, number: Indices) -> Indices:
    """Return labels numbered from 0 by falling mean saliency."""
    count = int(labels.max(initial=-1)) + 1
    total = np.bincount(labels, area, count)
    mean = np.bincount(labels, area * saliency, count) / total
    first = np.full(count, len(labels))
    np.minimum.at(first, labels, number)
    rank = np.empty(count, dtype=np.intp)
    rank[np.lexsort((first, -np.rint(mean / QUANTUM)))] = np.arange(count)
    ordered: Indices = rank[labels]
    return ordered


@dataclass(frozen=True, eq=False)
class RegionTable:
    """The regions, one a row, the most salient first.

    Attributes
    ----------
    points : (r,) int64
        Number of distinct points.
    area : (r,) float64
        In the square of the input's unit.
    mean, largest : (r,) float64
        Of the saliency, in [0, 1]; the mean is by area.
    centre : (r, 3) float64
        Mean position, by area, in the input's unit.
    low, high : (r, 3) float64
        Corners of the bounding box.
    """

    points: Indices
    area: Floats
    mean: Floats
    largest: Floats
    centre: Floats
    low: Floats
    high: Floats

    def __len__(self) -> int:
        return len(self.points)

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return the rows, ready for JSON, each with its number as ``region``."""
        names = tuple(self.__dataclass_fields__)
        columns = [getattr(self, name).tolist() for name in names]
        rows = zip(*columns, strict=True)
        return [{"region": k, **dict(zip(names, row, strict=True))} for k, row in enumerate(rows)]


def describe_regions(
    geometry: Geometry, graph: Graph, regions: Regions, saliency: Floats
) -> RegionTable:
    """Return the table of regions."""
    labels, count, points = regions.labels, regions.count, geometry.points
    area = vertex_areas(geometry, graph)
    total = np.bincount(labels, area, count)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    largest = np.zeros(count)
    np.maximum.at(largest, labels, saliency)
    np.minimum.at(low, labels, points)
    np.maximum.at(high, labels, points)
    centre = sum_by_label(points * area[:, None], labels, count) / total[:, None]
    unit = geometry.to_unit
    with np.errstate(over="ignore", under="ignore"):  # of the largest doubles there is no square
        surface = total / unit / unit
    return RegionTable(
        np.bincount(labels, minlength=count),
        surface,
        np.bincount(labels, area * saliency, count) / total,
        largest,
        *(corner / unit + geometry.centre for corner in (centre, low, high)),
    )


def border_lines(triangles: Integers, labels: Indices) -> Ints:
    """Return edges (s, 2) that run along the borders between regions, each once.

    A triangle with two corners in one region and one in another has one edge along the border; of
    the two sides of a border, that of the more salient region is taken.
    """
    label = labels[triangles]
    pairs = []
    for k in range(3):
        first, second = (triangles[:, (k + c) % 3] for c in range(2))
        one, two, beyond = (label[:, (k + c) % 3] for c in range(3))
        along = (one == two) & (one < beyond)
        pairs.append(np.column_stack([first[along], second[along]]))
    ends = np.sort(np.concatenate(pairs), axis=1)
    lines: Ints = np.unique(ends, axis=0).astype(np.int32)
    return lines
