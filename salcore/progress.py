# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress and cancel: long functions take one `Progress` and call it with the share done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from .errors import Cancelled, ParameterError

Callback = Callable[[str, float], bool | None]
"""Called with stage and fraction; returning False cancels, None goes on."""


@dataclass(frozen=True)
class Progress:
    """A stretch of the whole work, which a callback follows and may cancel.

    Attributes
    ----------
    callback : callable or None
    stage : str
        Name of the stage under way, for people.
    begin, end : float
        Where the stretch lies in the whole work, in [0, 1].

    Raises
    ------
    ParameterError
        If `callback` cannot be called.
    """

    callback: Callback | None = None
    stage: str = ""
    begin: float = 0.0
    end: float = 1.0

    def __post_init__(self) -> None:
        if self.callback is not None and not callable(self.callback):
            raise ParameterError(
                f"progress of type {type(self.callback).__name__}: give a function of stage and "
                "fraction"
            )

    def __call__(self, share: float) -> None:
        """Tell the share done of this stretch, or raise `Cancelled`."""
        if self.callback is None:
            return
        answer = self.callback(self.stage, self.begin + (self.end - self.begin) * share)
        if answer is not None and not answer:
            raise Cancelled(f"cancelled during {self.stage}")

    def part(self, begin: float, end: float, stage: str = "") -> Progress:
        """Return a part of this stretch, and tell its beginning if it is a `stage` of its own."""
        length = self.end - self.begin
        part = replace(
            self,
            stage=stage or self.stage,
            begin=self.begin + length * begin,
            end=self.begin + length * end,
        )
        if stage:
            part(0.0)
        return part

    def portion(self, begin: float, end: float) -> Callback | None:
        """Return a callback for work of its own that is a part of this stretch."""
        callback, length = self.callback, self.end - self.begin
        if callback is None:
            return None
        return lambda stage, share: callback(
            stage, self.begin + length * (begin + (end - begin) * share)
        )


SILENT = Progress()
"""For work that nobody watches."""
