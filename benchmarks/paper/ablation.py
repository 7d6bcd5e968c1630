# SPDX-License-Identifier: GPL-3.0-or-later
"""What each part of the paper adds, at equal count.

    python -m benchmarks.paper.ablation [--models FOLDER] [--figures FOLDER]

Writes ablation.md. First the order of elimination with parts taken out or put in; then the paper's
threshold, built up part by part. Errors are those of benchmarks/peers/quality.py.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

import salcore
from benchmarks.common.models import present
from benchmarks.common.page import options, table, write
from benchmarks.common.shapes import Shape, read
from benchmarks.peers.quality import Judge
from benchmarks.peers.registry import Outcome

MODELS = ("bun_zipper.ply", "Laurana50k.ply", "fandisk.obj", "rockerArm.ply")
RATIOS = (0.1, 0.02)
DEFAULT = salcore.Parameters()
ORDERS = {
    "no saliency (`detail` 0)": replace(DEFAULT, detail=0),
    "half of it (`detail` 1.5)": replace(DEFAULT, detail=1.5),
    "twice as much (`detail` 6)": replace(DEFAULT, detail=6),
    "saliency as printed, (3.8) mended": replace(DEFAULT, contrast="difference", averaging="plain"),
    "weight ω left out (`averaging` plain)": replace(DEFAULT, averaging="plain"),
    "regions' boundaries weigh 1 more": replace(DEFAULT, interest_weight=1),
    "regions' boundaries weigh 5 more": replace(DEFAULT, interest_weight=5),
    "no evenness": replace(DEFAULT, evenness=0),
    "a third of it (`evenness` 0.03)": replace(DEFAULT, evenness=0.03),
    "three times as much (`evenness` 0.3)": replace(DEFAULT, evenness=0.3),
}
ALPHA = 30.0

Pair = tuple[float, float]


def pair(figures: dict[str, float]) -> Pair:
    """Return the error overall and at features."""
    return figures["rms"], figures["feature"]


def ordered(judge: Judge, parameters: salcore.Parameters, cloud: bool) -> list[Pair]:
    """Return the errors of one order of elimination at every ratio."""
    shape = judge.shape
    analysis = salcore.analyze(shape.points, None if cloud else shape.faces, parameters=parameters)
    found = []
    for ratio in RATIOS:
        result = analysis.simplify(ratio=ratio)
        if cloud:
            found.append(pair(judge.surface(*judge.rebuilt(result.indices))))
        else:
            found.append(pair(judge.surface(shape.points[result.indices], result.faces)))
    return found


def mean(values: Iterable[float]) -> float:
    """Return the geometric mean."""
    logs = [math.log(value) for value in values]
    return math.exp(sum(logs) / len(logs))


def shares(found: list[Pair], base: list[Pair]) -> list[Pair]:
    """Return errors as shares of others."""
    return [(a / c, b / d) for (a, b), (c, d) in zip(found, base, strict=True)]


def orders(judges: list[Judge]) -> str:
    """Return the table of orders."""
    rows = []
    base = {
        cloud: [p for judge in judges for p in ordered(judge, DEFAULT, cloud)]
        for cloud in (False, True)
    }
    for name, parameters in ORDERS.items():
        cells = []
        for cloud in (False, True):
            found = [p for judge in judges for p in ordered(judge, parameters, cloud)]
            for side in zip(*shares(found, base[cloud]), strict=True):
                cells += [f"{mean(side):.3f}", f"{max(side):.2f}"]
        rows.append([name, *cells])
        print(*rows[-1], flush=True)
    head = ["mesh, all", "worst", "mesh, features", "worst"]
    head += ["cloud, all", "worst", "cloud, features", "worst"]
    return table(["change to the default", *head], rows)


def built_up(analysis: salcore.Analysis) -> dict[str, np.ndarray]:
    """Return the paper's selection part by part, as vertices of the cleaned geometry."""
    interest = analysis.simplify(alpha=ALPHA).interest
    edges = interest.salient | interest.extremities
    return {
        "salient points, (4.7)": interest.salient,
        "boundary extremities, (4.4)": interest.extremities,
        "both": edges,
        "both, and the gap rule": edges | interest.fillers,
        "all, with the guard": interest.kept,
    }


def chance(shape: Shape, count: int) -> np.ndarray:
    """Return a random choice of so many points."""
    return np.random.default_rng(0).choice(len(shape.points), count, replace=False)


def thresholds(judges: list[Judge]) -> str:
    """Return the table of selections against chance and against the order, at equal count."""
    found: dict[str, list[tuple[float, Pair, Pair]]] = {}
    for judge in judges:
        shape = judge.shape
        analysis = salcore.analyze(shape.points, shape.faces)
        bare = salcore.analyze(shape.points)  # faces of its own would speak for an order by mesh
        one = replace(DEFAULT, tolerance=1.0)
        whole = salcore.analyze(shape.points, shape.faces, parameters=one)
        sets = {name: analysis.geometry.input_of[part] for name, part in built_up(analysis).items()}
        sets["all, with one region"] = whole.simplify(alpha=ALPHA).indices
        for name, kept in sets.items():
            other = chance(shape, len(kept))
            order = bare.simplify(count=len(kept)).indices
            errors, random, best = (
                pair(judge.figures(Outcome(indices=k))["rebuilt"]) for k in (kept, other, order)
            )
            row = len(kept) / len(shape.points), *shares([errors, errors], [random, best])
            found.setdefault(name, []).append(row)
    rows = []
    for name, measured in found.items():
        portion, *both = zip(*measured, strict=True)
        cells = [f"{np.mean(portion):.0%}"]
        for pairs in both:
            for side in zip(*pairs, strict=True):
                cells += [f"{mean(side):.2f}", f"{max(side):.2f}"]
        rows.append([name, *cells])
    sides = ["all", "worst", "features", "worst"]
    head = ["kept", "of the points", *(f"of chance: {side}" for side in sides)]
    return table([*head, *(f"of the order: {side}" for side in sides)], rows)


def main() -> None:
    """Measure on the models that are there."""
    chosen = options(__doc__)
    paths = present(chosen.models / name for name in MODELS)
    judges = [Judge(read(path)) for path in paths]
    write(
        chosen.figures / "ablation.md",
        "What each part of the paper adds",
        "benchmarks.paper.ablation",
        f"Models: {', '.join(path.stem for path in paths)}.",
        ABOUT_ORDERS,
        orders(judges),
        ABOUT_THRESHOLDS,
        thresholds(judges),
    )


ABOUT_ORDERS = """## In the order of elimination

Errors after a change, as shares of the default's at equal count: geometric means over the models at
10 % and 2 %, and the worst single one. Above 1 the change does harm, so what it takes away helps.
Mesh: the returned mesh. Cloud: the surface rebuilt from the kept points. *Features*: the tenth of
the points where the surface bends most."""
ABOUT_THRESHOLDS = f"""## In the paper's threshold (α = {ALPHA:g})

The selection built up part by part; its rebuilt surface's error as a share of that of as many
random points (*of chance*), and of as many points of the order of elimination of the bare points
(*of the order*). The mean over the models, and the worst."""


if __name__ == "__main__":
    main()
