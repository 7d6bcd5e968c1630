# SPDX-License-Identifier: GPL-3.0-or-later
"""Several scans as one cloud, several parts as one scene."""

from __future__ import annotations

import numpy as np

from .layer import Columns, Floats, Layer
from .mtl import Material
from .obj import GROUP, MATERIAL, Origin

ALL = "all"
"""Name for all layers as one."""
EACH = "each"
"""Name for each layer on its own."""
SCAN = "scan"
"""Column that tells the scans of a cloud apart."""


def transform(points: Floats, rotation: Floats, translation: Floats) -> Floats:
    """Return points (N, 3) turned by a matrix (3, 3) and moved."""
    moved: Floats = points @ rotation.T + translation
    return moved


def merge(layers: list[Layer], label: str) -> Layer:
    """Return clouds, or the parts of a scene, as one.

    Clouds get a column that numbers them, parts a group each. A column that some lack is filled
    with NaN there if it is of floats, else with zeros.
    """
    if len(layers) == 1:
        return layers[0]
    sizes = [len(layer.points) for layer in layers]
    columns = _union([layer.columns for layer in layers], sizes)
    points = np.concatenate([layer.points for layer in layers])
    if all(layer.faces is None for layer in layers):
        free = SCAN if SCAN not in columns else f"{SCAN}_number"
        columns[free] = np.repeat(np.arange(len(layers), dtype=np.int32), sizes)
        return Layer(label, points, columns)
    none = np.empty((0, 3), dtype=np.int64)
    faces = [none if layer.faces is None else layer.faces for layer in layers]
    counts = list(map(len, faces))
    starts = np.cumsum([0, *sizes[:-1]])
    face_columns = _union([_renumbered(layers, k) for k in range(len(layers))], counts)
    face_columns[GROUP] = np.repeat(np.arange(len(layers), dtype=np.int32), counts)
    return Layer(
        label,
        points,
        columns,
        np.concatenate([part + start for part, start in zip(faces, starts, strict=True)]),
        face_columns,
        _union([layer.corners for layer in layers], counts),
        Origin((), tuple((f"o {layer.label}",) for layer in layers)),
        tuple(dict.fromkeys(name for layer in layers for name in layer.textures)),
        materials=_materials(layers),
        images={name: data for layer in layers for name, data in layer.images.items()},
    )


def _materials(layers: list[Layer]) -> tuple[Material, ...]:
    """Return the materials of all parts, each once."""
    return tuple(dict.fromkeys(material for layer in layers for material in layer.materials))


def _renumbered(layers: list[Layer], number: int) -> Columns:
    """Return the values of a part's faces, with the numbers of materials among those of all."""
    layer, order = layers[number], _materials(layers)
    columns = {name: v for name, v in layer.face_columns.items() if name != GROUP}
    if MATERIAL in columns:
        place = np.array([order.index(m) for m in layer.materials] + [-1], dtype=np.int32)
        columns[MATERIAL] = place[columns[MATERIAL]]
    elif order and layer.faces is not None:
        columns[MATERIAL] = np.full(len(layer.faces), -1, dtype=np.int32)
    return columns


def _union(parts: list[Columns], sizes: list[int]) -> Columns:
    """Return columns of parts one below the other, with a filling where a part has none."""
    columns: Columns = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        there = [part[name] for part in parts if name in part]
        dtype, shape = np.result_type(*(v.dtype for v in there)), there[0].shape[1:]
        missing = np.nan if dtype.kind == "f" and not shape else 0
        columns[name] = np.concatenate([
            part[name].astype(dtype) if name in part else np.full((size, *shape), missing, dtype)
            for part, size in zip(parts, sizes, strict=True)
        ])  # fmt: skip
    return columns
