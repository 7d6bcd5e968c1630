# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a window waits while a host works in time slices.

    python benchmarks/slices.py [--models FOLDER] [--slice 0.1] [--ratio 0.1] [--longest 10]

Drives analysis and simplification as a modal operator does: steps until the slice is used up, then
back to the window. A slice is as much too long as its last step. Prints percentiles of the slices
for every stage (of a slice's last step), and the longest steps with the lines they lie between.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from analysis import load

import salcore

ROWS = [
    ("dragon_vrip.ply", "mesh"),
    ("dragon_vrip.ply", "cloud"),
    ("autzen_crop_1M.ply", "cloud"),
]


class Step(NamedTuple):
    """One step between two yields."""

    stage: str
    seconds: float
    lines: str


def place(steps: Generator[Any, None, Any]) -> str:
    """Return the line of the innermost yield where work stands."""
    while steps.gi_frame is not None:
        inner = steps.gi_yieldfrom or steps.gi_frame.f_locals.get("steps")
        if not hasattr(inner, "gi_frame") or inner.gi_frame is None:
            return f"{Path(steps.gi_code.co_filename).stem}:{steps.gi_frame.f_lineno}"
        steps = inner
    return "end"


def drive(steps: Generator[Any, None, Any], done: list[Step]) -> Any:
    """Run work to its end, noting every step; return its result."""
    stage, before = "Start", "start"
    while True:
        begun = time.perf_counter()
        try:
            at = next(steps)
        except StopIteration as stop:
            done.append(Step(stage, time.perf_counter() - begun, f"{before} to end"))
            return stop.value
        seconds = time.perf_counter() - begun
        here = place(steps)
        done.append(Step(stage, seconds, f"{before} to {here}"))
        stage, before = at.stage, here


def slices(steps: list[Step], length: float) -> list[Step]:
    """Return the slices that steps make; each is named after its last step."""
    result: list[Step] = []
    used = 0.0
    for step in steps:
        used += step.seconds
        if used >= length or step is steps[-1]:
            result.append(step._replace(seconds=used))
            used = 0.0
    return result


def line(name: str, seconds: list[float]) -> str:
    """Return the figures of some slices as a row of a table."""
    half, most, nearly = np.percentile(seconds, [50, 95, 99])
    return (
        f"| {name} | {len(seconds)} | {half:.3f} | {most:.3f} | {nearly:.3f} "
        f"| {max(seconds):.3f} | {sum(x > 0.2 for x in seconds)} |"
    )


def measure(path: Path, kind: str, options: argparse.Namespace) -> None:
    """Print the figures of one model."""
    points, faces = load(path, kind)
    salcore.simplify(points[:1000], ratio=0.5)
    steps: list[Step] = []
    analysis = drive(salcore.analysis_steps(points, faces), steps)
    drive(analysis.simplify_steps(ratio=options.ratio), steps)
    done = slices(steps, options.slice)
    total = sum(step.seconds for step in steps)
    print(f"{path.stem}, {kind}: {len(points)} points, {total:.1f} s, {len(steps)} steps\n")
    print("| stage | slices | 50 % s | 95 % s | 99 % s | longest s | over 0.2 s |")
    print("|---|---|---|---|---|---|---|")
    for stage in dict.fromkeys(slice_.stage for slice_ in done):
        print(line(stage, [s.seconds for s in done if s.stage == stage]))
    print(line("all", [s.seconds for s in done]))
    print()
    for step in sorted(steps, key=lambda step: -step.seconds)[: options.longest]:
        print(f"{step.seconds:.3f} s  {step.stage}: {step.lines}")
    print(flush=True)


def main() -> None:
    """Measure every model that is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=Path, default=Path("../shared/models"))
    parser.add_argument("--slice", type=float, default=0.1, help="seconds of work in a slice")
    parser.add_argument("--ratio", type=float, default=0.1)
    parser.add_argument("--longest", type=int, default=10, help="steps to print")
    options = parser.parse_args()
    for name, kind in ROWS:
        if (options.models / name).exists():
            measure(options.models / name, kind, options)
        else:
            print(f"missing: {options.models / name}", file=sys.stderr)


if __name__ == "__main__":
    main()
