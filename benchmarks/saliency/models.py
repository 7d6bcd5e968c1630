# SPDX-License-Identifier: GPL-3.0-or-later
"""How steady maps are under noise, sampling and another order of the points, on scans.

Rank correlation of each map of a noisy or thinner model with its own of the model itself. Noise is
Gaussian, along the normals, as a share of the diagonal; thinner models are clouds of points drawn
at random.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

import salcore
from benchmarks.common.page import table
from benchmarks.common.shapes import Shape, read

from .maps import OURS, Map

NAMES = ("Laurana50k.ply", "rockerArm.ply", "lion_takanawa_341989.ply")
NOISE = (0.0005, 0.001, 0.003)
THINNER = (4, 16)


def row(measure: Map, shape: Shape) -> list[float]:
    """Return the rank correlations at each strength of noise, each density, in another order."""
    rng, points = np.random.default_rng(0), shape.points
    normals = salcore.analyze(points, shape.faces).normals
    clean = measure(points, shape.faces)
    result = []
    for share in NOISE:
        noise = rng.normal(size=(len(points), 1)) * share * shape.diagonal
        result.append(spearmanr(clean, measure(points + noise * normals, shape.faces)).statistic)
    for part in THINNER:
        drawn = np.sort(rng.choice(len(points), len(points) // part, replace=False))
        result.append(spearmanr(clean[drawn], measure(points[drawn], None)).statistic)
    moved, faces, order = shuffled(shape)
    result.append(spearmanr(clean[order], measure(moved, faces)).statistic)
    return result


def models(paths: list[Path]) -> str:
    """Return a table for each model."""
    columns = [f"{share:.2%} noise" for share in NOISE] + [f"1/{part}" for part in THINNER]
    parts = []
    for path in paths:
        shape = read(path)
        rows = [
            [name, *(f"{value:.2f}" for value in row(measure, shape))]
            for name, measure in OURS.items()
        ]
        parts.append(f"{path.stem}, {len(shape.points):,} points:")
        parts.append(table(["map", *columns, "another order"], rows))
    return "\n\n".join(parts)


def shuffled(shape: Shape) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Return the points in another order, the faces, and which point each is."""
    order = np.random.default_rng(0).permutation(len(shape.points))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    faces = None if shape.faces is None else place[shape.faces]
    return shape.points[order], faces, order
