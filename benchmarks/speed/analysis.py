# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of the analysis and of a simplification, against a floor in the same run.

    python -m benchmarks.speed.analysis [--models FOLDER] [--repeat N]

The floor is what any method on a neighbourhood pays: ``cKDTree(points)`` and its query for 17
nearest points. Times are the best of the repeats. Memory is the growth of the process's peak
resident set over the input, measured in a fresh process for every row.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import salcore
from benchmarks.common.memory import peak, reset_peak
from benchmarks.common.models import ROOT, add_models_option, load, present
from benchmarks.speed.floor import floor

ROWS = [
    ("dragon_vrip.ply", "mesh"),
    ("dragon_vrip.ply", "cloud"),
    ("autzen_crop_100k.ply", "cloud"),
    ("autzen_crop_1M.ply", "cloud"),
]


def best(function: Callable[[], Any], repeat: int) -> tuple[float, Any]:
    """Return the least time of several calls, and the last result."""
    seconds = []
    for _ in range(repeat):
        begun = time.perf_counter()
        result = function()
        seconds.append(time.perf_counter() - begun)
    return min(seconds), result


def measure(path: Path, kind: str, repeat: int) -> dict[str, Any]:
    """Return one row of figures."""
    points, faces = load(path, cloud=kind == "cloud")
    salcore.analyze(points[:1000])  # what the first call loads is not the analysis's memory
    reset_peak()
    before = peak()
    analysis = salcore.analyze(points, faces)
    memory = peak() - before
    floor_seconds, _ = best(lambda: floor(points), repeat)
    analyze_seconds, _ = best(lambda: salcore.analyze(points, faces), repeat)
    alpha_seconds, result = best(lambda: analysis.simplify(alpha=30), repeat)
    begun = time.perf_counter()
    errors = result.report.errors
    return {
        "model": path.stem,
        "kind": kind,
        "points": len(points),
        "kept": len(result.indices),
        "floor": floor_seconds,
        "analyze": analyze_seconds,
        "simplify": alpha_seconds,
        "report": time.perf_counter() - begun,
        "memory": memory,
        "rms": errors.surface.rms / errors.diagonal,
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Return the figures as a table in Markdown."""
    lines = [
        "| model | kind | points | floor s | analyze / floor | simplify α=30 / floor "
        "| report / floor | peak bytes a point |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r['model']} | {r['kind']} | {r['points']} | {r['floor']:.2f} "
        f"| {r['analyze'] / r['floor']:.2f} | {r['simplify'] / r['floor']:.2f} "
        f"| {r['report'] / r['floor']:.2f} | {r['memory'] / r['points']:.0f} |"
        for r in rows
    ]
    by_name = {(r["model"], r["kind"]): r for r in rows}
    small = by_name.get(("autzen_crop_100k", "cloud"))
    large = by_name.get(("autzen_crop_1M", "cloud"))
    if small and large:
        lines.append("")
        lines.append(
            f"From {small['points']} to {large['points']} points: "
            f"{large['analyze'] / small['analyze']:.1f} times the time, "
            f"{large['memory'] / small['memory']:.1f} times the memory."
        )
    return "\n".join(lines)


def main() -> None:
    """Measure every row in a process of its own and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--row", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row:
        name, kind = options.row
        print(json.dumps(measure(options.models / name, kind, options.repeat)))
        return
    rows = []
    for name, kind in ROWS:
        if not present([options.models / name]):
            continue
        command = [sys.executable, "-m", "benchmarks.speed.analysis"]
        command += ["--models", str(options.models.resolve()), "--repeat", str(options.repeat)]
        done = subprocess.run(
            [*command, "--row", name, kind], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
        )
        rows.append(json.loads(done.stdout.splitlines()[-1]))
    print(table(rows))


if __name__ == "__main__":
    main()
