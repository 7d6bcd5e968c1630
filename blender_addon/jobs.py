# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work in time slices: a plain class that a timer, a test or a loop drives to its end."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

from .salcore import Progress

SLICE = 0.1
"""Seconds of work between two looks at the window."""


class Job:
    """Work under way.

    A step that raises ends the job and passes the error on. Until the work's last step nothing in
    the scene may have changed: a job that is cancelled has never been.

    Parameters
    ----------
    steps : generator of Progress
        The work; it returns what `result` will hold.

    Attributes
    ----------
    stage : str
    fraction : float
        In [0, 1], never falling.
    done, cancelled : bool
    result : Any
        What the work returned, once it is done.
    """

    def __init__(self, steps: Generator[Progress, None, Any]) -> None:
        self.stage, self.fraction = "", 0.0
        self.done = self.cancelled = False
        self.result: Any = None
        self._steps = steps

    def advance(self, seconds: float = SLICE) -> bool:
        """Work for so long, or a step longer; return whether the job is done."""
        end = time.perf_counter() + seconds
        while not self.done and not self.cancelled:
            try:
                step = next(self._steps)
            except StopIteration as stop:
                self.result, self.done, self.fraction = stop.value, True, 1.0
                break
            except BaseException:
                self.cancelled = True
                raise
            self.stage, self.fraction = step.stage, max(self.fraction, step.fraction)
            if time.perf_counter() >= end:
                break
        return self.done

    def finish(self) -> Any:
        """Work to the end and return the result."""
        while not self.advance(float("inf")):
            if self.cancelled:
                raise RuntimeError("the job was cancelled")
        return self.result

    def cancel(self) -> None:
        """Stop for good; the work cleans up behind itself."""
        self.cancelled = not self.done
        self._steps.close()
