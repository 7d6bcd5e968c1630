# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans in tiles against the same scans in memory: what they take, and what differs.

    python -m benchmarks.tiles.scans [--models FOLDER] [--figures FOLDER] [--only PART ...]

Runs the command as a user does, on a crop of a million points, on one and on all of nine LAZ files.
Every figure that was measured stays in tiles.json, of which tiles.md is written anew, so that parts
may be measured one at a time.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import laspy
import numpy as np

from benchmarks.common.build import build, said
from benchmarks.common.models import ROOT, add_models_option, load
from benchmarks.common.page import FIGURES
from benchmarks.tiles.borders import agreement
from benchmarks.tiles.processes import Taken, run

RATIO = 0.1
CROP, SCAN, ONE = "autzen_crop_1M.ply", "autzen_laz", "autzen_11.laz"
SMALL, LARGE = "1.25G", "4G"
"""Memory for two workers: tiles of at most 300,000 points, and of a million."""


def write_crop(models: Path, folder: Path) -> Path:
    """Write the crop as a LAZ file."""
    points, _ = load(models / CROP, cloud=True)
    header = laspy.LasHeader(version="1.2", point_format=2)
    header.scales, header.offsets = [0.01] * 3, np.floor(points.min(axis=0))
    scan = laspy.LasData(header)
    scan.x, scan.y, scan.z = points.T
    scan.write(str(folder / "crop.laz"))
    return folder / "crop.laz"


def simplify(given: list[Path], output: Path, *options: str) -> tuple[Taken, dict[str, Any]]:
    """Run the command, and return what it took and its report."""
    report = output.with_suffix(".json")
    files = [str(path) for path in given]
    command = [sys.executable, "-m", "meshlab_filter", "simplify", *files, str(output)]
    command += ["--ratio", str(RATIO), "--workers", "2", "--quiet", "--report", str(report)]
    taken = run([*command, *options])
    return taken, json.loads(report.read_text())


def in_memory(given: list[Path], output: Path, *options: str) -> tuple[Taken, dict[str, Any]]:
    """Run the command in memory."""
    return simplify(given, output, "--memory", "1T", *options)


def measure_crop(models: Path, folder: Path) -> dict[str, Any]:
    """Measure the crop in four tiles, by two processes and by Dask."""
    crop = write_crop(models, folder)
    whole, before = in_memory([crop], folder / "whole.laz")
    tiles, after = simplify([crop], folder / "tiles.laz", "--tiled", "--memory", SMALL)
    dask = folder / "dask.laz"
    simplify([crop], dask, "--tiled", "--memory", SMALL, "--scheduler", "local", "--no-errors")
    rms = {
        kind: after["errors"][kind]["rms"] / before["errors"][kind]["rms"]
        for kind in ("point", "surface")
    }
    largest = after["errors"]["surface"]["max"] / before["errors"]["surface"]["max"]
    return {
        "points": before["points_before"],
        "tiles": after["tiles"],
        "whole": dataclasses.asdict(whole),
        "tiled": dataclasses.asdict(tiles),
        "rms": rms,
        "largest": largest,
        "same bytes by Dask": dask.read_bytes() == (folder / "tiles.laz").read_bytes(),
        **agreement([crop], folder / "whole.laz", folder / "tiles.laz", 300_000, RATIO),
    }


def measure_one(models: Path, folder: Path) -> dict[str, Any]:
    """Measure one file in tiles as large as those of all files."""
    options = ("--tiled", "--memory", LARGE, "--no-errors")
    taken, report = simplify([models / SCAN / ONE], folder / "one.laz", *options)
    return {
        "points": report["input_points"],
        "tiles": report["tiles"],
        "largest tile": report["largest_tile"],
        "tiled": dataclasses.asdict(taken),
    }


def measure_scan(models: Path, folder: Path) -> dict[str, Any]:
    """Measure all files in tiles and in memory."""
    files = sorted((models / SCAN).glob("*.laz"))
    options = ("--tiled", "--memory", LARGE, "--no-errors")
    tiled, report = simplify(files, folder / "tiles.laz", *options)
    whole, _ = in_memory(files, folder / "whole.laz", "--no-errors")
    return {
        "points": report["input_points"],
        "kept": report["kept_points"],
        "tiles": report["tiles"],
        "largest tile": report["largest_tile"],
        "whole": dataclasses.asdict(whole),
        "tiled": dataclasses.asdict(tiled),
        **agreement(files, folder / "whole.laz", folder / "tiles.laz", 1_000_000, RATIO),
    }


PARTS = {"crop": measure_crop, "one": measure_one, "scan": measure_scan}


def page(found: dict[str, Any]) -> str:
    """Return the page of what was measured."""
    lines = [
        "# Scans in tiles",
        "",
        said(found["build"]),
        "",
        "`python -m benchmarks.tiles.scans --models FOLDER` writes this page: LiDAR from LAZ to",
        "LAZ at 10 %, by two processes, against the same in memory. Memory is all processes'",
        "together. *Wall on two free cores* is worked out from CPU seconds, for the machine did",
        "other things beside: those of the first process, and half of the others'. *Load* is the",
        "mean number of processes that were ready to run, on two cores.",
        "",
        "| | points | tiles | CPU seconds | in memory | share | wall on two free "
        "cores | wall measured (load) | in memory (load) | GB | in memory |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    names = {"crop": "crop, with errors", "scan": "nine files", "one": "one of them"}
    for key, name in names.items():
        if key in found:
            lines.append(_taken_row(name, found[key]))
    if {"one", "scan"} <= found.keys():
        one, scan = found["one"], found["scan"]
        memory = scan["tiled"]["memory"] / one["tiled"]["memory"]
        size = scan["largest tile"] / one["largest tile"]
        lines += [
            "",
            f"Nine files take {memory:.2f} times the memory of one of them; their largest tile has "
            f"{size:.2f} times",
            f"as many points with its halo. For tiles of equal size that is {memory / size:.2f}.",
        ]
    lines += [
        "",
        "| | halo | Jaccard index of kept points | within two halos of a border | share of points "
        "there | density of kept points there, of elsewhere | rms to points, of the whole's "
        "| to the surface | largest |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for key, name in names.items():
        if "jaccard" in found.get(key, {}):
            lines.append(_agreement_row(name, found[key]))
    if "crop" in found:
        same = "the same bytes" if found["crop"]["same bytes by Dask"] else "other bytes"
        lines += ["", f"Dask with two workers writes {same} as the pool (crop)."]
    lines += [
        "",
        "*Density* is the number of kept points over that of the run in memory, on the same",
        "ground, so that ground of another kind counts for nothing.",
        "",
    ]
    return "\n".join(lines)


def _taken_row(name: str, one: dict[str, Any]) -> str:
    tiled = Taken(**one["tiled"])
    cells = [name, f"{one['points']:,}", str(one["tiles"]), f"{tiled.cpu:.0f}"]
    memory = f"{tiled.memory / 1e9:.2f}"
    if "whole" in one:
        whole = Taken(**one["whole"])
        cells += [f"{whole.cpu:.0f}", f"{tiled.cpu / whole.cpu:.2f}"]
        alone = f"{tiled.on_two_cores:.0f}" if tiled.alone > 1.0 else ""
        cells += [alone, _wall(tiled), _wall(whole)]
        cells += [memory, f"{whole.memory / 1e9:.2f}"]
    else:
        cells += ["", "", "", _wall(tiled), "", memory, ""]
    return f"| {' | '.join(cells)} |"


def _wall(taken: Taken) -> str:
    return f"{taken.wall:.0f} ({taken.load:.0f})"


def _agreement_row(name: str, one: dict[str, Any]) -> str:
    cells = [name, f"{one['halo']:.1f}", f"{one['jaccard']:.4f}", f"{one['jaccard_near']:.4f}"]
    cells += [f"{one['share_near']:.0%}", f"{one['density']:.4f}"]
    if "rms" in one:
        cells += [f"{one['rms'][kind]:.4f}" for kind in ("point", "surface")]
        cells.append(f"{one['largest']:.3f}")
    else:
        cells += ["", "", ""]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Measure what is asked for, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART")
    parser.add_argument("--figures", type=Path, default=FIGURES, help="folder of the page")
    options = parser.parse_args()
    os.environ["PYTHONPATH"] = str(ROOT)
    path = options.figures / "tiles.json"
    found = json.loads(path.read_text()) if path.exists() else {}
    if found.get("build", {}).get("core") != build()["core"]:
        found = {}  # of another build: not to be mixed
    found["build"] = build()
    for name in options.only:
        with tempfile.TemporaryDirectory() as folder:
            found[name] = PARTS[name](options.models, Path(folder))
        path.write_text(json.dumps(found, indent=1) + "\n")
        path.with_suffix(".md").write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
