# SPDX-License-Identifier: GPL-3.0-or-later
"""What a command and all processes that it starts take together."""

from __future__ import annotations

import resource
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass

import psutil

INTERVAL = 0.5
"""Seconds between looks at the memory."""


@dataclass(frozen=True)
class Taken:
    """What a command took.

    Attributes
    ----------
    cpu, wall : float
        Seconds; CPU over all processes and threads.
    memory : float
        Largest sum of the processes' proportional sets (PSS: what several share counts once), in
        bytes, as looked at every `INTERVAL`.
    alone : float
        CPU seconds of the command's own process, while the others mostly wait.
    """

    cpu: float
    wall: float
    memory: float
    alone: float

    @property
    def on_two_cores(self) -> float:
        """Seconds that two free cores would take, were the others' work shared evenly."""
        return self.alone + 0.5 * (self.cpu - self.alone)


def run(command: Sequence[str]) -> Taken:
    """Run a command to its end.

    Raises
    ------
    SystemExit
        If it fails.
    """
    before, begun = _children_seconds(), time.perf_counter()
    memory = alone = 0.0
    with subprocess.Popen(command) as process:
        while process.poll() is None:
            memory = max(memory, _memory(process.pid))
            alone = max(alone, _seconds(process.pid, command))
            time.sleep(INTERVAL)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)}: ended with {process.returncode}")
    return Taken(_children_seconds() - before, time.perf_counter() - begun, memory, alone)


def _children_seconds() -> float:
    """Return the CPU seconds of all processes that this one has started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _memory(pid: int) -> float:
    """Return the memory of a process and its descendants."""
    total = 0.0
    try:
        parent = psutil.Process(pid)
        for process in [parent, *parent.children(recursive=True)]:
            total += process.memory_full_info().pss
    except (psutil.Error, FileNotFoundError):  # one has just ended: the next look is as good
        return 0.0
    return total


def _seconds(pid: int, command: Sequence[str]) -> float:
    """Return the CPU seconds of the process that a command itself is, without its children's.

    The interpreter may be a launcher that starts the true one with the same arguments.
    """
    most = 0.0
    try:
        parent = psutil.Process(pid)
        for process in [parent, *parent.children(recursive=True)]:
            if process.cmdline()[1:] == list(command[1:]):
                times = process.cpu_times()
                most = max(most, times.user + times.system)
    except psutil.Error:
        return 0.0
    return most
