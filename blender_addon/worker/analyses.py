# SPDX-License-Identifier: GPL-3.0-or-later
"""The last analyses are kept, by what they were made from.

Another ratio comes at once: an undo, a copy or a rename finds its analysis again and an edit misses
it, without anything having to be told.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from .. import salcore
from ..salcore import Analysis, Parameters
from ..salcore.progress import Progress

MAX_POINTS = 3_000_000
"""Points that kept analyses may have together; the last one is kept whatever it has."""

_kept: dict[bytes, Analysis] = {}


def analyze(
    points: Any,
    faces: Any,
    normals: Any,
    parameters: dict[str, Any],
    work: Progress,
    share: float = 1.0,
) -> Analysis:
    """Return the analysis of these arrays, a kept one where there is one."""
    key = _digest(repr(sorted(parameters.items())), points, faces, normals)
    analysis = _kept.pop(key, None)
    if analysis is None:
        analysis = salcore.analyze(
            points, faces, normals, Parameters(**parameters), progress=work.portion(0.0, share)
        )
    _kept[key] = analysis
    _drop_old(MAX_POINTS)
    return analysis


def _drop_old(most: int) -> None:
    """Drop the oldest analyses until the rest has few enough points."""
    while len(_kept) > 1 and sum(a.geometry.input_count for a in _kept.values()) > most:
        del _kept[next(iter(_kept))]


def forget() -> None:
    """Forget all analyses."""
    _kept.clear()


def count() -> int:
    """Return how many are kept."""
    return len(_kept)


def _digest(words: str, *arrays: Any) -> bytes:
    digest = hashlib.blake2b(words.encode(), digest_size=16)
    for array in arrays:
        digest.update(b"" if array is None else repr((array.dtype.str, array.shape)).encode())
        if array is not None:
            digest.update(np.ascontiguousarray(array).data)
    return digest.digest()
