# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker of this Blender, and work that it does for an operator, one request after another."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import scipy

from ..geometry.read import HostError
from ..salcore import SalcoreError
from ..worker import host as states
from ..worker import requests
from ..worker.host import Host

ADDON = Path(__file__).parents[1]


def _command() -> list[str]:
    """Return what starts the child: Blender's own Python, and where to find what it needs."""
    folders = (str(Path(str(module.__file__)).parents[1]) for module in (np, scipy))
    child = ADDON / "worker" / "child.py"
    python = (sys.executable, *bpy.app.python_args)
    return [*python, str(child), str(ADDON), os.pathsep.join(dict.fromkeys(folders))]


host = Host(_command())


class Task:
    """Requests under way; a timer, a test or a loop calls `advance` until it returns True.

    Until the task is done nothing in the scene may change: one that is cancelled has never been.

    Parameters
    ----------
    makers : sequence of callable
        Each returns a request, and is called when its turn has come.
    host : Host, optional
        Of the child that does the work; None to work in this process. Without a child that starts
        the work is done in this process, too.

    Attributes
    ----------
    host : Host or None
    stage : str
    fraction : float
        In [0, 1], never falling.
    results : list
        Answers so far; None where a request of several failed.
    failures : dict of int to SalcoreError or MemoryError
        Why, by the position among the requests.
    done : bool
    """

    def __init__(self, makers: Sequence[Callable[[], dict[str, Any]]], host: Host | None) -> None:
        self.stage, self.fraction = "Start", 0.0
        self.results: list[Any] = []
        self.failures: dict[int, SalcoreError | MemoryError] = {}
        self._makers, self.host = makers, host
        self._sent = False

    @property
    def done(self) -> bool:
        """Whether all requests have been answered."""
        return len(self.results) == len(self._makers)

    @property
    def in_process(self) -> bool:
        """Whether `advance` works in this process, and does not return until it is done."""
        return self.host is None or self.host.state == states.UNAVAILABLE

    def advance(self) -> bool:
        """Send and receive what there is; return whether the task is done.

        Raises
        ------
        SalcoreError, MemoryError
            As the last request that failed would have raised them, if all did.
        HostError
            If the child has been killed.
        """
        while not self.done:
            if self.host is None or self.in_process:
                try:
                    self._take(requests.run(self._makers[len(self.results)]()))
                except (SalcoreError, MemoryError) as error:
                    self._fail(error)
                continue
            self.host.start()
            message = self.host.poll()
            if message is not None:
                self._read(*message)
            elif self.host.state == states.IDLE and not self._sent:
                try:
                    request = self._makers[len(self.results)]()
                except SalcoreError as error:
                    self._fail(error)
                    continue
                self._sent = True
                self.host.send(request)
            else:
                break
        return self.done

    def finish(self) -> list[Any]:
        """Work to the end and return all answers."""
        while not self.advance():
            if self.host is not None and not self.in_process:
                self.host.wait(0.1)
        return self.results

    def cancel(self) -> None:
        """Stop for good."""
        if self.host is not None and self._sent:
            self.host.cancel()

    def _read(self, kind: str, *values: Any) -> None:
        """Take one message of the child's."""
        if kind == "progress":
            stage, share = values
            fraction = (len(self.results) + share) / len(self._makers)
            self.stage, self.fraction = stage, max(self.fraction, fraction)
            return
        self._sent = False
        if kind == "done":
            self._take(*values)
        elif kind == "died":
            raise HostError(
                f"the worker process was killed or ran out of memory (exit status {values[0]}); "
                "close other programs or thin the input, and try again"
            )
        elif values[0] == "MemoryError":
            self._fail(MemoryError(values[1]))
        elif values[0] == "SalcoreError":
            self._fail(HostError(values[1]))
        else:
            raise RuntimeError(f"the worker process failed: {values[1]}")

    def _fail(self, error: SalcoreError | MemoryError) -> None:
        """Leave out a request that failed; raise if none has succeeded."""
        self.failures[len(self.results)] = error
        if len(self.failures) == len(self._makers):
            raise error
        self._take(None)

    def _take(self, result: Any) -> None:
        self.results.append(result)
        self.fraction = max(self.fraction, len(self.results) / len(self._makers))


def settle() -> float | None:
    """Look after a cancelled request until the child has answered; for Blender's timers."""
    host.poll()
    return 0.1 if host.state == states.STOPPING else None


_later: list[tuple[Task, Callable[[Any], None]]] = []
"""Work that nobody waits for, and what takes its answer; one at the most."""


def begin_later(request: dict[str, Any], take: Callable[[Any], None]) -> None:
    """Have the child answer a request while nobody waits, and hand its answer to `take`."""
    drop_later()
    task = Task([lambda: request], host)
    if host.state != states.OFF and not task.in_process:
        _later.append((task, take))
        bpy.app.timers.register(look_later, first_interval=0.1)


def look_later() -> float | None:
    """Look for the answer that nobody waits for; for Blender's timers."""
    if not _later:
        return None
    task, take = _later[0]
    try:
        if not task.advance():
            return 0.1
    except (SalcoreError, MemoryError):
        _later.clear()
        return None
    _later.clear()
    take(task.results[0])
    return None


def drop_later() -> None:
    """Give up work that nobody waits for."""
    while _later:
        _later.pop()[0].cancel()
    if bpy.app.timers.is_registered(look_later):
        bpy.app.timers.unregister(look_later)


def stop() -> None:
    """End the child, and forget what this process keeps."""
    drop_later()
    if bpy.app.timers.is_registered(settle):
        bpy.app.timers.unregister(settle)
    host.stop()
    requests.forget()


def warm_up() -> None:
    """Start the child before there is work for it; does nothing if there is one."""
    if not bpy.app.background:
        host.start()


def spare_host() -> Host | None:
    """Return the host if it has a child, for work that nobody wants to start one for."""
    return None if host.state in (states.OFF, states.UNAVAILABLE) else host
