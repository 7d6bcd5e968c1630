# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurements behind the default parameters (the tables of docs/method.md).

    python -m benchmarks.paper.defaults [--models FOLDER] [--only noise|selection]

noise: rank correlation between the saliency of a clean mesh and of the same mesh with Gaussian
noise, and between a mesh and its bare points. selection: surface error of the kept points as a
share of that of a random choice of equally many; the surface is the dual of the kept points' cells
on the mesh (`benchmarks.peers.quality`).
"""

from __future__ import annotations

import argparse
import dataclasses

import numpy as np
from scipy.stats import spearmanr

import salcore
from benchmarks.common.models import add_models_option, present
from benchmarks.common.shapes import Shape, read

MODELS = ("bun_zipper.ply", "Laurana50k.ply", "rockerArm.ply")
DEFAULT = salcore.Parameters()
PRINTED = dataclasses.replace(DEFAULT, contrast="difference", averaging="plain")
MAPS = {
    "difference, step at 3": dataclasses.replace(PRINTED, counting="step", deviation_threshold=3),
    "difference, ramp to 9": PRINTED,
    "default": DEFAULT,
}
SELECTIONS = {
    "tolerance 0.03, 30 degrees, guard 1": {"tolerance": 0.03, "collinear_angle": 30},
    "tolerance 0.05, 30 degrees, guard 1": {"tolerance": 0.05, "collinear_angle": 30},
    "default": {},
    "tolerance 0.05, 30 degrees, guard 2": {
        "tolerance": 0.05,
        "collinear_angle": 30,
        "max_gap": 2,
    },
    "tolerance 0.05, 30 degrees, no guard": {
        "tolerance": 0.05,
        "collinear_angle": 30,
        "max_gap": 0,
    },
}


def raw_saliency(
    points: np.ndarray, faces: np.ndarray | None, parameters: salcore.Parameters
) -> np.ndarray:
    """Return SL of (3.9) before it is scaled, of every input point."""
    analysis = salcore.analyze(points, faces, parameters=parameters)
    return analysis.saliency_map.raw[analysis.geometry.vertex_of]


def noise(shape: Shape) -> None:
    """Print how well each map holds against noise and without faces."""
    points, faces = shape.points, shape.faces
    rng = np.random.default_rng(0)
    noisy = [
        points + rng.normal(size=points.shape) * share * shape.diagonal for share in (0.0005, 0.001)
    ]
    for name, parameters in MAPS.items():
        clean = raw_saliency(points, faces, parameters)
        others = [raw_saliency(p, faces, parameters) for p in noisy]
        others.append(raw_saliency(points, None, parameters))
        values = [spearmanr(clean, other).statistic for other in others]
        print(
            f"  {name:24} noise 0.05 %: {values[0]:5.2f}   0.1 %: {values[1]:5.2f}   "
            f"bare points: {values[2]:5.2f}"
        )


def selection(shape: Shape, alpha: float = 30.0) -> None:
    """Print the error of each selection as a share of that of a random one."""
    from benchmarks.peers.quality import Judge  # here, so that noise needs no open3d

    points, faces = shape.points, shape.faces
    rng, judge = np.random.default_rng(0), Judge(shape)
    variants = {name: dataclasses.replace(DEFAULT, **kw) for name, kw in SELECTIONS.items()}
    variants["preset paper"] = salcore.Parameters.preset("paper")
    for name, parameters in variants.items():
        kept = salcore.simplify(points, faces, parameters=parameters, alpha=alpha).indices
        chance = rng.choice(len(points), len(kept), replace=False)
        ours, random = (judge.surface(*judge.rebuilt(k)) for k in (kept, chance))
        print(
            f"  {name:38} kept {len(kept) / len(points):4.0%}   "
            f"all {ours['rms'] / random['rms']:5.2f}   "
            f"features {ours['feature'] / random['feature']:5.2f}"
        )


def main() -> None:
    """Run the chosen measurements."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("--only", choices=["noise", "selection"])
    options = parser.parse_args()
    for path in present(options.models / name for name in MODELS):
        shape = read(path)
        print(path.stem)
        if options.only != "selection":
            noise(shape)
        if options.only != "noise":
            selection(shape)


if __name__ == "__main__":
    main()
