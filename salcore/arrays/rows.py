# SPDX-License-Identifier: GPL-3.0-or-later
"""Reductions over the rows of a compressed sparse structure; empty rows give zero."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .types import Floats


def _reduce(ufunc: np.ufunc, values: NDArray[Any], indptr: NDArray[np.integer]) -> Floats:
    # reduceat gives a[start] for an empty row, hence only rows with entries are reduced.
    result = np.zeros((len(indptr) - 1, *values.shape[1:]))
    filled = np.flatnonzero(indptr[1:] > indptr[:-1])
    if len(filled):
        result[filled] = ufunc.reduceat(values, indptr[filled], axis=0)
    return result


def row_sum(values: NDArray[Any], indptr: NDArray[np.integer]) -> Floats:
    """Return the sum of each row of `values` (e, ...), float64."""
    return _reduce(np.add, values, indptr)


def row_max(values: NDArray[Any], indptr: NDArray[np.integer]) -> Floats:
    """Return the largest value of each row of `values` (e, ...), float64; zero for no entry."""
    return _reduce(np.maximum, values, indptr)


def row_mean(values: NDArray[Any], indptr: NDArray[np.integer]) -> Floats:
    """Return the mean of each row of `values` (e,), float64; zero for no entry."""
    return row_sum(values, indptr) / np.maximum(np.diff(indptr), 1)


def row_entries(
    indptr: NDArray[np.integer], rows: NDArray[np.integer]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the positions of all entries of some rows, and their own row bounds.

    Parameters
    ----------
    indptr : (n + 1,) int
    rows : (r,) int

    Returns
    -------
    positions : (e,) int64
        Entries of ``rows[0]``, then of ``rows[1]``, and so on.
    bounds : (r + 1,) int64
        Bounds of each row in `positions`.
    """
    start = indptr[rows].astype(np.int64)
    size = indptr[rows + 1] - start
    bounds = np.concatenate([[0], np.cumsum(size)])
    positions = np.arange(bounds[-1]) + np.repeat(start - bounds[:-1], size)
    return positions, bounds
