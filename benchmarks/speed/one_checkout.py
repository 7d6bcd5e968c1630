# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the core of one checkout on saved arrays; `before_after` starts a process of this for each.

    python -m benchmarks.speed.one_checkout CHECKOUT time INPUT.npz
    python -m benchmarks.speed.one_checkout CHECKOUT results INPUT.npz OUTPUT.npz

The first prints CPU seconds and memory as JSON, the second writes all arrays that a caller sees.
Only public names are used that every state of the core has: `analyze`, `Analysis.simplify` and the
report. Thorough results are those of more targets, and the errors of each.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.common.memory import peak, reset_peak
from benchmarks.speed.floor import floor

RATIO, FURTHER = 0.1, 0.05
ALPHA = 30.0
LARGEST_ERROR = 0.002
CUTS = 3  # a cut takes milliseconds, so the least of a few is taken


def core_of(checkout: Path) -> ModuleType:
    """Import salcore from a checkout, and from nowhere else."""
    sys.path.insert(0, str(checkout))
    import salcore

    found = Path(str(salcore.__file__)).resolve()
    if not found.is_relative_to(checkout.resolve()):
        raise SystemExit(f"salcore was found in {found.parent}, not in {checkout}")
    return salcore


def saved(path: Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Return points and faces that `before_after` wrote."""
    with np.load(path) as arrays:
        return arrays["points"], arrays.get("faces")


def cpu_seconds(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the CPU time of a call, over all its threads, and its result."""
    begun = time.process_time()
    result = function()
    return time.process_time() - begun, result


def warm_up(salcore: ModuleType) -> None:
    """Load what a first call loads, which belongs to no measurement."""
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.sin(x * y).ravel()])
    faces = np.array([(k, k + 1, k + 20) for k in range(379) if k % 20 < 19])
    for triangles in (None, faces):
        salcore.analyze(points, triangles).simplify(ratio=0.5)


def measure(salcore: ModuleType, points: np.ndarray, faces: np.ndarray | None) -> dict[str, float]:
    """Return CPU seconds of every stage, and the peak of memory beside the input in bytes."""
    warm_up(salcore)
    reset_peak()
    before = peak()
    analyze, analysis = cpu_seconds(lambda: salcore.analyze(points, faces))
    order, _ = cpu_seconds(lambda: analysis.simplify(ratio=RATIO))
    memory = peak() - before
    regions, _ = cpu_seconds(lambda: analysis.regions)  # where they are only made when asked for
    cuts = [cpu_seconds(lambda: analysis.simplify(ratio=FURTHER))[0] for _ in range(CUTS)]
    return {
        "floor": cpu_seconds(lambda: floor(points))[0],  # last, so that memory is not its own
        "analyze": analyze,
        "regions": analyze + regions,
        "order": order,
        "cut": min(cuts),
        "memory": memory,
    }


def simplified(name: str, result: Any, thorough: bool) -> dict[str, np.ndarray]:
    """Return the arrays of a simplification, under a name."""
    fields = ("indices", "source", "faces", "face_source", "positions")
    arrays = {field: getattr(result, field) for field in fields}
    if thorough:
        arrays["errors"] = numbers(result.report.errors.as_dict())
    return {f"{name}/{key}": value for key, value in arrays.items() if value is not None}


def numbers(figures: dict[str, Any]) -> np.ndarray:
    """Return the numbers in nested dicts, in their order."""
    parts = [numbers(x) if isinstance(x, dict) else np.array([x]) for x in figures.values()]
    return np.concatenate(parts)


def results(
    salcore: ModuleType, points: np.ndarray, faces: np.ndarray | None, preset: str, thorough: bool
) -> dict[str, np.ndarray]:
    """Return all arrays that a caller sees, for several targets; of a refusal its sentence."""
    parameters = salcore.Parameters.preset(preset)
    found: dict[str, np.ndarray] = {}
    try:
        analysis = salcore.analyze(points, faces, parameters=parameters)
        for name in ("saliency", "regions", "normals"):
            found[name] = getattr(analysis, name)
        targets: list[dict[str, float]] = [{"ratio": RATIO}, {"ratio": FURTHER}, {"alpha": ALPHA}]
        if thorough:
            targets.append({"max_error": LARGEST_ERROR})
        for target in targets:
            name = " ".join(f"{key} {value:g}" for key, value in target.items())
            found |= simplified(name, analysis.simplify(**target), thorough)
        if thorough and faces is not None:
            moved = replace(parameters, placement="optimal")
            analysis = salcore.analyze(points, faces, parameters=moved)
            found |= simplified("optimal placement", analysis.simplify(ratio=RATIO), thorough)
    except salcore.SalcoreError as error:
        found["refusal"] = np.array(f"{type(error).__name__}: {error}")
    return found


def main() -> None:
    """Do what the command line says."""
    checkout, task, given, *rest = sys.argv[1:]
    points, faces = saved(Path(given))
    salcore = core_of(Path(checkout))
    if task == "time":
        print(json.dumps(measure(salcore, points, faces)))
    else:
        output, preset, thorough = rest
        np.savez(output, **results(salcore, points, faces, preset, thorough == "thorough"))


if __name__ == "__main__":
    main()
