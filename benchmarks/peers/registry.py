# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that are compared, each a few lines on its own library behind one interface.

    python benchmarks/rivals.py NAME SHAPE.npz COUNT OUT.npz

runs one of them in this process and prints time and memory as JSON; peers.py calls it so for every
row. A method is a function of shape and count to `Ready`: data converted and steps tuned to the
count, neither of which is timed, only the work that is left. Memory is the growth of the peak of
the resident set from the loaded arrays on, conversion included.
"""

from __future__ import annotations

import importlib.metadata
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from memory import peak, reset_peak
from shapes import Shape, example, saved

NEAR = 0.003  # a count within this share is met


class Outcome(NamedTuple):
    """What a method returns: kept points of the input, or points of its own; a mesh's faces."""

    indices: np.ndarray | None = None
    points: np.ndarray | None = None
    faces: np.ndarray | None = None


class Ready(NamedTuple):
    """Work that can begin at once, and how its result is read."""

    work: Callable[[], Any]
    read: Callable[[Any], Outcome] = lambda result: result


class Unreachable(Exception):
    """The method cannot keep so few points; the message says how few it can."""


class Rival(NamedTuple):
    """A method; `most` is the number of input points up to which it is run by default."""

    prepare: Callable[[Shape, int], Ready]
    package: str
    needs_faces: bool
    most: int


RIVALS: dict[str, Rival] = {}


def rival(
    name: str, package: str, *, faces: bool = False, most: int = 2_000_000
) -> Callable[[Callable[[Shape, int], Ready]], Callable[[Shape, int], Ready]]:
    """Enter a function into the table of methods."""

    def enter(prepare: Callable[[Shape, int], Ready]) -> Callable[[Shape, int], Ready]:
        RIVALS[name] = Rival(prepare, package, faces, most)
        return prepare

    return enter


def seek(size: Callable[[float], int], count: int, value: float, power: float) -> float:
    """Return the value at which size(value), which goes as value**power, comes nearest to count."""
    best = (np.inf, value)
    for _ in range(10):
        got = size(value)
        best = min(best, (abs(got - count), value))
        if best[0] <= NEAR * count:
            break
        value *= (count / max(got, 1)) ** (1 / power)
    return best[1]


def halve(size: Callable[[float], int], count: int, low: float, high: float) -> float:
    """Return the value between bounds, at which a falling size(value) comes nearest to count."""
    best = (np.inf, low)
    for _ in range(18):
        value = (low * high) ** 0.5
        got = size(value)
        best = min(best, (abs(got - count), value))
        if best[0] <= NEAR * count:
            break
        low, high = (value, high) if got > count else (low, value)
    return best[1]


def measure(name: str, shape: Shape, count: int, out: Path) -> dict[str, Any]:
    """Run a method once, write what it returns and return its figures."""
    method = RIVALS[name]
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
    return {
        "seconds": seconds,
        "cpu": cpu,
        "memory": memory,
        "version": importlib.metadata.version(method.package),
    }


def main() -> None:
    """Run the method that is named."""
    import methods_mesh  # noqa: F401  (enter themselves into the table)
    import methods_points  # noqa: F401

    name, shape, count, out = sys.argv[1:]
    print(json.dumps(measure(name, saved(Path(shape)), int(count), Path(out))))


if __name__ == "__main__":
    sys.modules["rivals"] = sys.modules["__main__"]  # one table, whoever imports it
    main()
