# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simplification can be asked for, and how many points that comes to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import ParameterError
from ..parameters import TARGETS
from ..progress import SILENT, Progress

CLOSE = 0.01
"""Share of the count to which the fewest points within an error are found."""
STEP = 1.4
"""Factor by which the count grows or falls until it brackets the error."""


def one_target(targets: dict[str, Any]) -> tuple[str, float]:
    """Return the name and the checked value of the one target that is not None.

    Raises
    ------
    ParameterError
        If there is none, more than one, or one out of bounds.
    """
    rows = {row.name: row for row in TARGETS}
    given = {name: value for name, value in targets.items() if value is not None}
    unknown = [name for name in given if name not in rows]
    if unknown:
        raise ParameterError(f"no target {unknown[0]!r}: give one of {', '.join(rows)}")
    if not given:
        raise ParameterError(f"no target given: give one of {', '.join(rows)}")
    if len(given) > 1:
        raise ParameterError(f"{len(given)} targets given ({', '.join(given)}): give one of them")
    ((name, value),) = given.items()
    if name == "faces" and np.ndim(value):
        raise ParameterError("faces: give the number of faces to keep")
    return name, rows[name].check(value)


def count_for(name: str, value: float, available: int, protected: int) -> int:
    """Return the number of points for the target "count" or "ratio".

    Raises
    ------
    ParameterError
        If there are fewer points, or more protected ones.
    """
    if name == "count" and value > available:
        raise ParameterError(
            f"count={value}: there are {available} valid points; give at most so many"
        )
    count = int(value) if name == "count" else max(round(value * available), min(1, available))
    if count < protected:
        raise ParameterError(
            f"{name}={value:g}: that is {count} points, but {protected} are protected; "
            "give more or protect fewer"
        )
    return count


def count_for_faces(
    faces: int, measure: Callable[[int], int], most: int, progress: Progress = SILENT
) -> int:
    """Return the largest count of points that leaves at most so many faces; 0 if none does.

    Parameters
    ----------
    faces : int
    measure : callable
        Returns the number of faces that a count leaves, which grows with it.
    most : int
        Largest count.
    """
    low, high, below, above = 0, most, 0, measure(most)
    if above <= faces:
        return most
    trials = 0
    while high - low > 1:
        share = (faces + 0.5 - below) / (above - below)
        if trials % 3 == 2:  # a straight line may miss for long
            share = 0.5
        trial = int(np.clip(low + share * (high - low), low + 1, high - 1))
        left = measure(trial)
        if left <= faces:
            low, below = trial, left
        else:
            high, above = trial, left
        trials += 1
        progress(1.0 - 0.8**trials)
    return low


def count_within(
    bound: float,
    start: int,
    most: int,
    measure: Callable[[int], float],
    least: int,
    progress: Progress = SILENT,
) -> int:
    """Return about the fewest points whose measured error is within a bound.

    Parameters
    ----------
    bound : float
    start : int
        Count that is estimated to have this error.
    most : int
        Number of all points.
    measure : callable
        Measures the error of a count.
    least : int
        Fewest points to try.
    progress : Progress, optional

    Notes
    -----
    The measured error need not fall with every point added; the count returned was measured, and
    is within one per cent of one that is too small.
    """
    high = int(np.clip(start, max(least, 1), most))
    low = 0
    trials = 0
    while high < most and measure(high) > bound:
        low, high = high, min(int(high * STEP) + 1, most)
        trials += 1
        progress(1.0 - 0.8**trials)
    fewest = max(least, 1)
    # Without a count that is too small the search still goes down; then it halves.
    while high - low > max(CLOSE * high, 1) if low else high > fewest:
        trial = (low + high) // 2 if low else max(int(high / STEP), fewest)
        if measure(trial) > bound:
            low = trial
        else:
            high = trial
        trials += 1
        progress(1.0 - 0.8**trials)
    return high
