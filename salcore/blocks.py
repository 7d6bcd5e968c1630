# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in blocks: bounded memory, progress after every block, a thread for every processor."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor

BLOCK = 16384
"""Vertices in a block: temporaries of a few hundred kB to a few MB, about the size of a cache."""


def worker_count(workers: int) -> int:
    """Return the number of threads that `Parameters.workers` asks for."""
    return workers or os.cpu_count() or 1


def run_blocks(
    kernel: Callable[[int, int], None], count: int, *, workers: int = 0, size: int = BLOCK
) -> Generator[float, None, None]:
    """Call ``kernel(start, stop)`` for every block of ``range(count)``, yielding the share done.

    Each call writes to its own part of the result, so the result does not depend on `workers`.
    numpy releases the interpreter lock in its loops, hence threads help. All threads are idle at
    a yield and joined when the generator ends or is closed.
    """
    threads = worker_count(workers)
    starts = range(0, count, size)
    if len(starts) == 1:  # no thread is worth its start
        kernel(0, count)
        yield 1.0
        return
    with ThreadPoolExecutor(threads) as pool:
        for first in range(0, len(starts), threads):
            group = starts[first : first + threads]
            list(pool.map(lambda start: kernel(start, min(start + size, count)), group))
            yield min(group[-1] + size, count) / count


def rest_blocks(
    kernel: Callable[[int, int], None], count: int, *, workers: int = 0, size: int = BLOCK
) -> Generator[None, None, None]:
    """Run blocks inside of work whose fraction they do not tell: yield None after each."""
    for _ in run_blocks(kernel, count, workers=workers, size=size):
        yield
