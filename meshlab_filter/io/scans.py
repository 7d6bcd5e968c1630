# SPDX-License-Identifier: GPL-3.0-or-later
"""Several scans as one cloud."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .layer import Columns, Floats, Layer

SCAN = "scan"
"""Column that tells the scans of a cloud apart."""


def transform(points: Floats, rotation: Floats, translation: Floats) -> Floats:
    """Return points (N, 3) turned by a matrix (3, 3) and moved."""
    moved: Floats = points @ rotation.T + translation
    return moved


def merge(layers: list[Layer], label: str) -> Layer:
    """Return clouds as one, with their number as a column.

    A column that some lack is filled with NaN there if it is of floats, else with zeros.
    """
    if len(layers) == 1:
        return layers[0]
    names = list(dict.fromkeys(name for layer in layers for name in layer.columns))
    columns: Columns = {}
    for name in names:
        dtype = np.result_type(*(v.columns[name].dtype for v in layers if name in v.columns))
        parts = [_column(layer, name, dtype) for layer in layers]
        columns[name] = np.concatenate(parts)
    sizes = [len(layer.points) for layer in layers]
    free = SCAN if SCAN not in columns else f"{SCAN}_number"
    columns[free] = np.repeat(np.arange(len(layers), dtype=np.int32), sizes)
    points = np.concatenate([layer.points for layer in layers])
    return Layer(label, points, columns)


def _column(layer: Layer, name: str, dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    if name in layer.columns:
        return layer.columns[name].astype(dtype)
    missing = np.nan if dtype.kind == "f" else 0
    return np.full(len(layer.points), missing, dtype=dtype)
