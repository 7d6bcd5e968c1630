# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of points and corners that a simplification carries over from its input.

Where kept points stay, their values do, bit for bit. Where they move (``placement="optimal"``),
values are interpolated on the original at the new places; those of corners within their charts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .simplification import Simplification


def carry_points(result: Simplification, values: NDArray[Any], faces: NDArray[Any]) -> NDArray[Any]:
    """Return the values (M, ...) of kept points.

    Parameters
    ----------
    result : Simplification
    values : (N, ...) array
        Of the input's points. Real numbers and bytes are interpolated where points have moved,
        bytes (colours) rounded; other types are labels, and stay those of the kept point.
    faces : (F, 3) array of int
        The faces that were analysed.
    """
    kept = values[result.indices]
    if result.positions is None or not _is_measure(values):
        return kept
    face, weights = result.place_source()
    on = face >= 0
    kept[on] = _blend(values[faces[face[on]]], weights[on])
    return kept


def carry_corners(result: Simplification, layer: NDArray[Any]) -> NDArray[Any]:
    """Return the values (K, 3, ...) of the corners of a result.

    Parameters
    ----------
    result : Simplification
        Of a mesh.
    layer : (F, 3, ...) array
        Of the input's corners; see `carry_points`.
    """
    assert result.face_corners is not None
    if result.positions is None or not _is_measure(layer):
        flat = layer.reshape(-1, *layer.shape[2:])
        return np.asarray(flat[result.face_corners])
    face, weights = result.corner_places()
    return _blend(layer[face], weights)


def _is_measure(values: NDArray[Any]) -> bool:
    """Return whether numbers between two values mean something."""
    return values.dtype.kind == "f" or values.dtype == np.uint8


def _blend(values: NDArray[Any], weights: NDArray[np.float64]) -> NDArray[Any]:
    """Return the means of values (..., 3, d...) by weights (..., 3), in the values' own type."""
    share = weights.reshape(weights.shape + (1,) * (values.ndim - weights.ndim))
    mean = (share * values.astype(np.float64)).sum(axis=weights.ndim - 1)
    if values.dtype == np.uint8:
        mean = np.clip(np.round(mean), 0, 255)
    return np.asarray(mean.astype(values.dtype))
