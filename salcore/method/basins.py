# SPDX-License-Identifier: GPL-3.0-or-later
"""Basins: the watershed of the saliency, merged by persistence; borders run along its ridges."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats, Indices
from ..progress import SILENT, Progress
from .graph import Graph
from .merging import Pairs, absorb_small, edge_pairs


def find_basins(
    graph: Graph,
    number: Indices,
    area: Floats,
    saliency: Floats,
    persistence: float,
    smallest: float,
    progress: Progress = SILENT,
) -> Indices:
    """Return the basin (n,) of every vertex.

    Every vertex belongs to the minimum that steepest descent leads to. A basin whose minimum lies
    less than `persistence` under its lowest pass joins the one beyond, if that is deeper
    (Edelsbrunner, Letscher and Zomorodian, Discrete Comput. Geom. 28, 2002).

    Parameters
    ----------
    graph : Graph
    number : (n,) intp
        Numbers that decide between vertices of equal saliency.
    area, saliency : (n,) float64
    persistence : float
    smallest : float
        Area under which a region joins its most similar neighbour.

    Notes
    -----
    O(e log n) time for e edges: a logarithmic number of rounds.
    """
    height = np.empty(len(saliency), dtype=np.intp)  # ranks: no two are equal
    height[np.lexsort((number, saliency))] = np.arange(len(saliency))
    bottom, labels = _descend(graph, height)
    progress(0.3)
    first, second, row, other = edge_pairs(graph, labels)
    passes = np.maximum(saliency[row], saliency[other])
    pairs = Pairs.gathered(first, second, passes, len(bottom), np.minimum)
    while True:
        target = _deeper(pairs, saliency[bottom], height[bottom], persistence)
        kept = target == np.arange(len(target))
        if kept.all():
            break
        target = _roots(target)
        place = (np.cumsum(kept) - 1)[target]
        labels, bottom = place[labels], bottom[kept]
        pairs = Pairs.gathered(
            place[pairs.low], place[pairs.high], pairs.value, len(bottom), np.minimum
        )
    progress(0.8)
    total: Floats = np.bincount(labels, area).astype(np.float64)
    mean = np.bincount(labels, area * saliency) / total
    return absorb_small(labels, pairs, total, mean, smallest)


def _descend(graph: Graph, height: Indices) -> tuple[Indices, Indices]:
    """Return the minima, and which of them (n,) steepest descent leads each vertex to."""
    vertex = np.empty(len(height), dtype=np.intp)
    vertex[height] = np.arange(len(height))
    least = height.copy()
    filled = np.flatnonzero(graph.degrees)
    if len(filled):
        near = np.minimum.reduceat(height[graph.indices], graph.indptr[filled])
        least[filled] = np.minimum(least[filled], near)
    lowest = vertex[least]
    end = _roots(lowest)
    bottom = np.flatnonzero(lowest == np.arange(len(lowest)))
    place = np.empty(len(height), dtype=np.intp)
    place[bottom] = np.arange(len(bottom))
    return bottom, place[end]


def _roots(target: Indices) -> Indices:
    """Return where following `target` ends, by pointer jumping."""
    while True:
        further = target[target]
        if (further == target).all():
            return target
        target = further


def _deeper(pairs: Pairs, depth: Floats, height: Indices, persistence: float) -> Indices:
    """Return the basin that each one joins over its lowest pass; itself for none."""
    target = np.arange(len(depth))
    first = np.concatenate([pairs.low, pairs.high])
    second = np.concatenate([pairs.high, pairs.low])
    value = np.concatenate([pairs.value, pairs.value])
    order = np.lexsort((height[second], value, first))
    first, second, value = first[order], second[order], value[order]
    one = np.flatnonzero(np.append(True, first[1:] != first[:-1])[: len(first)])
    first, second, value = first[one], second[one], value[one]
    joins = (value - depth[first] < persistence) & (height[second] < height[first])
    target[first[joins]] = second[joins]
    return target
