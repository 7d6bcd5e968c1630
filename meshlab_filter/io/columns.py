# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognize what the columns of a text file are, by their names or by their values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .layer import NORMAL, RGB, XYZ, Columns

SKIP = ("_", "-", "skip")
"""Names in ``--columns`` for columns that are left out."""
SAMPLE = 100_000
"""Rows whose values decide what a column is."""
UNIT = 0.01
"""Largest difference of a normal's length from 1."""
_SYNONYMS = {
    "x": "x", "y": "y", "z": "z", "xcoord": "x", "ycoord": "y", "zcoord": "z", "coordx": "x",
    "coordy": "y", "coordz": "z", "pointx": "x", "pointy": "y", "pointz": "z", "easting": "x",
    "northing": "y", "elevation": "z", "height": "z", "east": "x", "north": "y", "altitude": "z",
    "cartesianx": "x", "cartesiany": "y", "cartesianz": "z",
    "r": "red", "g": "green", "b": "blue", "a": "alpha", "rf": "red", "gf": "green", "bf": "blue",
    "af": "alpha", "red": "red", "green": "green", "blue": "blue", "alpha": "alpha",
    "colorred": "red", "colorgreen": "green", "colorblue": "blue", "diffusered": "red",
    "diffusegreen": "green", "diffuseblue": "blue",
    "nx": "nx", "ny": "ny", "nz": "nz", "normalx": "nx", "normaly": "ny", "normalz": "nz",
    "i": "intensity", "intensity": "intensity", "reflectance": "intensity",
}  # fmt: skip
"""Names of columns as programs write them, in lower case and without other characters."""


def canonical(name: str) -> str:
    """Return the name that a column goes by here; of unknown ones their own, without blanks."""
    plain = re.sub(r"\[[^]]*\]|\([^)]*\)", "", name)
    key = re.sub(r"[^a-z]", "", plain.lower())
    if key in _SYNONYMS and not re.search(r"\d", plain):
        return _SYNONYMS[key]
    return re.sub(r"\s+", "_", name.strip().strip('"')) or "unnamed"


def unique(names: Sequence[str]) -> list[str]:
    """Return names with numbers behind those that were there before."""
    found: list[str] = []
    for name in names:
        number, free = 1, name
        while free in found:
            number += 1
            free = f"{name}_{number}"
        found.append(free)
    return found


def guess(values: Sequence[NDArray[Any]], ending: str) -> list[str]:
    """Name columns without a header by their values; the first three are the coordinates.

    Three columns of unit vectors are normals, three of whole numbers up to 255 or 65535, or of
    numbers up to 1, are colours. Where both fit for a single number beside three, it is in front of
    the colours in ``.pts`` files and behind them in others.
    """
    names = list(XYZ[: len(values)])
    some = [column[:: max(len(column) // SAMPLE, 1)] for column in values]
    position, scalar = 3, 0
    while position < len(some):
        left = len(some) - position
        window = some[position : position + 3]
        later = some[position + 1 : position + 4]
        if left >= 3 and _are_normals(window) and "nx" not in names:
            names += NORMAL
            position += 3
            continue
        single_first = left % 3 == 1 and _are_colors(later) and ending == ".pts"
        if left >= 3 and _are_colors(window) and "red" not in names and not single_first:
            names += RGB
            position += 3
            continue
        scalar += 1
        plain = "intensity" not in names and (ending == ".pts" or len(some) % 3 == 1)
        names.append("intensity" if plain else f"scalar_{position + 1}")
        position += 1
    return names


def _are_normals(window: Sequence[NDArray[Any]]) -> bool:
    """Return whether three columns hold unit vectors, apart from a few that are zero or invalid."""
    if any(column.dtype.kind not in "iuf" for column in window):
        return False
    vectors = np.column_stack(window).astype(np.float64)
    with np.errstate(all="ignore"):
        length = np.linalg.norm(vectors, axis=1)
    given = np.isfinite(length) & (length > 0.0)
    if 2 * np.count_nonzero(given) < len(length) or not given.any():
        return False
    fits = np.abs(length[given] - 1.0) <= UNIT
    colors = (vectors[given] >= 0.0).all() and np.isin(vectors[given], (0.0, 1.0)).all()
    return bool(fits.mean() >= 0.95 and not colors)


def _are_colors(window: Sequence[NDArray[Any]]) -> bool:
    return len(window) == 3 and color_range(window) is not None


def color_range(window: Sequence[NDArray[Any]]) -> int | None:
    """Return the largest value that three columns of colours can have: 255, 65535, 1, or None."""
    if any(column.dtype.kind not in "iuf" for column in window):
        return None
    values = np.column_stack(window)
    if not len(values) or not np.isfinite(values).all() or values.min() < 0:
        return None
    whole = bool((values == np.round(values)).all())
    if values.max() <= 1.0 and values.dtype.kind == "f":
        return 1
    if whole and values.max() <= 65535:
        return 255 if values.max() <= 255 else 65535
    return None


def settle_colors(columns: Columns) -> Columns:
    """Return columns in which whole colours have the type that tells their range."""
    if not set(RGB) <= columns.keys():
        return columns
    top = color_range([columns[name] for name in RGB])
    if top is None or top == 1:
        return columns
    dtype = np.uint8 if top == 255 else np.uint16
    return {k: v.astype(dtype) if k in RGB else v for k, v in columns.items()}


def describe(columns: Columns) -> str:
    """Return the names of columns, those of one vector together, for messages."""
    text = " ".join(columns)
    for group in (XYZ, NORMAL, RGB):
        text = text.replace(" ".join(group), f"|{' '.join(group)}|")
    return ", ".join(filter(None, (part.strip() for part in text.split("|"))))
