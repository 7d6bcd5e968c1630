# SPDX-License-Identifier: GPL-3.0-or-later
"""What saliency at every scale and regions cost: processor seconds, the least of three runs."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import salcore
from benchmarks.common.models import load
from benchmarks.common.page import table

NAMES = ("bun_zipper.ply", "dragon_vrip.ply", "autzen_crop_1M.ply")
RUNS = 3


def seconds(work: Callable[[], Any]) -> float:
    """Return the processor seconds of a call."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def times(paths: list[Path]) -> str:
    """Return the table of times on one thread."""
    one = salcore.Parameters(workers=1)
    lines = []
    for path in paths:
        points, faces = load(path)
        rows = []
        for _ in range(RUNS):
            begun = time.process_time()
            analysis = salcore.analyze(points, faces, parameters=one)
            row = [time.process_time() - begun, seconds(lambda a=analysis: a.scales)]
            for kind in ("islands", "basins"):
                of = dataclasses.replace(one, segmentation=kind)
                other = dataclasses.replace(analysis, parameters=of)
                vars(other)["scales"] = analysis.scales
                row.append(seconds(lambda a=other: a.segmentation))
            rows.append(row)
        first, scales, islands, basins = (min(column) for column in zip(*rows, strict=True))
        figures = [f"{first:.2f} s", f"{scales:.2f} s", f"{1 + scales / first:.2f}"]
        figures += [f"{islands:.2f} s", f"{basins:.2f} s"]
        lines.append([path.stem, f"{len(points):,}", *figures])
    head = ["points", "analysis", "scales", "together, of the analysis", "islands", "basins"]
    return table(["model", *head], lines)
