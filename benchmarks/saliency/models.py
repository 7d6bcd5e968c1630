# SPDX-License-Identifier: GPL-3.0-or-later
"""How steady maps are under noise and sampling on scans (a table of docs/evidence.md).

    python -m benchmarks.saliency.models [--models FOLDER] [--peers] [NAME ...]

Rank correlation of each map of a noisy or thinner model with its own of the model itself. Noise is
Gaussian, along the normals, as a share of the diagonal; thinner models are clouds of points drawn
at random.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.stats import spearmanr

import salcore
from benchmarks.common.models import add_models_option, present
from benchmarks.common.shapes import Shape, read

from .maps import OURS, PEERS, Map

NAMES = ("Laurana50k.ply", "rockerArm.ply", "lion_takanawa_341989.ply")
SLOW = ("Lee 2005", "normal variation, 4 %", "normal variation, 2 %", "preset paper")
"""Peers that look at far too many neighbours on a large scan."""
NOISE = (0.0005, 0.001, 0.003)
THINNER = (4, 16)


def row(measure: Map, shape: Shape) -> list[float]:
    """Return the rank correlations at each strength of noise and each density."""
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
    return result


def main() -> None:
    """Print a table for each model."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME")
    parser.add_argument("--peers", action="store_true", help="measure the peers as well")
    options = parser.parse_args()
    maps = OURS
    if options.peers:
        maps = OURS | {name: measure for name, measure in PEERS.items() if name not in SLOW}
    columns = [f"{share:.2%} noise" for share in NOISE] + [f"1/{part}" for part in THINNER]
    for path in present(options.models / name for name in options.names):
        shape = read(path)
        print(
            f"\n{path.stem}, {len(shape.points):,} points\n\n| map |", *(f"{c} |" for c in columns)
        )
        print("|---|" + "---|" * len(columns))
        for name, measure in maps.items():
            print(f"| {name} |", *(f"{v:.2f} |" for v in row(measure, shape)), flush=True)


if __name__ == "__main__":
    main()
