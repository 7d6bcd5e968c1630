# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands: regions merged while a piecewise constant saliency fits them, (4.1) between regions."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats, Indices
from ..arrays.vectors import dot, hash01
from ..progress import SILENT, Progress
from .graph import Graph
from .merging import BORDER, Pairs, absorb_small, connected, edge_pairs

FREE = 1e-20
"""Cost as a share of the price that is nothing but rounding."""


def find_islands(
    points: Floats,
    graph: Graph,
    cells: Indices,
    area: Floats,
    saliency: Floats,
    price: float,
    smallest: float,
    progress: Progress = SILENT,
) -> Indices:
    """Return the island (n,) of every vertex.

    Two regions a and b are joined while that costs less than their border is worth: the cost by
    length of the border is ``a_a a_b / (a_a + a_b) (mean_a - mean_b)² / length_ab``, with areas a
    and mean saliencies, which is the rule of Mumford and Shah (Comm. Pure Appl. Math. 42(5), 1989)
    as Koepfler, Lopez and Morel merge by it (SIAM J. Numer. Anal. 31(1), 1994). So the tolerance of
    (4.1) falls as regions grow: no chain climbs a slope, and no speck stays.

    Parameters
    ----------
    points : (n, 3) float64
    graph : Graph
    cells : (n,) intp
        Cells that the regions start from.
    area, saliency : (n,) float64
    price : float
        Worth of a border by its length.
    smallest : float
        Area under which a region joins its most similar neighbour.

    Notes
    -----
    In each round the pairs are joined of which neither has a cheaper one. The rounds are many, most
    of them on short lists: in all about ten times the work on the first list. Where a saliency is
    the same all over, as on flat sides, pairs cost nothing, and are joined all at once.
    """
    count = int(cells.max(initial=-1)) + 1
    total: Floats = np.bincount(cells, area, count).astype(np.float64)
    mass: Floats = np.bincount(cells, area * saliency, count).astype(np.float64)
    labels, pairs = cells, _borders(points, graph, cells, count)
    while True:
        cost = _costs(pairs, total, mass)
        free = np.flatnonzero(cost <= FREE * price)
        if len(free):
            place = connected(pairs.low[free], pairs.high[free], len(total))
        else:
            low, high = _cheapest(pairs, cost, len(total), price)
            if not len(low):
                break
            target = np.arange(len(total))
            target[high] = low
            place = (np.cumsum(target == np.arange(len(target))) - 1)[target]
        labels = place[labels]
        total = np.bincount(place, total).astype(np.float64)
        mass = np.bincount(place, mass).astype(np.float64)
        pairs = Pairs.gathered(place[pairs.low], place[pairs.high], pairs.value, len(total), np.add)
        progress(1.0 - len(total) / max(count, 1))
    return absorb_small(labels, pairs, total, mass / total, smallest)


def _borders(points: Floats, graph: Graph, cells: Indices, count: int) -> Pairs:
    """Return the cells that touch, and how long their borders are."""
    first, second, row, other = edge_pairs(graph, cells)
    offsets = points[row] - points[other]
    lengths = BORDER * np.sqrt(dot(offsets, offsets))
    return Pairs.gathered(first, second, lengths, count, np.add)


def _costs(pairs: Pairs, area: Floats, mass: Floats) -> Floats:
    """Return what joining each pair costs by the length of its border."""
    low, high = pairs.low, pairs.high
    one, two = area[low], area[high]
    return one * two / (one + two) * (mass[low] / one - mass[high] / two) ** 2 / pairs.value


def _cheapest(pairs: Pairs, cost: Floats, count: int, price: float) -> tuple[Indices, Indices]:
    """Return the pairs worth joining of which neither region has a cheaper one, each once.

    Equal ones come in scattered order: by their numbers they would join one by one along a row.
    """
    good = np.flatnonzero(cost <= price)
    low, high, cost = pairs.low[good], pairs.high[good], cost[good]
    least = np.full(count, np.inf)
    np.minimum.at(least, low, cost)
    np.minimum.at(least, high, cost)
    best = np.flatnonzero((cost == least[low]) & (cost == least[high]))
    best = best[np.argsort(hash01(best), kind="stable")]
    low, high = low[best], high[best]
    turn = np.arange(len(best))
    first = np.full(count, len(best))
    np.minimum.at(first, low, turn)
    np.minimum.at(first, high, turn)
    alone = (first[low] == turn) & (first[high] == turn)
    return low[alone], high[alone]
