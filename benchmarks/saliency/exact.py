# SPDX-License-Identifier: GPL-3.0-or-later
"""How well maps tell known features from what is clearly none.

Mean over three shapes (`benchmarks.saliency.shapes`) of the AUC: how often a point on a feature has
a larger value than one clearly off. Noise is along the normals, as a share of the diagonal; "half"
is 0.1 % on one half of the shape, which asks whether noise looks salient beside features.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import rankdata

from benchmarks.common.page import table

from .maps import Map
from .shapes import SHAPES, Known, with_noise

NOISE = {"clean": 0.0, "0.05 %": 0.0005, "0.1 %": 0.001, "0.3 %": 0.003}


def auc(values: np.ndarray, feature: np.ndarray, off: np.ndarray) -> float:
    """Return how often a feature's value exceeds one clearly off; ties count half."""
    both = feature | off
    rank = rankdata(values[both])
    ones = np.count_nonzero(feature)
    total = rank[feature[both]].sum() - ones * (ones + 1) / 2
    return float(total / (ones * (np.count_nonzero(both) - ones)))


def row(measure: Map, shapes: list[Known]) -> list[float]:
    """Return the mean AUC at each strength of noise, with noise on half, and over all."""
    result = []
    for share, half in [(share, False) for share in NOISE.values()] + [(0.001, True)]:
        result.append(
            np.mean(
                [
                    auc(measure(with_noise(s, share, half), s.faces), s.feature, s.off)
                    for s in shapes
                ]
            )
        )
    return [*result, np.mean(result)]


def exact(counts: Sequence[int], maps: dict[str, Map]) -> str:
    """Return the table of some maps on the shapes of so many points."""
    shapes = [make(count) for make in SHAPES.values() for count in counts]
    rows = [
        [name, *(f"{value:.3f}" for value in row(measure, shapes))]
        for name, measure in maps.items()
    ]
    return table(["map", *NOISE, "half", "all"], rows)
