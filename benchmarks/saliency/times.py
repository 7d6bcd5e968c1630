# SPDX-License-Identifier: GPL-3.0-or-later
"""What saliency at every scale and regions cost (a table of docs/evidence.md).

    python -m benchmarks.saliency.times [--models FOLDER] [NAME ...]

Processor seconds, the least of three runs on one thread.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections.abc import Callable
from typing import Any

import salcore
from benchmarks.common.models import add_models_option, load, present

NAMES = ("bun_zipper.ply", "dragon_vrip.ply", "autzen_crop_1M.ply")
RUNS = 3


def seconds(work: Callable[[], Any]) -> float:
    """Return the processor seconds of a call."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME")
    options = parser.parse_args()
    one = salcore.Parameters(workers=1)
    print("| model | points | analysis | scales | together, of before | islands | basins |")
    print("|---|---|---|---|---|---|---|")
    for path in present(options.models / name for name in options.names):
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
        print(
            f"| {path.stem} | {len(points):,} | {first:.2f} s | {scales:.2f} s | "
            f"{1 + scales / first:.2f} | {islands:.2f} s | {basins:.2f} s |",
            flush=True,
        )


if __name__ == "__main__":
    main()
