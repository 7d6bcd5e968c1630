# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of methods that are compared, each a few lines on its own library.

`mesh_methods` and `point_methods` enter theirs with `method`. A method is a function of shape and
count to `Ready`: data converted and steps tuned to the count, neither of which is timed, only the
work that is left.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from benchmarks.common.shapes import Shape

OURS = "salient-simplify"
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


class Method(NamedTuple):
    """A method; `most` is the number of input points up to which it is run by default."""

    prepare: Callable[[Shape, int], Ready]
    package: str
    needs_faces: bool
    most: int


METHODS: dict[str, Method] = {}


def method(
    name: str, package: str, *, faces: bool = False, most: int = 2_000_000
) -> Callable[[Callable[[Shape, int], Ready]], Callable[[Shape, int], Ready]]:
    """Enter a function into the table of methods."""

    def enter(prepare: Callable[[Shape, int], Ready]) -> Callable[[Shape, int], Ready]:
        METHODS[name] = Method(prepare, package, faces, most)
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
