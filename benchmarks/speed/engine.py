# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of analysis, order and cuts, against a floor and MeshLab in the same process.

    python -m benchmarks.speed.engine MODEL.ply mesh|cloud

prints one row as JSON; `benchmarks.speed` starts a process of this for each. The floor is what any
method on a neighbourhood pays: a k-d tree and its query for 17 nearest points. Seconds are the
processor's, memory is the growth of the peak of the resident set over the input.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import salcore
from benchmarks.common.memory import peak, reset_peak
from benchmarks.common.models import load
from benchmarks.speed.floor import floor

RATIO = 0.1
FURTHER = 0.05
REPEAT = 3


def seconds(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor seconds of a call, and what it returns."""
    begun = time.process_time()
    result = function()
    return time.process_time() - begun, result


def measure(path: Path, kind: str) -> dict[str, Any]:
    """Return one row of figures."""
    points, faces = load(path, cloud=kind == "cloud")
    count = 0 if faces is None else len(faces)
    salcore.simplify(points[:1000], ratio=0.5)  # what the first call loads counts for nobody
    reset_peak()
    before = peak()
    analyzing, analysis = seconds(lambda: salcore.analyze(points, faces))
    cutting, result = seconds(lambda: analysis.simplify(ratio=RATIO))
    memory = peak() - before
    rough = dataclasses.replace(analysis.parameters, refine=False)
    row = {
        "model": path.stem,
        "kind": kind,
        "points": len(points),
        "rounds": len(analysis.rounds),
        "analyze": analyzing,
        "cut": cutting,
        "further": min(seconds(lambda: analysis.simplify(ratio=FURTHER))[0] for _ in range(REPEAT)),
        "measure": seconds(lambda: result.report.errors)[0],
        "memory": memory / len(points),
        "estimated": salcore.estimated_memory(len(points), count) / len(points),
        "floor": min(seconds(lambda: floor(points))[0] for _ in range(REPEAT)),
        "paper": seconds(
            lambda: salcore.analyze(
                points, faces, parameters=salcore.Parameters.preset("paper")
            ).simplify(alpha=30)
        )[0],
        "alpha": seconds(lambda: salcore.analyze(points, faces).simplify(alpha=30))[0],
    }
    if faces is not None:
        draft = seconds(lambda: salcore.analyze(points, faces, parameters=rough))[1]
        draft.simplify(ratio=RATIO)
        row["draft"] = min(seconds(lambda: draft.simplify(ratio=FURTHER))[0] for _ in range(REPEAT))
        row["MeshLab"] = meshlab(points, faces, len(result.faces))
    return row


def meshlab(points: Any, faces: Any, count: int) -> float:
    """Return the seconds of MeshLab's quadric decimation to so many faces."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points, faces))
    return seconds(
        lambda: meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=count, optimalplacement=False
        )
    )[0]


if __name__ == "__main__":
    print(json.dumps(measure(Path(sys.argv[1]), sys.argv[2])))
