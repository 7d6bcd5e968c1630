# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress and cancel: long work is a generator, and this module drives it to its end.

A generator yields wherever it may rest, so that a host can look after its window in between. Work
on a million points is cut into steps of about a tenth of a second: blocks where that is easy, else
the statements of a function. What scipy does in one call stays one step.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, NamedTuple, TypeVar

from .errors import Cancelled, ParameterError

Result = TypeVar("Result")

Steps = Generator[float | None, None, Result]
"""Work that yields the fraction it has done, or None to rest where the fraction stays."""

Rests = Generator[None, None, Result]
"""Work that does not tell its fraction, and only rests between its parts."""


class Progress(NamedTuple):
    """How far work has come."""

    stage: str
    """Name of the stage under way, for people."""
    fraction: float
    """Share done of the whole work, in [0, 1], never falling."""


Callback = Callable[[str, float], bool | None]
"""Called with stage and fraction; returning False cancels, None goes on."""


def finish(steps: Generator[Any, None, Result]) -> Result:
    """Run work to its end without looking at its progress."""
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result


def staged(
    stage: str, begin: float, end: float, steps: Steps[Result]
) -> Generator[Progress, None, Result]:
    """Yield the progress of one stage as a part of the whole, and return the stage's result."""
    at = Progress(stage, begin)
    yield at
    while True:
        try:
            fraction = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        if fraction is not None:
            at = Progress(stage, begin + (end - begin) * fraction)
        yield at


def part(
    begin: float, end: float, steps: Generator[Progress, None, Result]
) -> Generator[Progress, None, Result]:
    """Yield the progress of whole work as a part of larger work, and return its result."""
    while True:
        try:
            at = next(steps)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        yield Progress(at.stage, begin + (end - begin) * at.fraction)


def run(steps: Generator[Progress, None, Result], progress: Callback | None = None) -> Result:
    """Run work to its end, calling `progress` at every step.

    Raises
    ------
    Cancelled
        If the callback returned False; the work is closed and has left nothing behind.
    ParameterError
        If `progress` cannot be called.
    """
    if progress is not None and not callable(progress):
        raise ParameterError(
            f"progress of type {type(progress).__name__}: give a function of stage and fraction"
        )
    try:
        while True:
            try:
                at = next(steps)
            except StopIteration as stop:
                result: Result = stop.value
                return result
            answer = None if progress is None else progress(at.stage, at.fraction)
            if answer is not None and not answer:
                raise Cancelled(f"cancelled during {at.stage}")
    finally:
        steps.close()
