# SPDX-License-Identifier: GPL-3.0-or-later
"""Write PLY files with every property of points, faces and corners in its own type."""

from __future__ import annotations

import dataclasses
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from plyfile import PlyData, PlyElement, PlyListProperty, PlyProperty

from ..errors import Warn, ignore
from .layer import NORMAL, RGB, Columns, Layer, byte_colors
from .obj import NORMAL_CORNERS
from .ply import FACE_LISTS, TEXCOORD, TEXTURE, Origin, is_list, names_of

FACES = True


def write(layer: Layer, path: Path, warn: Warn = ignore) -> None:
    """Write a layer as a binary PLY file; `warn` hears of what PLY files cannot hold."""
    if not isinstance(layer.origin, Origin):
        layer = _adapted(layer, path, warn)
    layer = _with_normals(layer, path, warn)
    origin: Origin = layer.origin
    columns, lost = _writable(layer.columns)
    face_columns, lost_faces = _writable(layer.face_columns)
    if lost or lost_faces:
        warn(f"{path}: no type of PLY files holds {', '.join(lost + lost_faces)}; left out")
    tables = [("vertex", _table(columns, len(layer.points)))]
    if layer.faces is not None:
        lists: dict[str, NDArray[Any]] = {FACE_LISTS[0]: layer.faces.astype(np.int32)}
        lists |= {name: v.reshape(len(v), -1) for name, v in layer.corners.items()}
        tables.append(("face", _table(lists | face_columns, len(layer.faces))))
    comments = [line for line in origin.comments if TEXTURE not in line.split()]
    comments += [f"comment {TEXTURE} {name}" for name in layer.textures]
    head = ["ply", "format binary_little_endian 1.0", *comments]
    with path.open("wb") as file:
        for name, table in tables:
            head += [f"element {name} {len(table)}", *_properties(table)]
        others = [_element(name, table) for name, table in origin.others]
        for other in others:
            head += [f"element {other.name} {other.count}", *map(str, other.properties)]
        head.append("end_header\n")
        file.write("\n".join(head).encode("utf-8", "surrogateescape"))
        for _, table in tables:
            file.write(table.tobytes())
        for other in others:
            file.write(_body(other))


def _adapted(layer: Layer, path: Path, warn: Warn) -> Layer:
    """Return a layer of another format with what PLY files have in place of what they have not.

    Textures of materials become those of the file, colours of materials those of faces.
    """
    columns, face_columns = byte_colors(layer.columns), dict(layer.face_columns)
    corners, textures = dict(layer.corners), layer.textures
    names = [material.name for material in layer.materials if material.name]
    if names:
        warn(f"{path}: .ply files do not keep names of materials and groups; .obj does")
    if layer.materials:
        number = face_columns["material"]
        images = [material.texture for material in layer.materials]
        textures = tuple(dict.fromkeys(filter(None, images)))
        place = [textures.index(image) if image else -1 for image in images]
        if textures:
            face_columns["texnumber"] = np.array([*place, -1], dtype=np.int32)[number]
        elif any(material.color for material in layer.materials):
            white = (1.0, 1.0, 1.0)
            paint = np.array([*(material.color or white for material in layer.materials), white])
            shades = np.round(255.0 * np.clip(paint, 0.0, 1.0)).astype(np.uint8)[number]
            face_columns |= {name: shades[:, axis] for axis, name in enumerate(RGB)}
    if TEXCOORD in corners:
        corners[TEXCOORD] = corners[TEXCOORD][:, :, :2].astype(np.float32)
    return dataclasses.replace(
        layer,
        columns=columns,
        face_columns=face_columns,
        corners=corners,
        textures=textures,
        origin=Origin((), ()),
    )


def _with_normals(layer: Layer, path: Path, warn: Warn) -> Layer:
    """Return a layer whose normals of corners are those of points, if the corners of each agree."""
    normals = layer.corners.get(NORMAL_CORNERS)
    if normals is None or layer.faces is None:
        return layer
    corners = {name: v for name, v in layer.corners.items() if name != NORMAL_CORNERS}
    vectors, columns = np.zeros((len(layer.points), 3)), dict(layer.columns)
    vectors[layer.faces] = normals
    if np.allclose(vectors[layer.faces], normals, atol=1e-6, rtol=0.0):
        columns |= {name: vectors[:, axis] for axis, name in enumerate(NORMAL)}
    else:
        warn(f"{path}: .ply files do not keep normals of corners; .obj does")
    return dataclasses.replace(layer, columns=columns, corners=corners)


def _writable(columns: Columns) -> tuple[Columns, list[str]]:
    """Return columns in types that PLY files have, and the names of those for which none is."""
    result, lost = {}, []
    for name, values in columns.items():
        clean = re.sub(r"\s+", "_", name.strip()) or "unnamed"
        kind, size = values.dtype.kind, values.dtype.itemsize
        if kind == "b":
            result[clean] = values.astype(np.uint8)
        elif kind == "f" and size == 2:
            result[clean] = values.astype(np.float32)
        elif (kind in "iu" and size <= 4) or (kind == "f" and size <= 8):
            result[clean] = values
        elif kind in "iu" and (values.astype(np.float64).astype(values.dtype) == values).all():
            result[clean] = _shortest(values)
        else:
            lost.append(name)
    return result, lost


def _shortest(values: NDArray[Any]) -> NDArray[Any]:
    """Return 64-bit integers as 32-bit ones where these hold them, else as exact doubles."""
    for dtype in (np.int32, np.uint32):
        if len(values) == 0 or (
            np.iinfo(dtype).min <= values.min() and values.max() <= np.iinfo(dtype).max
        ):
            return values.astype(dtype)
    return values.astype(np.float64)


def _table(columns: Columns, count: int) -> NDArray[Any]:
    """Return columns as rows; two-dimensional ones become lists with their length in front."""
    fields: list[Any] = []
    for name, values in columns.items():
        dtype = values.dtype.newbyteorder("<")
        if values.ndim == 2:
            fields += [(f"{name} count", "u1"), (name, dtype, (values.shape[1],))]
        else:
            fields.append((name, dtype))
    table = np.zeros(count, dtype=fields)
    for name, values in columns.items():
        table[name] = values
        if values.ndim == 2:
            table[f"{name} count"] = values.shape[1]
    return table


def _properties(table: NDArray[Any]) -> list[str]:
    """Return the header's lines for the columns of a table."""
    lines = []
    for name in (n for n in names_of(table) if not n.endswith(" count")):
        dtype = table.dtype[name]
        if dtype.subdtype is None:
            lines.append(str(PlyProperty(name, dtype.str[1:])))
        else:
            lines.append(str(PlyListProperty(name, "u1", dtype.subdtype[0].str[1:])))
    return lines


def _element(name: str, table: NDArray[Any]) -> Any:
    """Return an element that is neither points nor faces as it was read."""
    lists = {key for key in names_of(table) if is_list(table[key])}
    fields = [
        (key, object) if key in lists else (key, table.dtype[key].newbyteorder("="))
        for key in names_of(table)
    ]
    packed = np.zeros(len(table), dtype=fields)
    for key in names_of(table):
        if key in lists:
            for row, values in enumerate(table[key]):
                packed[key][row] = values
        else:
            packed[key] = table[key]
    return PlyElement.describe(packed, name)


def _body(element: Any) -> bytes:
    """Return the rows of an element in binary form."""
    stream = io.BytesIO()
    data = PlyData([element], text=False, byte_order="<")
    data.write(stream)
    return stream.getvalue().partition(b"end_header\n")[2]
