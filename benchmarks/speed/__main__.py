# SPDX-License-Identifier: GPL-3.0-or-later
"""What the engine takes, and how long Blender's window waits for it.

    python -m benchmarks.speed [--models FOLDER] [--figures FOLDER]

Writes speed.md. The figures of the window need a Python with bpy: the one named by $BLENDER_PYTHON,
else this one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.common.models import ROOT, present
from benchmarks.common.page import options, table, write

ROWS = [
    ("dragon_vrip.ply", "mesh"),
    ("dragon_vrip.ply", "cloud"),
    ("autzen_crop_100k.ply", "cloud"),
    ("autzen_crop_1M.ply", "cloud"),
]


def answer(python: str, *command: str) -> Any:
    """Run a module of this folder in a process of its own, and return what it prints as JSON."""
    done = subprocess.run(
        [python, "-m", *command], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
    )
    print(done.stdout, flush=True)
    return json.loads(done.stdout.splitlines()[-1])


def engine(rows: list[dict[str, Any]]) -> str:
    """Return the table of what the engine takes, in seconds and as multiples of the floor."""
    head = ["", "points", "floor, s", "analysis", "order and first cut", "rounds", "further cut"]
    head += ["further cut, not refined", "measuring errors", "MeshLab, same faces"]
    lines = []
    for row in rows:
        floor = row["floor"]
        parts = [row["analyze"], row["cut"], row["further"], row.get("draft")]
        parts += [row["measure"], row.get("MeshLab")]
        cells = ["" if part is None else f"{part:.2f} s, {part / floor:.2f}" for part in parts]
        cells.insert(2, f"{row['rounds']}")
        lines.append([_name(row), f"{row['points']:,}", f"{floor:.2f}", *cells])
    return table(head, lines)


def memory(rows: list[dict[str, Any]]) -> str:
    """Return the table of memory, estimated and measured."""
    lines = [
        [_name(row), f"{row['points']:,}", f"{row['estimated']:.0f}", f"{row['memory']:.0f}"]
        for row in rows
    ]
    return table(["", "points", "estimated, bytes a point", "measured"], lines)


def thresholds(rows: list[dict[str, Any]]) -> str:
    """Return the table of thresholds by both presets."""
    lines = [
        [
            _name(row),
            f"{row['alpha']:.2f} s",
            f"{row['paper']:.2f} s",
            f"{row['paper'] / row['alpha']:.1f}",
        ]
        for row in rows
    ]
    return table(["analysis and α = 30", "default", "preset paper", "ratio"], lines)


def _name(row: dict[str, Any]) -> str:
    return f"{row['model']}, {row['kind']}"


def window(found: list[dict[str, Any]]) -> str:
    """Return the table of what Blender's own thread waits for."""
    names = list(dict.fromkeys(what for each in found for what in each["figures"]))
    rows = [[name, *(each["figures"].get(name, "") for each in found)] for name in names]
    return table(["", *(f"{each['model']}, {each['points']:,}" for each in found)], rows)


def main() -> None:
    """Measure the models that are there."""
    chosen = options(__doc__)
    models = chosen.models.resolve()
    rows = [
        answer(sys.executable, "benchmarks.speed.engine", str(models / name), kind)
        for name, kind in ROWS
        if present([models / name])
    ]
    python = os.environ.get("BLENDER_PYTHON", sys.executable)
    found = answer(python, "benchmarks.speed.worker", "--models", str(models))
    write(
        Path(chosen.figures) / "speed.md",
        "Time and memory",
        "benchmarks.speed",
        ABOUT_ENGINE,
        engine(rows),
        ABOUT_MEMORY,
        memory(rows),
        ABOUT_THRESHOLDS,
        thresholds(rows),
        ABOUT_WINDOW,
        window(found),
    )


ABOUT_ENGINE = """## The engine

Processor seconds, and after the comma how many times the floor that is: a k-d tree and its query
for 17 nearest points, which any method on a neighbourhood pays. The first cut is to 10 %, the
further one to 5 %."""
ABOUT_MEMORY = """## Memory

Growth of the peak of the resident set over the input, from before the analysis to after the first
cut, and what `salcore.estimated_memory` says beforehand."""
ABOUT_THRESHOLDS = """## The paper's threshold"""
ABOUT_WINDOW = """## Blender's window

Wall-clock seconds of Blender's own thread while the worker simplifies to 10 %, CPU seconds of it in
brackets: on a busy machine the first tell less."""


if __name__ == "__main__":
    main()
