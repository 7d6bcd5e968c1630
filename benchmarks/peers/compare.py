# SPDX-License-Identifier: GPL-3.0-or-later
"""All methods at equal count: time, memory, and quality by neutral tools, in one run.

    python -m benchmarks.peers.compare [--models FOLDER] [--only NAME ...] [--ratios 0.1 0.02]
        [--methods NAME ...] [--blender PYTHON] [--figures FOLDER] [--draw]

Writes peers.json, peers.md and plots. NAME is a model, "curve" (further ratios of one) or "series"
(sizes of one scene). Every method runs in a fresh process. With --only or
--methods the other rows of peers.json stay; --draw writes tables and plots from it alone.

Left out by rule, and said: a method on a model of more points than its `most` (`registry.Method`),
in the series over sizes on one of five times as many.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.build import Build, build
from benchmarks.common.models import ROOT, add_models_option, present
from benchmarks.common.shapes import Shape, part, read
from benchmarks.peers import mesh_methods, point_methods  # noqa: F401  (they fill METHODS)
from benchmarks.peers.registry import METHODS, Outcome

MODELS = (
    "bun_zipper.ply",
    "Laurana50k.ply",
    "fandisk.obj",
    "rockerArm.ply",
    "lion_takanawa_341989.ply",
    "autzen_crop_100k.ply",
    "dragon_vrip.ply",
)
CURVE = ("bun_zipper.ply", (0.5, 0.2, 0.05, 0.01))  # further ratios, for the plot alone
SIZES = (
    ("autzen_crop_100k.ply", (10_000, 30_000, 100_000)),
    ("autzen_crop_1M.ply", (300_000, 1_000_000)),
    ("autzen_laz", (3_000_000, 10_000_000)),
)
SERIES = (
    "voxel grid",
    "farthest point",
    "Poisson disk",
    "hierarchy",
    "k-means with normals",
    "grid with normals",
    "ours, cloud",
)
PARTS = [*MODELS, "curve", "series"]
STRETCH = 5  # in the series over sizes, where no method is judged and hence run but once

Row = dict[str, Any]


def run(name: str, shape: Path, count: int, blender: str) -> tuple[Row, Outcome | None]:
    """Run a method in a process of its own; return its figures and what it made."""
    python = blender if METHODS[name].package == "bpy" else sys.executable
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.npz"
        command = [python, "-m", "benchmarks.peers.run_one", name]
        command += [str(shape), str(count), str(out)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            return {"missing": done.stderr.strip().splitlines()[-1]}, None
        row = json.loads(done.stdout.strip().splitlines()[-1])
        if not out.exists():
            return row, None
        with np.load(out) as arrays:
            return row, Outcome(**arrays)


def kept(outcome: Outcome) -> int:
    """Return how many points a method kept or made."""
    return len(outcome.indices if outcome.points is None else outcome.points)


def compare(path: Path, ratios: Iterable[float], options: argparse.Namespace) -> list[Row]:
    """Run every method on one model at every ratio."""
    from benchmarks.peers.quality import Judge  # here, so that --draw needs no open3d

    shape = read(path)
    judge, rows = Judge(shape), []
    with tempfile.TemporaryDirectory() as folder:
        stored = Path(folder) / "shape.npz"
        shape.save(stored)
        for ratio in ratios:
            count = round(ratio * len(shape.points))
            for name in options.methods:
                row = {"model": path.stem, "ratio": ratio, "asked": count, "method": name}
                rows.append(row)
                row |= left_out(name, shape)
                if "left out" not in row:
                    figures, outcome = run(name, stored, count, options.blender)
                    row |= figures
                    if outcome is not None:
                        row |= {"points": kept(outcome)} | judge.figures(outcome)
                print(brief(row), flush=True)
    for row in rows:
        row["of"] = len(shape.points)
    return [row for row in rows if row.get("left out") != ""]


def left_out(name: str, shape: Shape, stretch: int = 1) -> Row:
    """Return why a method is not run on a shape; an empty reason where it does not apply at all.

    Its limit is multiplied by `stretch`.
    """
    if METHODS[name].needs_faces and shape.faces is None:
        return {"left out": ""}
    if len(shape.points) > stretch * METHODS[name].most:
        return {"left out": f"more than {stretch * METHODS[name].most:,} points"}
    return {}


def series(options: argparse.Namespace) -> list[Row]:
    """Time point methods on a scene of ever more points, at a tenth of them."""
    rows = []
    for model, sizes in SIZES:
        if not present([options.models / model]):
            continue
        whole = read(options.models / model)
        with tempfile.TemporaryDirectory() as folder:
            stored = Path(folder) / "shape.npz"
            for size in sizes:
                shape = part(whole, min(size, len(whole.points)))
                shape.save(stored)
                for name in [name for name in SERIES if name in options.methods]:
                    row = {"model": "series", "of": len(shape.points), "method": name}
                    row |= left_out(name, shape, STRETCH)
                    rows.append(row)
                    if "left out" not in row:
                        row |= run(name, stored, len(shape.points) // 10, options.blender)[0]
                    print(brief(row), flush=True)
    return rows


def brief(row: Row) -> str:
    """Return a row as a line on the screen."""
    head = f"{row['model']:22} {row.get('ratio', row.get('of')):>8} {row['method']:34}"
    for reason in ("left out", "missing", "unreachable"):
        if reason in row:
            return f"{head} {reason}: {row[reason]}" if row[reason] else f"{head} needs faces"
    surface = row.get("mesh") or row.get("rebuilt")
    error = f"{row['points']:7} points  rms {surface['rms']:.4f} %" if surface else ""
    return f"{head} {row['seconds']:8.3f} s  {error}"


def same(row: Row) -> tuple:
    """Return what tells rows apart."""
    return row["model"], row.get("ratio"), row["of"], row["method"]


def gather(options: argparse.Namespace) -> None:
    """Run what is asked for and write it into peers.json, model by model."""
    path = options.figures / "peers.json"
    partial = options.only != PARTS or len(options.methods) < len(METHODS)
    rows = json.loads(path.read_text())["rows"] if partial and path.exists() else []
    now = build()
    for name in options.only:
        if name == "series":
            new = series(options)
        else:
            model, ratios = CURVE if name == "curve" else (name, options.ratios)
            if not present([options.models / model]):
                continue
            new = compare(options.models / model, ratios, options)
        merged = {same(row): row for row in rows} | {same(row): row for row in stamped(new, now)}
        rows = list(merged.values())
        path.write_text(json.dumps({"build": now, "rows": rounded(rows)}, indent=0))


def stamped(rows: list[Row], now: Build) -> list[Row]:
    """Return rows that say which core they were measured with, for rows of others may stay."""
    return [row | {"core": now["core"]} for row in rows]


def rounded(value: Any) -> Any:
    """Return figures with five digits, which keeps the file small."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def main() -> None:
    """Run, then write tables and plots."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("--only", nargs="+", default=PARTS, metavar="NAME")
    parser.add_argument("--ratios", nargs="+", type=float, default=[0.1, 0.02])
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=list(METHODS))
    parser.add_argument("--blender", default=sys.executable, help="a Python that has bpy")
    parser.add_argument("--figures", type=Path, default=Path("docs/figures"))
    parser.add_argument("--draw", action="store_true", help="only tables and plots, no runs")
    options = parser.parse_args()
    options.figures.mkdir(parents=True, exist_ok=True)
    if not options.draw:
        gather(options)
    from benchmarks.peers import tables  # here, so that runs need no matplotlib

    tables.write(options.figures)


if __name__ == "__main__":
    main()
