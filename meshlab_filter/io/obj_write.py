# SPDX-License-Identifier: GPL-3.0-or-later
"""Write OBJ files with materials, groups, and values at corners."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Warn, ignore
from .layer import NORMAL, RGB, XYZ, Columns, Layer, is_opaque
from .mtl import Material, images, rename_images, write_materials
from .obj import GROUP, MATERIAL, NORMAL_CORNERS, TEXCOORD, Origin

FACES = True
PAIRS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
"""Names of texture coordinates of points."""


def write(layer: Layer, path: Path, warn: Warn = ignore) -> None:
    """Write a layer, and its materials beside it; `warn` hears of what OBJ files cannot hold."""
    columns = layer.columns
    corners, used = _corner_values(layer)
    colors = _shares(columns)
    kept = {*XYZ, *used, *(RGB if colors is not None else ())}
    lost = [name for name, v in columns.items() if name not in kept and not is_opaque(name, v)]
    library, names, material = _materials(layer, path)
    kept_faces = {MATERIAL, GROUP} | ({"texnumber", *RGB} if library is not None else set())
    lost += [
        f"{name} of faces"
        for name, values in layer.face_columns.items()
        if name not in kept_faces and not is_opaque(name, values)
    ]
    lost += [f"{name} of corners" for name in layer.corners if name not in corners]
    if lost:
        warn(f"{path}: .obj files do not keep {', '.join(lost)}; .ply does")
    lines = []
    if library is not None:
        path.with_suffix(".mtl").write_text(library, encoding="utf-8", errors="surrogateescape")
        lines.append(f"mtllib {path.with_suffix('.mtl').name}")
    rows = layer.points if colors is None else np.column_stack([layer.points, colors])
    lines += _rows("v", rows)
    slots: list[NDArray[Any] | None] = [layer.faces, None, None]
    for slot, key, name in ((1, "vt", TEXCOORD), (2, "vn", NORMAL_CORNERS)):
        if name in corners:
            values, slots[slot] = _distinct(corners[name])
            lines += _rows(key, values)
    if layer.faces is not None:
        lines += _faces(layer, slots, names, material)
    path.write_text("\n".join([*lines, ""]), encoding="utf-8", errors="surrogateescape")


def _corner_values(layer: Layer) -> tuple[Columns, set[str]]:
    """Return texture coordinates and normals at the corners, and the columns they come from."""
    if layer.faces is None:
        return {}, set()
    corners = {k: v for k, v in layer.corners.items() if k in (TEXCOORD, NORMAL_CORNERS)}
    used: set[str] = set()
    for name, choices in ((TEXCOORD, PAIRS), (NORMAL_CORNERS, (NORMAL,))):
        for group in choices:
            if set(group) <= layer.columns.keys():
                used |= set(group)
                if name not in corners:
                    values = np.column_stack([layer.columns[k] for k in group])
                    corners[name] = values.astype(np.float64)[layer.faces]
    return corners, used


def _shares(columns: Columns) -> NDArray[np.float64] | None:
    """Return colours in [0, 1]; None without."""
    if not set(RGB) <= columns.keys():
        return None
    dtype = columns["red"].dtype
    scale = 1.0 / np.iinfo(dtype).max if dtype.kind == "u" else 1.0
    return scale * np.column_stack([columns[name] for name in RGB]).astype(np.float64)


def _materials(layer: Layer, path: Path) -> tuple[str | None, list[str], NDArray[np.int64] | None]:
    """Return the text of the library, the names of materials, and the material of every face."""
    if layer.faces is None:
        return None, [], None
    if isinstance(layer.origin, Origin) and layer.origin.libraries:
        libraries = [text for _, text in layer.origin.libraries]
        text = "".join(text if text.endswith("\n") else f"{text}\n" for text in libraries)
        named = dict.fromkeys(images(text))
        if len(named) == len(layer.textures):
            text = rename_images(text, dict(zip(named, layer.textures, strict=True)))
        return text or None, [m.name for m in layer.materials], layer.face_columns.get(MATERIAL)
    if layer.materials:
        made = list(layer.materials)
        known = any(m.color or m.texture for m in made)  # else their library is missing
        library = write_materials(made) if known else None
        return library, [m.name for m in made], layer.face_columns[MATERIAL]
    if layer.textures:
        names = [f"material_{number}" for number in range(len(layer.textures))]
        made = [Material(name, None, t) for name, t in zip(names, layer.textures, strict=True)]
        number = layer.face_columns.get("texnumber", np.zeros(len(layer.faces), dtype=np.int64))
        return write_materials(made), names, np.clip(number, -1, len(made) - 1)
    shades = _shares(layer.face_columns)
    if shades is None:
        return None, [], None
    colors, number = np.unique(shades, axis=0, return_inverse=True)
    names = [f"color_{number}" for number in range(len(colors))]
    made = [Material(name, tuple(c)) for name, c in zip(names, colors.tolist(), strict=True)]
    return write_materials(made), names, number.reshape(-1)


def _distinct(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return distinct rows of values at corners (F, 3, d), and the row of every corner."""
    flat = np.ascontiguousarray(values.reshape(-1, values.shape[2]), dtype=np.float64) + 0.0
    rows = flat.view([("", flat.dtype)] * flat.shape[1]).reshape(-1)
    _, first, number = np.unique(rows, return_index=True, return_inverse=True)
    return flat[first], number.reshape(-1, 3)


def _rows(key: str, values: NDArray[Any]) -> list[str]:
    """Return lines of numbers, as short as they can be and still the same when read."""
    texts = [list(map(repr, column)) for column in values.T.astype(np.float64).tolist()]
    return [f"{key} {row}" for row in map(" ".join, zip(*texts, strict=True))]


def _faces(
    layer: Layer,
    slots: list[NDArray[Any] | None],
    names: list[str],
    material: NDArray[np.int64] | None,
) -> list[str]:
    """Return the lines of faces, in groups that change as seldom as in the input."""
    count = 0 if layer.faces is None else len(layer.faces)
    texts = []
    for corner in range(3):
        parts = [None if s is None else list(map(str, (s[:, corner] + 1).tolist())) for s in slots]
        blank = [""] * count
        if parts[2] is not None:
            words = map("/".join, zip(parts[0] or blank, parts[1] or blank, parts[2], strict=True))
        elif parts[1] is not None:
            words = map("/".join, zip(parts[0] or blank, parts[1], strict=True))
        else:
            words = map(str, parts[0] or blank)
        texts.append(list(words))
    lines = [f"f {row}" for row in map(" ".join, zip(*texts, strict=True))]
    states = layer.origin.groups if isinstance(layer.origin, Origin) else ()
    group = layer.face_columns.get(GROUP) if states else None
    inserted: list[tuple[int, str]] = []
    for numbers, texts_of in (
        (group, states),
        (material, tuple((f"usemtl {name}",) if name else () for name in [*names, "none"])),
    ):
        if numbers is None or not count:
            continue
        change = np.flatnonzero(np.append(True, numbers[1:] != numbers[:-1]))
        inserted += [
            (at, "\n".join(texts_of[numbers[at]])) for at in change.tolist()
        ]  # fmt: skip
    for at, text in sorted(inserted, key=lambda item: item[0], reverse=True):
        if text:
            lines.insert(at, text)
    return lines
