# SPDX-License-Identifier: GPL-3.0-or-later
"""What callers give as arrays: made numpy arrays of, or refused in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import GeometryError

LARGEST_VALUE = 1e150
"""Values of corners beyond are cut down to it: squares of differences stay in range."""


def as_array(values: ArrayLike, name: str, wanted: str) -> NDArray[Any]:
    """Return `values` as a numpy array, or raise `GeometryError` that says what is wanted."""
    if isinstance(values, np.ma.MaskedArray):
        raise GeometryError(
            f"{name}: the array is masked; fill it first, for points with NaN: {name}.filled(...)"
        )
    try:
        return np.asarray(values)
    except (ValueError, TypeError, OverflowError) as error:
        raise GeometryError(f"{name}: give {wanted} (numpy says: {error})") from error


def real_numbers(values: ArrayLike, name: str, wanted: str) -> NDArray[np.float64]:
    """Return an array of real numbers of any shape as float64, contiguous."""
    array = as_array(values, name, wanted)
    if array.dtype.kind not in "fiub":
        raise GeometryError(f"{name} of type {array.dtype}: give real numbers")
    with np.errstate(over="ignore"):  # wider floats than float64 become infinite
        return np.asarray(array, dtype=np.float64, order="C")


def corner_values(values: ArrayLike, name: str, corners: tuple[int, ...]) -> NDArray[np.float64]:
    """Return values of corners (F, 3, d); those that are not finite count as zero."""
    array = real_numbers(values, name, "values of corners as an array of shape (F, 3, d)")
    if array.shape[:2] != corners and (array.size or corners[0]):
        raise GeometryError(
            f"{name} of shape {array.shape}: give values of corners of shape ({corners[0]}, 3, d)"
        )
    array = array.reshape(*corners, -1) if array.size else np.zeros((*corners, 1))
    return np.clip(np.where(np.isfinite(array), array, 0.0), -LARGEST_VALUE, LARGEST_VALUE)


def indices(
    values: ArrayLike | None, name: str, wanted: str, width: int, count: int
) -> NDArray[Any]:
    """Return rows (r, width) of integers from 0 to `count` - 1; nothing at all makes no rows."""
    wanted = f"{wanted} as an array of integers of shape (rows, {width})"
    array = as_array([] if values is None else values, name, wanted)
    if array.size == 0:
        return np.empty((0, width), dtype=np.intp)
    if array.ndim != 2 or array.shape[1] != width:
        raise GeometryError(f"{name} of shape {array.shape}: give {wanted}")
    if array.dtype.kind not in "iu":
        raise GeometryError(f"{name} of type {array.dtype}: give integers")
    low, high = int(array.min()), int(array.max())
    if low < 0 or high >= count:
        bad = low if low < 0 else high
        remedy = f"give indices from 0 to {count - 1}" if count else f"leave {name} out"
        raise GeometryError(f"{name}: index {bad} is out of range for {count} points; {remedy}")
    return array
