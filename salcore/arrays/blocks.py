# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in blocks: bounded memory, progress after every block, a thread for every processor."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar

from ..progress import SILENT, Progress

BLOCK = 16384
"""Vertices in a block: temporaries of a few hundred kB to a few MB, about the size of a cache."""

_workers: ContextVar[int] = ContextVar("workers", default=0)


@contextmanager
def set_workers(workers: int) -> Iterator[None]:
    """Set the number of threads (0: one per processor) for the work inside the ``with``."""
    token = _workers.set(workers)
    try:
        yield
    finally:
        _workers.reset(token)


def worker_count() -> int:
    """Return the number of threads in force."""
    return _workers.get() or os.cpu_count() or 1


def run_blocks(
    kernel: Callable[[int, int], None], count: int, progress: Progress = SILENT, size: int = BLOCK
) -> None:
    """Call ``kernel(start, stop)`` for every block of ``range(count)``.

    Each call writes to its own part of the result, so the result does not depend on the number of
    threads. numpy releases the interpreter lock in its loops, hence threads help. All threads are
    joined when this returns or `progress` cancels.
    """
    starts = range(0, count, size)
    if len(starts) == 1:  # no thread is worth its start
        kernel(0, count)
        progress(1.0)
        return
    threads = worker_count()
    with ThreadPoolExecutor(threads) as pool:
        for first in range(0, len(starts), threads):
            group = starts[first : first + threads]
            list(pool.map(lambda start: kernel(start, min(start + size, count)), group))
            progress(min(group[-1] + size, count) / count)
