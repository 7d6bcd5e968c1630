# SPDX-License-Identifier: GPL-3.0-or-later
"""Sorting in steps: numbers go into drawers of like size first, and each drawer is sorted alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import rest_blocks
from .progress import Rests

DRAWER = 1 << 16
"""Numbers in a drawer, on average: sorted within the cache, in a few milliseconds."""
MOST_DRAWERS = 1 << 16
LEAST_RANGE = 1e-300
SHUFFLED = 1 << 18
"""Numbers that are put into drawers at once."""


def sort(
    keys: NDArray[Any], *, stable: bool = False, workers: int = 0
) -> Rests[tuple[NDArray[np.intp], NDArray[Any]]]:
    """Rest between drawers; return the order (n,) that sorts finite numbers (n,), and them sorted.

    Equal numbers come in any order unless `stable`, but in the same one every time. Where most
    numbers are close to each other for their range, a drawer holds most, and the step is long.
    """
    kind: Any = "stable" if stable else "quicksort"
    count = len(keys)
    drawers = min(count // DRAWER, MOST_DRAWERS)
    if drawers < 2:
        order = np.argsort(keys, kind=kind)
        return order, keys[order]
    order, filled = yield from _put_into_drawers(keys, drawers, workers)
    ordered = np.empty_like(keys)

    def arrange(start: int, stop: int) -> None:
        for drawer in range(start, stop):
            part = slice(filled[drawer], filled[drawer + 1])
            own = keys[order[part]]
            place = np.argsort(own, kind=kind)
            order[part], ordered[part] = order[part][place], own[place]

    yield from rest_blocks(arrange, drawers, workers=workers, size=1)
    return order, ordered


def _put_into_drawers(
    keys: NDArray[Any], drawers: int, workers: int
) -> Rests[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return the numbers' places, drawer by drawer and ascending, and the drawers' bounds."""
    count = len(keys)
    low, high = keys.min(), keys.max()
    share = drawers / max(float(high - low), LEAST_RANGE)
    blocks = -(-count // SHUFFLED)
    local = np.empty(count, dtype=np.intp)
    size = np.empty((blocks, drawers), dtype=np.intp)
    yield

    def choose(start: int, stop: int) -> None:
        place = np.minimum((keys[start:stop] - low) * share, drawers - 1).astype(np.uint16)
        local[start:stop] = np.argsort(place, kind="stable")  # by radix, in linear time
        size[start // SHUFFLED] = np.bincount(place, minlength=drawers)

    yield from rest_blocks(choose, count, workers=workers, size=SHUFFLED)
    # What block b puts into drawer d follows on what all blocks before b put there.
    filled = np.concatenate([[0], np.cumsum(size.sum(axis=0))])
    first = filled[:-1] + np.cumsum(size, axis=0) - size
    order = np.empty(count, dtype=np.intp)

    def put(start: int, stop: int) -> None:
        own = size[start // SHUFFLED]
        shift = first[start // SHUFFLED] - (np.cumsum(own) - own)
        order[np.repeat(shift, own) + np.arange(stop - start)] = local[start:stop] + start

    yield from rest_blocks(put, count, workers=workers, size=SHUFFLED)
    return order, filled
