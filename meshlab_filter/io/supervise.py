# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the work in a child process and clean up after it.

MeshLab's library can crash on a damaged file, and compiled code ignores Ctrl-C. So a child process
does the work. Its parent terminates it when a signal asks to stop, turns a crash into one line on
standard error, and removes the temporary folders that are left. Where there is no fork (Windows)
the work runs in this process, without supervision.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
FAILURE = 1

_register: int | None = None
"""Pipe on which the child tells its parent of temporary folders; None without supervision."""


def supervise(work: Callable[[], int]) -> int:
    """Run `work` in a child process and return its exit status.

    After a signal that asks to stop, the status is 128 plus the signal's number; after a crash, 1.
    """
    if not hasattr(os, "fork"):
        return work()
    alive_read, alive_write = os.pipe()
    register_read, register_write = os.pipe()
    signals = [number for number in STOP_SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    # No signal may arrive between the fork and the handlers.
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    child = os.fork()
    if child == 0:
        os.close(alive_write)
        os.close(register_read)
        _prepare_child(signals, alive_read, register_write)
        return work()
    os.close(alive_read)
    os.close(register_write)
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        os.kill(child, signal.SIGTERM)

    for number in signals:
        signal.signal(number, stop)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    temporary = _read_until_closed(register_read)
    for number in signals:
        signal.signal(number, signal.SIG_IGN)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    for folder in filter(None, temporary.split(b"\0")):
        shutil.rmtree(folder, ignore_errors=True)
    return _exit_status(code, received)


def register_temporary(folder: Path) -> None:
    """Have the parent remove a temporary folder, should this process die before it does so."""
    if _register is not None:
        os.write(_register, os.fsencode(folder.absolute()) + b"\0")


@contextmanager
def defer_signals() -> Iterator[None]:
    """Defer signals that ask to stop until the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    received: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: received.append(number))
        for number in STOP_SIGNALS
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for number in received:
            signal.raise_signal(number)


def _prepare_child(signals: list[int], alive: int, register: int) -> None:
    """Make this process, the child, end at once on SIGTERM, and together with its parent."""
    global _register
    _register = register
    for number in signals:
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to the parent too
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    threading.Thread(target=_end_with_parent, args=(alive,), daemon=True).start()


def _end_with_parent(alive: int) -> None:
    os.read(alive, 1)  # returns when the parent is gone, for nobody writes to this pipe
    os.kill(os.getpid(), signal.SIGTERM)


def _read_until_closed(pipe: int) -> bytes:
    """Return all that the child writes to a pipe, which closes when the child ends."""
    received = b""
    while piece := os.read(pipe, 65536):
        received += piece
    return received


def _exit_status(code: int, received: list[int]) -> int:
    """Return the exit status for the child's, a negative signal number if a signal ended it."""
    if code >= 0:
        return code
    if received or -code in STOP_SIGNALS:
        _say("interrupted: no partial file was left")
        return 128 + (received[0] if received else -code)
    cause = (
        f"compiled code crashed ({signal.Signals(-code).name}): the input may be damaged, "
        "or the disk full"
    )
    if -code == signal.SIGKILL:
        cause = "the system ended the work, most likely for want of memory"
    _say(f"error: {cause}; no partial file was left")
    return FAILURE


def _say(message: str) -> None:
    """Print one line on standard error, below what a progress bar left."""
    start = "\n" if sys.stderr.isatty() else ""
    print(f"{start}salient-simplify: {message}", file=sys.stderr)
