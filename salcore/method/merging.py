# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions that merge: their areas, the borders between them, and small ones that join others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..arrays.edges import edge_key
from ..arrays.rows import row_mean
from ..arrays.types import Floats, Indices, Integers
from ..arrays.vectors import dot, face_normals
from ..input.geometry import Geometry
from .graph import Graph

CELL = 0.75**0.5
"""Area of a hexagonal cell by the square of the distance of its neighbours."""
BORDER = 3.0**-0.5
"""Length of a hexagonal cell's side by that distance."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of regions that touch, each once.

    Attributes
    ----------
    low, high : (p,) intp
        The regions, ``low < high``, sorted.
    value : (p,) float64
        Length of the border, or height of the pass.
    """

    low: Indices
    high: Indices
    value: Floats

    @classmethod
    def gathered(
        cls, first: Integers, second: Integers, value: Floats, count: int, combine: np.ufunc
    ) -> Pairs:
        """Return the pairs of regions below `count`; values of one pair are combined."""
        apart = np.flatnonzero(first != second)
        key = edge_key(first[apart], second[apart], count)
        order = np.argsort(key, kind="stable")
        key = key[order]
        begin = np.flatnonzero(np.append(True, key[1:] != key[:-1])[: len(key)])
        low, high = np.divmod(key[begin], max(count, 1))
        values = value[apart[order]]
        total = combine.reduceat(values, begin) if len(begin) else values[:0]
        return cls(low, high, total)


def vertex_areas(geometry: Geometry, graph: Graph) -> Floats:
    """Return the area (n,) round each vertex: a third of its faces', else of a hexagonal cell."""
    points, faces = geometry.points, geometry.faces
    count = len(points)
    loose = np.bincount(faces.ravel(), minlength=count) == 0
    area = np.zeros(count)
    if len(faces):
        normal = face_normals(points, faces)
        third = np.sqrt(dot(normal, normal)) / 6.0
        area += np.bincount(faces.ravel(), np.repeat(third, 3), count)
    if loose.any():
        offsets = points.take(graph.indices, axis=0) - np.repeat(points, graph.degrees, axis=0)
        area[loose] = CELL * row_mean(dot(offsets, offsets), graph.indptr)[loose]
    least = 1e-3 * area.mean() if area.any() else 1.0
    return np.maximum(area, least)


def edge_pairs(graph: Graph, labels: Indices) -> tuple[Indices, Indices, Integers, Integers]:
    """Return the regions and the vertices at both ends of the edges between regions, each once."""
    row = np.repeat(np.arange(len(labels), dtype=np.int32), graph.degrees)
    first, second = labels.take(row), labels.take(graph.indices)
    between = np.flatnonzero((row < graph.indices) & (first != second))
    return first[between], second[between], row[between], graph.indices[between]


def connected(low: Indices, high: Indices, count: int) -> Indices:
    """Return the number (count,) of the group that each region is in, joined by pairs."""
    links = sparse.coo_array((np.ones(len(low)), (low, high)), shape=(count, count))
    return csgraph.connected_components(links, directed=False)[1].astype(np.intp)


def absorb_small(
    labels: Indices, pairs: Pairs, area: Floats, mean: Floats, smallest: float
) -> Indices:
    """Return labels where regions under an area have joined the neighbour of most like saliency.

    Parameters
    ----------
    labels : (n,) intp
    pairs : Pairs
    area, mean : (r,) float64
        Of every region.
    smallest : float
        Regions that touch none stay, however small.
    """
    while True:
        count = len(area)
        first = np.concatenate([pairs.low, pairs.high])
        second = np.concatenate([pairs.high, pairs.low])
        small = np.flatnonzero(area[first] < smallest)
        if not len(small):
            return labels
        first, second = first[small], second[small]
        order = np.lexsort((second, np.abs(mean[first] - mean[second]), first))
        first, second = first[order], second[order]
        one = np.append(True, first[1:] != first[:-1])
        ends = (first[one], second[one])
        joined = connected(*ends, count)
        total: Floats = np.bincount(joined, area).astype(np.float64)
        mean = np.bincount(joined, area * mean) / total
        area, labels = total, joined[labels]
        pairs = Pairs.gathered(
            joined[pairs.low], joined[pairs.high], pairs.value, len(area), np.add
        )
