# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's tables 1 and 2 and figures 6 and 12 to 15, beside what both presets give.

    python -m benchmarks.paper.tables [--models FOLDER] [--figures FOLDER]

Writes paper.md and plots. All models are bare points, as in the paper: faces are not looked at.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import salcore
from benchmarks.common.models import load, present
from benchmarks.common.page import options, table, write
from benchmarks.paper import plots

FILES = {"bunny": "bun_zipper.ply", "laurana": "Laurana50k.ply", "dragon": "dragon_vrip.ply"}
PRESETS = ("paper", "default")
ALPHAS = (0, 30, 50)
CURVE_ALPHAS = (0, 10, 20, 30, 40, 50, 60, 80, 100)
THRESHOLDS = (0, 2, 5, 9, 13)
MEANINGFUL = 0.93  # of a set that holds nearly all points, chance keeps nearly all
NOISE = (0.1, 0.2, 0.3, 0.5)  # per cent of the diagonal
PRINTED_1 = {
    "bunny": (30134, 27316, 16476),
    "laurana": (18819, 17492, 16241),
    "dragon": (387412, 185620, 33960),
}
PRINTED_MAX = {"bunny": 0.005151, "laurana": 0.003313, "dragon": 0.044323}
PRINTED_2 = {0: 9764, 5: 19636, 9: 22894}


class Study:
    """Analyses of one model's points, each made once."""

    def __init__(self, name: str, points: np.ndarray):
        self.name, self.points = name, points
        self.diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))

    @cache  # noqa: B019  (a study lives as long as the run)
    def analysis(self, preset: str, threshold: float, noise: float) -> salcore.Analysis:
        """Return the analysis of the points, moved by noise of so many per cent of the diagonal."""
        parameters = replace(salcore.Parameters.preset(preset), deviation_threshold=threshold)
        move = np.random.default_rng(0).normal(size=self.points.shape) * self.diagonal * noise / 100
        print(f"{self.name}: preset {preset}, x = {threshold}, noise {noise} %", flush=True)
        return salcore.analyze(self.points + move, parameters=parameters)

    def kept(self, preset: str, alpha: float, threshold: float = 9, noise: float = 0) -> np.ndarray:
        """Return the kept points' numbers."""
        return self.analysis(preset, threshold, noise).simplify(alpha=alpha).indices

    def rate(self, count: int) -> float:
        """Return the paper's rate: the share of points that went, in per cent."""
        return 100 * (1 - count / len(self.points))


def table_1(studies: list[Study]) -> str:
    """Return table 1: counts and rates at n = 8, x = 9, and the errors (5.1) and (5.2)."""
    rows = []
    for study in studies:
        counts = PRINTED_1[study.name]
        printed = [f"{count} ({study.rate(count):.0f} %)" for count in counts]
        worst = PRINTED_MAX[study.name]
        rows.append([f"{study.name}, printed", *printed, "", f"{worst} (no unit)", "", ""])
        for preset in PRESETS:
            results = [study.analysis(preset, 9, 0).simplify(alpha=alpha) for alpha in ALPHAS]
            counts = [len(result.indices) for result in results]
            errors = [results[i].report.errors.point for i in (0, -1)]
            shares = [100 * e / study.diagonal for d in errors for e in (d.max, d.mean)]
            rows.append(
                [f"{study.name}, preset {preset}"]
                + [f"{count} ({study.rate(count):.0f} %)" for count in counts]
                + [f"{shares[0]:.2f}, {shares[1]:.3f} %", f"{errors[1].max:.4g}"]
                + [f"{errors[1].mean:.3g}", f"{shares[2]:.2f}, {shares[3]:.3f} %"]
            )
    head = ["points kept (rate)", "α = 0", "α = 30", "α = 50", "α = 0: Δmax, Δavg of the diagonal"]
    head += ["α = 50: Δmax, model's unit", "Δavg, model's unit", "Δmax, Δavg of the diagonal"]
    return table(head, rows)


def table_2(study: Study) -> str:
    """Return table 2: counts over x at α = 0."""
    rows = [["printed"] + [str(PRINTED_2.get(x, "")) for x in THRESHOLDS]]
    for preset in PRESETS:
        counts = [len(study.kept(preset, 0, x)) for x in THRESHOLDS]
        rows.append([f"preset {preset}"] + [f"{n} ({study.rate(n):.0f} %)" for n in counts])
    return table(["Laurana, α = 0"] + [f"x = {x}" for x in THRESHOLDS], rows)


def curves(study: Study) -> dict[str, dict[float, list[float]]]:
    """Return the rate over α for every x and preset (figure 14)."""
    return {
        preset: {
            x: [study.rate(len(study.kept(preset, alpha, x))) for alpha in CURVE_ALPHAS]
            for x in THRESHOLDS
        }
        for preset in PRESETS
    }


def noise_rows(study: Study, preset: str) -> list[dict[str, float]]:
    """Return what noise does to counts, to errors and to the set that is kept (figure 15)."""
    clean = study.kept(preset, 0)
    rows = []
    for noise in (0, *NOISE):
        result = study.analysis(preset, 9, noise).simplify(alpha=0)
        chance = len(result.indices) / len(study.points)
        same = len(np.intersect1d(clean, result.indices)) / len(clean)
        errors = result.report.errors.point
        rows.append(
            {
                "noise": noise,
                "kept": len(result.indices),
                "max": 100 * errors.max / study.diagonal,
                "avg": 100 * errors.mean / study.diagonal,
                "same": same,
                "chance": chance,
                "beyond": (same - chance) / (1 - chance) if chance < MEANINGFUL else math.nan,
            }
        )
    return rows


def noise_table(found: dict[tuple[str, str], list[dict[str, float]]]) -> str:
    """Return the table of the noise test."""
    rows = [
        [
            f"{name}, preset {preset}",
            f"{row['noise']:g} %",
            f"{row['kept']} ({100 * (1 - row['chance']):.0f} %)",
            f"{row['max']:.2f} %",
            f"{row['avg']:.3f} %",
            f"{row['same']:.0%}",
            f"{row['chance']:.0%}",
            "" if math.isnan(row["beyond"]) else f"{row['beyond']:.2f}",
        ]
        for (name, preset), rows in found.items()
        for row in rows
    ]
    head = ["α = 0", "noise", "kept (rate)", "Δmax", "Δavg", "of the clean set kept", "by chance"]
    return table([*head, "beyond chance"], rows)


def sections(studies: list[Study], figures: Path) -> list[str]:
    """Return the parts of the page, having drawn the plots."""
    by_name = {study.name: study for study in studies}
    parts = [HEAD, "## Table 1 (figure 12)\n\nn = 8, x = 9.\n\n" + table_1(studies)]
    small = [by_name[name] for name in ("bunny", "laurana") if name in by_name]
    if "laurana" in by_name:
        parts.append("## Table 2 (figure 13)\n\n" + table_2(by_name["laurana"]))
        plots.figure_12(by_name["laurana"], PRESETS, ALPHAS, figures / "figure_6_12.png")
        plots.figure_13(by_name["laurana"], PRESETS, figures / "figure_13.png")
        parts.append(PICTURES)
    if small:
        rates = {study.name: curves(study) for study in small}
        plots.figure_14(rates, CURVE_ALPHAS, PRINTED_1, by_name, figures / "figure_14.svg")
        parts.append(FIGURE_14)
        found = {(s.name, preset): noise_rows(s, preset) for s in small for preset in PRESETS}
        plots.figure_15(found, figures / "figure_15.svg")
        parts.append(FIGURE_15 + noise_table(found))
    return parts


HEAD = """docs/evidence.md says what it means. The rate is the paper's: the share of the points that
went. All models are bare points. Δmax and Δavg are (5.1) and (5.2), from original points to the
nearest kept one."""
PICTURES = """## Figures 6, 12 and 13

![Saliency, and points kept at three thresholds](figure_6_12.png)

![Points kept at four deviation thresholds](figure_13.png)"""
FIGURE_14 = """## Figure 14

![Rate over the threshold](figure_14.svg)"""
FIGURE_15 = """## Figure 15: noise

Gaussian noise in all three coordinates, its standard deviation in per cent of the diagonal. *Of the
clean set kept*: the share of the points kept without noise that are kept with it; *by chance*: what
a random choice of as many would give; *beyond chance*: 0 where it is no better, 1 where it is the
same set, empty where more than 93 % are kept, of which nothing can be said. Δ is from the noisy
points to those kept of them.

![Counts and sets under noise](figure_15.svg)

"""


def main() -> None:
    """Measure the models that are there."""
    chosen = options(__doc__)
    studies = [
        Study(name, load(path, cloud=True)[0])
        for name, file in FILES.items()
        for path in present([chosen.models / file])
    ]
    parts = sections(studies, chosen.figures)
    title = "The paper's tables and figures"
    write(chosen.figures / "paper.md", title, "benchmarks.paper.tables", *parts)


if __name__ == "__main__":
    main()
