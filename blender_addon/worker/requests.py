# SPDX-License-Identifier: GPL-3.0-or-later
"""The last analyses, by what they were made from, so that another ratio comes at once.

The key is the geometry itself: an undo, a copy or a rename finds its analysis again, and an edit
misses it, without anything having to be told.
"""

from __future__ import annotations

import hashlib
from collections.abc import Generator

from . import salcore
from .bridge import Arrays
from .salcore import Analysis, Parameters, Progress

MOST_POINTS = 3_000_000
"""Points that analyses kept may have together; the last one is kept whatever it has."""

_kept: dict[bytes, Analysis] = {}


def steps(arrays: Arrays, parameters: Parameters) -> Generator[Progress, None, Analysis]:
    """Yield progress and return the analysis of these arrays, a kept one where there is one."""
    key = _key(arrays, parameters)
    analysis = _kept.pop(key, None)
    if analysis is None:
        analysis = yield from salcore.analysis_steps(
            arrays.points, arrays.faces, arrays.normals, parameters
        )
    _kept[key] = analysis
    _forget(MOST_POINTS)
    return analysis


def clear() -> None:
    """Forget all analyses."""
    _kept.clear()


def _forget(most: int) -> None:
    """Drop the oldest until the rest has few enough points."""
    while len(_kept) > 1 and sum(kept.geometry.input_count for kept in _kept.values()) > most:
        del _kept[next(iter(_kept))]


def _key(arrays: Arrays, parameters: Parameters) -> bytes:
    digest = hashlib.blake2b(repr(parameters).encode(), digest_size=16)
    for array in arrays:
        if array is not None:
            digest.update(repr(array.shape).encode())
            digest.update(array.data)
    return digest.digest()
