# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands: regions merged while a piecewise constant saliency fits them, (4.1) between regions."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats, Indices
from ..arrays.vectors import dot
from ..progress import SILENT, Progress
from .graph import Graph
from .merging import BORDER, Pairs, absorb_small, edge_pairs


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
    of them on short lists: in all about ten times the work on the first list.
    """
    count = int(cells.max(initial=-1)) + 1
    total: Floats = np.bincount(cells, area, count).astype(np.float64)
    mass: Floats = np.bincount(cells, area * saliency, count).astype(np.float64)
    labels, pairs = cells, _borders(points, graph, cells, count)
    while True:
        low, high = _cheapest(pairs, total, mass, price)
        if not len(low):
            break
        target = np.arange(len(total))
        target[high] = low
        total[low] += total[high]
        mass[low] += mass[high]
        kept = target == np.arange(len(target))
        place = (np.cumsum(kept) - 1)[target]
        labels, total, mass = place[labels], total[kept], mass[kept]
        pairs = Pairs.gathered(place[pairs.low], place[pairs.high], pairs.value, len(total), np.add)
        progress(1.0 - len(total) / max(count, 1))
    return absorb_small(labels, pairs, total, mass / total, smallest)


def _borders(points: Floats, graph: Graph, cells: Indices, count: int) -> Pairs:
    """Return the cells that touch, and how long their borders are."""
    first, second, row, other = edge_pairs(graph, cells)
    offsets = points[row] - points[other]
    lengths = BORDER * np.sqrt(dot(offsets, offsets))
    return Pairs.gathered(first, second, lengths, count, np.add)


def _cheapest(pairs: Pairs, area: Floats, mass: Floats, price: float) -> tuple[Indices, Indices]:
    """Return the pairs worth joining of which neither region has a cheaper one, each once."""
    low, high = pairs.low, pairs.high
    one, two = area[low], area[high]
    cost = one * two / (one + two) * (mass[low] / one - mass[high] / two) ** 2 / pairs.value
    good = np.flatnonzero(cost <= price)
    low, high, cost = low[good], high[good], cost[good]
    least = np.full(len(area), np.inf)
    np.minimum.at(least, low, cost)
    np.minimum.at(least, high, cost)
    best = np.flatnonzero((cost == least[low]) & (cost == least[high]))
    low, high = low[best], high[best]
    first = np.full(len(area), len(best))
    np.minimum.at(first, low, np.arange(len(best)))
    np.minimum.at(first, high, np.arange(len(best)))
    alone = (first[low] == np.arange(len(best))) & (first[high] == np.arange(len(best)))
    return low[alone], high[alone]
