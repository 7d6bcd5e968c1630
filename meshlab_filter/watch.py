# SPDX-License-Identifier: GPL-3.0-or-later
"""One process works, another looks after it.

MeshLab's library can crash on a damaged file, and compiled code hears no Ctrl-C. So a child does
the work. Its parent ends it on a signal at any moment, turns a crash into a sentence, and removes
the temporary folders that are left. Where there is no fork (Windows) the work goes unwatched.
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

STOPS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
FAILURE = 1

_news: int | None = None
"""Where the child tells its parent of temporary folders."""


def watch(work: Callable[[], int]) -> int:
    """Return the exit status of `work`, done by a child process.

    After a signal that asks to stop it is 128 and the signal's number, after a crash 1.
    """
    if not hasattr(os, "fork"):
        return work()
    alive, news = os.pipe(), os.pipe()
    stops = [number for number in STOPS if signal.getsignal(number) is not signal.SIG_IGN]
    # No signal may come between the fork and the handlers.
    signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)
    child = os.fork()
    if child == 0:
        os.close(alive[1])
        os.close(news[0])
        _prepare(stops, alive[0], news[1])
        return work()
    os.close(alive[0])
    os.close(news[1])
    stopped: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        stopped.append(number)
        os.kill(child, signal.SIGTERM)

    for number in stops:
        signal.signal(number, stop)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
    return _follow(child, news[0], stops, stopped)


def announce(folder: Path) -> None:
    """Tell of a temporary folder, so that it goes away even if this process dies first."""
    if _news is not None:
        os.write(_news, os.fsencode(folder.absolute()) + b"\0")


@contextmanager
def undisturbed() -> Iterator[None]:
    """Put signals off that ask to stop, for a few renames that belong together."""
    if threading.current_thread() is not threading.main_thread():
        yield  # handlers belong to the main thread
        return
    caught: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: caught.append(number)) for number in STOPS
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for number in caught:
            signal.raise_signal(number)


def _prepare(stops: list[int], alive: int, news: int) -> None:
    """Make this process, the child, end on SIGTERM at once, and with its parent."""
    global _news
    _news = news
    for number in stops:
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to the parent too
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
    threading.Thread(target=_end_with_parent, args=(alive,), daemon=True).start()


def _end_with_parent(alive: int) -> None:
    os.read(alive, 1)  # nothing is ever written: it returns when the parent has gone
    os.kill(os.getpid(), signal.SIGTERM)


def _follow(child: int, news: int, stops: list[int], stopped: list[int]) -> int:
    """Wait for the child, tidy up after it, and return the exit status."""
    told = b""
    while piece := os.read(news, 65536):  # until the child has gone
        told += piece
    for number in stops:
        signal.signal(number, signal.SIG_IGN)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    for folder in filter(None, told.split(b"\0")):
        shutil.rmtree(folder, ignore_errors=True)
    if code >= 0:
        return code
    if stopped or -code in STOPS:
        _say("interrupted: no partial file was left")
        return 128 + (stopped[0] if stopped else -code)
    what = (
        f"compiled code crashed ({signal.Signals(-code).name}): the input may be damaged, "
        "or the disk full"
    )
    if -code == signal.SIGKILL:
        what = "the system ended the work, most likely for want of memory"
    _say(f"error: {what}; no partial file was left")
    return FAILURE


def _say(message: str) -> None:
    """Print one line on standard error, below what a progress bar left."""
    start = "\n" if sys.stderr.isatty() else ""
    print(f"{start}salient-simplify: {message}", file=sys.stderr)
