# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurements behind the default parameters of the paper's method.

    python -m benchmarks.paper.defaults [--models FOLDER] [--figures FOLDER]

Writes defaults.md.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.stats import spearmanr

import salcore
from benchmarks.common.models import present
from benchmarks.common.page import options, table, write
from benchmarks.common.shapes import Shape, read
from benchmarks.peers.quality import Judge

MODELS = ("bun_zipper.ply", "Laurana50k.ply", "rockerArm.ply")
DEFAULT = salcore.Parameters()
LEVEL = dataclasses.replace(DEFAULT, coarsest=0)
PRINTED = dataclasses.replace(LEVEL, contrast="difference", averaging="plain")
MAPS = {
    "difference, step at 3": dataclasses.replace(PRINTED, counting="step", deviation_threshold=3),
    "difference, ramp to 9": PRINTED,
    "default, one level": LEVEL,
    "**default**": DEFAULT,
}
FINER = {"tolerance": 0.05, "collinear_angle": 30.0}
SELECTIONS = {
    "tolerance 0.03, 30°, guard 1 ring": FINER | {"tolerance": 0.03},
    "tolerance 0.05, 30°, guard 1 ring": FINER,
    "**tolerance 0.08, 60°, guard 1 ring**": {},
    "tolerance 0.05, 30°, guard 2 rings": FINER | {"max_gap": 2},
    "tolerance 0.05, 30°, no guard": FINER | {"max_gap": 0},
}
ALPHA = 30.0
NOISE = (0.0005, 0.001)


def noise(shape: Shape) -> list[list[float]]:
    """Return how well each map holds against noise and without faces, as rank correlations."""
    points, faces = shape.points, shape.faces
    rng = np.random.default_rng(0)
    others = [
        (points + rng.normal(size=points.shape) * share * shape.diagonal, faces) for share in NOISE
    ]
    others.append((points, None))
    rows = []
    for parameters in MAPS.values():
        clean = salcore.analyze(points, faces, parameters=parameters).saliency
        maps = [salcore.analyze(*other, parameters=parameters).saliency for other in others]
        rows.append([float(spearmanr(clean, each).statistic) for each in maps])
    return rows


def selection(shape: Shape) -> list[tuple[float, float, float]]:
    """Return the share that each selection keeps, and its errors as shares of a random one's."""
    points, faces = shape.points, shape.faces
    rng, judge = np.random.default_rng(0), Judge(shape)
    variants = [dataclasses.replace(DEFAULT, **values) for values in SELECTIONS.values()]
    rows = []
    for parameters in [*variants, salcore.Parameters.preset("paper")]:
        kept = salcore.simplify(points, faces, parameters=parameters, alpha=ALPHA).indices
        chance = rng.choice(len(points), len(kept), replace=False)
        ours, random = (judge.surface(*judge.rebuilt(k)) for k in (kept, chance))
        shares = (ours[key] / random[key] for key in ("rms", "feature"))
        rows.append((len(kept) / len(points), *shares))
    return rows


def main() -> None:
    """Measure the models that are there."""
    chosen = options(__doc__)
    shapes = {path.stem: read(path) for path in present(chosen.models / name for name in MODELS)}
    steady = [
        [f"{name}: {label}", *(f"{value:.2f}" for value in row)]
        for name, shape in shapes.items()
        for label, row in zip(MAPS, noise(shape), strict=True)
    ]
    columns = [selection(shape) for shape in shapes.values()]
    kept = [
        [
            label,
            *(
                cell
                for share, everywhere, features in row
                for cell in (f"{share:.0%}", f"{everywhere:.2f}, {features:.2f}")
            ),
        ]
        for label, row in zip(
            [*SELECTIONS, 'preset "paper"'], zip(*columns, strict=True), strict=True
        )
    ]
    head = [cell for name in shapes for cell in (f"{name}: kept", "all, features")]
    write(
        chosen.figures / "defaults.md",
        "Behind the defaults",
        "benchmarks.paper.defaults",
        ABOUT_NOISE,
        table(["map", "0.05 % noise", "0.1 % noise", "bare points"], steady),
        ABOUT_SELECTION,
        table(["", *head], kept),
    )


ABOUT_NOISE = """## Saliency

Rank correlation between the saliency of a mesh and that of the same mesh with Gaussian noise, a
share of the diagonal in all three coordinates, and of its bare points."""
ABOUT_SELECTION = f"""## Regions and interest points

Surface error (rms) of the kept points, by the dual of their cells on the mesh, as a share of that
of a random choice of equally many points: over the whole surface, and over the tenth of the points
where it bends most; α = {ALPHA:g}."""


if __name__ == "__main__":
    main()
