# SPDX-License-Identifier: GPL-3.0-or-later
"""Run one method in this process, and print its time and memory as JSON.

    python -m benchmarks.peers.run_one NAME SHAPE.npz COUNT OUT.npz

`benchmarks.peers.compare` starts a process of this for every row. Memory is the growth of the peak
of the resident set from the loaded arrays on, conversion included.
"""

from __future__ import annotations

import importlib.metadata
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.memory import peak, reset_peak
from benchmarks.common.shapes import Shape, example, saved
from benchmarks.peers import mesh_methods, point_methods  # noqa: F401  (they fill METHODS)
from benchmarks.peers.registry import METHODS, OURS, Unreachable


def measure(name: str, shape: Shape, count: int, out: Path) -> dict[str, Any]:
    """Run a method once, write what it returns and return its figures."""
    method = METHODS[name]
    try:
        warm = example()
        ready = method.prepare(warm, len(warm.points) // 2)
        ready.read(ready.work())  # what the first call loads counts for nobody
        reset_peak()
        before = peak()
        ready = method.prepare(shape, count)
        begun, worked = time.perf_counter(), time.process_time()
        result = ready.work()
        seconds, cpu = time.perf_counter() - begun, time.process_time() - worked
        outcome = ready.read(result)
    except ImportError as error:
        return {"missing": f"{method.package} ({error})"}
    except Unreachable as error:
        return {"unreachable": str(error)}
    memory = peak() - before
    np.savez(out, **{key: value for key, value in outcome._asdict().items() if value is not None})
    return {"seconds": seconds, "cpu": cpu, "memory": memory, "version": version(method.package)}


def version(package: str) -> str:
    """Return a package's version; ours need not be installed."""
    if package == OURS:
        import salcore

        return salcore.__version__
    return importlib.metadata.version(package)


def main() -> None:
    """Run the method that is named."""
    name, shape, count, out = sys.argv[1:]
    print(json.dumps(measure(name, saved(Path(shape)), int(count), Path(out))))


if __name__ == "__main__":
    main()
