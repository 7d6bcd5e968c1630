# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare two states of the core: what they cost, or whether they return the same bits.

    python -m benchmarks.speed.before_after BEFORE AFTER [--repeat 3] [--only WORD]
    python -m benchmarks.speed.before_after BEFORE AFTER --same [--only WORD]

BEFORE and AFTER are folders of checkouts, or revisions of this repository. Every figure comes from
a process of its own; the two states take turns, and the least of the repeats counts, in CPU seconds
over all threads. *Floor* is what any method on a neighbourhood pays, ``cKDTree(points)`` and its
query for 17 nearest points; how far its ratio is from 1 says how far the others can be trusted.
*Peak* is the growth of the resident set over the input, through analysis and order.

With ``--same`` the exit status is 1 if any array differs.
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.common.models import ROOT, add_models_option, load, present

SMALL = 60_000  # up to so many points both presets and all targets are compared


class Input(NamedTuple):
    """A model, with its faces or as a cloud of its points."""

    file: str
    cloud: bool = False

    @property
    def name(self) -> str:
        """Return what the tables call it."""
        return Path(self.file).stem + (", points" if self.cloud else "")


TIMED = [
    Input("dragon_vrip.ply"),
    Input("dragon_vrip.ply", cloud=True),
    Input("autzen_crop_1M.ply"),
]
COMPARED = [
    Input("fandisk.obj"),
    Input("bun_zipper.ply"),
    Input("bun_zipper.ply", cloud=True),
    Input("Laurana50k.ply"),
    Input("autzen_crop_100k.ply"),
    *TIMED,
]
NASTY = "nasty"  # a folder of models; every file in it is compared
STAGES = {
    "floor": "floor, CPU s",
    "analyze": "analyze, CPU s",
    "regions": "analyze, and regions, CPU s",
    "order": "order and cut to 10 %, CPU s",
    "cut": "further cut to 5 %, CPU s",
    "memory": "peak, bytes a point",
}


def checkout(given: str, folder: Path) -> Path:
    """Return the folder of a state: a checkout that is there, or a revision's core, unpacked."""
    if (Path(given) / "salcore" / "__init__.py").exists():
        return Path(given).resolve()
    command = ["git", "-C", str(ROOT), "archive", "--format=tar", given, "salcore"]
    done = subprocess.run(command, capture_output=True)
    if done.returncode:
        raise SystemExit(
            f"{given}: neither a folder with salcore in it nor a revision of {ROOT}; give one"
        )
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return folder


def run_one(state: Path, task: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the core of one checkout in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.speed.one_checkout", str(state), task, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def save(path: Path, cloud: bool, output: Path) -> int:
    """Write a model's arrays for the processes, and return its number of points."""
    points, faces = load(path, cloud)
    np.savez(output, points=points, **({} if faces is None else {"faces": faces}))
    return len(points)


def timed(states: list[Path], given: Path, repeat: int) -> list[dict[str, float]]:
    """Return the least figures of each state; the states take turns at going first."""
    found: list[list[dict[str, float]]] = [[], []]
    for turn in range(repeat):
        for side in (0, 1) if turn % 2 == 0 else (1, 0):
            done = run_one(states[side], "time", str(given))
            if done.returncode:
                raise SystemExit(f"{states[side]} failed:\n{done.stderr}")
            found[side].append(json.loads(done.stdout.splitlines()[-1]))
    return [{stage: min(run[stage] for run in runs) for stage in STAGES} for runs in found]


def time_rows(name: str, count: int, before: dict[str, float], after: dict[str, float]) -> str:
    """Return the rows of one input."""
    lines = []
    for stage, label in STAGES.items():
        old, new = before[stage], after[stage]
        cells = [f"{old:.3f}", f"{new:.3f}", f"{new / old:.3f}"]
        cells += [f"{old / before['floor']:.2f}", f"{new / after['floor']:.2f}"]
        if stage == "memory":
            cells = [f"{old / count:.0f}", f"{new / count:.0f}", f"{new / old:.3f}", "", ""]
        lines.append(f"| {name} | {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def compare_times(states: list[Path], inputs: list[tuple[Input, Path]], repeat: int) -> None:
    """Print what both states cost."""
    print("| input | what | before | after | after / before | before / floor | after / floor |")
    print("|---|---|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder) / "input.npz"
        for item, path in inputs:
            count = save(path, item.cloud, given)
            before, after = timed(states, given, repeat)
            print(time_rows(f"{item.name} ({count})", count, before, after), flush=True)


def results(
    state: Path, given: Path, preset: str, depth: str, output: Path
) -> dict[str, np.ndarray]:
    """Return all arrays of a state; of a crash its last line."""
    done = run_one(state, "results", str(given), str(output), preset, depth)
    if done.returncode:
        return {"crash": np.array(done.stderr.strip().splitlines()[-1])}
    with np.load(output) as arrays:
        return dict(arrays)


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two arrays have the same type, shape and bits."""
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def in_input(name: str, arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Return an array with positions in `indices` replaced by the input points they stand for."""
    target, _, kind = name.rpartition("/")
    value = arrays[name]
    if kind not in ("faces", "source"):
        return value
    points = np.append(arrays[f"{target}/indices"], -1)  # -1 stays -1
    return points[value]


def difference(name: str, a: np.ndarray, b: np.ndarray) -> str:
    """Say in a few words how far two arrays differ."""
    kind = name.rpartition("/")[2]
    if kind == "indices":
        return (
            f"{name}: {len(np.setxor1d(a, b))} points kept by one alone, of {len(a)} and {len(b)}"
        )
    if kind == "faces":
        first, second = (set(map(tuple, rows.tolist())) for rows in (a, b))
        return f"{name}: {len(first ^ second)} faces of one alone, of {len(a)} and {len(b)}"
    if a.shape != b.shape or a.dtype != b.dtype:
        return f"{name}: {a.shape} {a.dtype} / {b.shape} {b.dtype}"
    text = f"{name}: {np.count_nonzero((a != b).reshape(len(a), -1).any(axis=1))} of {len(a)} rows"
    if a.dtype.kind == "f":
        text += f", by at most {np.nanmax(np.abs(a - b)):.3g}"
    if kind == "regions":
        text += f", {a.max(initial=-1) + 1} and {b.max(initial=-1) + 1} regions"
    return text


def failure(arrays: dict[str, np.ndarray]) -> str:
    """Return why a state has no results, or not all; empty if it has them."""
    return "; ".join(f"{key}: {arrays[key]}" for key in ("refusal", "crash") if key in arrays)


def differences(before: dict[str, np.ndarray], after: dict[str, np.ndarray]) -> list[str]:
    """Return a few words about each array that differs, or about a failure of one state alone."""
    if failure(before) != failure(after):
        return [f"{failure(before) or 'results'} / {failure(after) or 'results'}"]
    names = dict.fromkeys([*before, *after])
    alone = [name for name in names if name not in before or name not in after]
    differ = [
        name for name in names if name not in alone and not same_bits(before[name], after[name])
    ]
    return [f"{name}: returned by one alone" for name in alone] + [
        difference(name, in_input(name, before), in_input(name, after)) for name in differ
    ]


def compare_results(states: list[Path], inputs: list[tuple[Input, Path]]) -> bool:
    """Print where both states return the same bits; return whether they do everywhere."""
    print("| input | preset | arrays | same | what differs (before / after) |")
    print("|---|---|---:|---|---|")
    all_same = True
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder) / "input.npz"
        outputs = Path(folder) / "before.npz", Path(folder) / "after.npz"
        for item, path in inputs:
            count = save(path, item.cloud, given)
            small = count <= SMALL
            for preset in ("default", "paper") if small else ("default",):
                depth = "thorough" if small else "main"
                before, after = (
                    results(state, given, preset, depth, output)
                    for state, output in zip(states, outputs, strict=True)
                )
                found = differences(before, after)
                all_same &= not found
                note = "; ".join(found) or failure(before)
                cells = [item.name, preset, str(len(before)), "no" if found else "yes", note]
                print("| " + " | ".join(cells) + " |", flush=True)
    return all_same


def main() -> None:
    """Compare as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", help="folder of a checkout, or a revision")
    parser.add_argument("after", help="folder of a checkout, or a revision")
    parser.add_argument("--same", action="store_true", help="compare results instead of costs")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each state; default: 3")
    parser.add_argument(
        "--only", default="", metavar="WORD", help="inputs whose name contains this"
    )
    add_models_option(parser)
    options = parser.parse_args()
    inputs = [*COMPARED] if options.same else [*TIMED]
    if options.same:
        for folder in present([options.models / NASTY]):
            inputs += [Input(f"{NASTY}/{path.name}") for path in sorted(folder.iterdir())]
    inputs = [item for item in inputs if options.only.lower() in item.name.lower()]
    if not inputs:
        raise SystemExit(f"--only: no input's name contains {options.only!r}; leave it out for all")
    paths = set(present(dict.fromkeys(options.models / item.file for item in inputs)))
    found = [(item, options.models / item.file) for item in inputs]
    found = [(item, path) for item, path in found if path in paths]
    with tempfile.TemporaryDirectory() as folder:
        given = zip((options.before, options.after), ("before", "after"), strict=True)
        states = [checkout(state, Path(folder) / name) for state, name in given]
        if not options.same:
            compare_times(states, found, options.repeat)
        elif not compare_results(states, found):
            raise SystemExit(1)


if __name__ == "__main__":
    main()
