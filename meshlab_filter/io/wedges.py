# SPDX-License-Identifier: GPL-3.0-or-later
"""What tells charts apart: values at corners, materials, and values of split vertices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .layer import NORMAL, RGB, XYZ, Floats, Layer, are_split
from .obj import GROUP, MATERIAL, NORMAL_CORNERS
from .obj_write import PAIRS

NUMBERS = (MATERIAL, GROUP, "texnumber")
"""Columns of faces that tell materials apart."""


def corner_layers(layer: Layer) -> dict[str, Any]:
    """Return values of corners and points as keyword arguments of `salcore.Analysis.simplify`."""
    faces = layer.faces
    if faces is None:
        return {}
    values = [_finite(v) for name, v in layer.corners.items() if name != NORMAL_CORNERS]
    normals = layer.corners.get(NORMAL_CORNERS)
    for name in NUMBERS:
        if name in layer.face_columns:
            number = layer.face_columns[name].astype(np.float64)
            values.append(np.repeat(number[:, None, None], 3, axis=1))
    split = are_split(layer.points)
    pairs = [pair for pair in PAIRS if set(pair) <= layer.columns.keys() and not layer.corners]
    values += [_at_corners(layer, pair, faces) for pair in pairs]
    if split and set(RGB) <= layer.columns.keys():
        values.append(_at_corners(layer, RGB, faces))
    if split and normals is None and set(NORMAL) <= layer.columns.keys():
        normals = _at_corners(layer, NORMAL, faces)
    # Copies with nothing but places are one point; what other columns mean is not known.
    bare = set(layer.columns) <= set(XYZ)
    given: dict[str, Any] = {"corner_values": values if values or bare else None}
    if set(RGB) <= layer.columns.keys():
        given["point_values"] = _finite(np.column_stack([layer.columns[k] for k in RGB]))
    return given if normals is None else given | {"corner_normals": _finite(normals)}


def _at_corners(layer: Layer, names: tuple[str, ...], faces: NDArray[np.int64]) -> Floats:
    return _finite(np.column_stack([layer.columns[name] for name in names]))[faces]


def _finite(values: NDArray[Any]) -> Floats:
    """Return values as numbers that can be compared: invalid ones count as zero."""
    return np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
