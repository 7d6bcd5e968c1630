# SPDX-License-Identifier: GPL-3.0-or-later
"""Read and write PCD files of the Point Cloud Library, with all their fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn, ignore
from .formats import required
from .layer import RGB, XYZ, Columns, Layer

FACES = False
NORMALS = {"normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}
SHIFTS = dict(zip((*RGB, "alpha"), (16, 8, 0, 24), strict=True))
"""Bits by which the colours are shifted in a packed field."""


class Origin(NamedTuple):
    """What a layer remembers of its file."""

    metadata: Any
    names: dict[str, str]


def is_plain(_: Path) -> bool:
    """Return whether this module reads a file."""
    return True


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read a cloud.

    Raises
    ------
    FileError
        If the file is damaged, or pypcd4 is not installed.
    """
    pypcd4 = required("pypcd4", path)
    try:
        _check_size(path)
        cloud = pypcd4.PointCloud.from_path(path)
        data = cloud.pc_data
        if len(data) != cloud.metadata.points:
            raise ValueError(f"{cloud.metadata.points} points are declared, {len(data)} are there")
    except MemoryError:
        raise
    except Exception as error:  # of the parser, the decompressor or the checker of headers
        said = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: is cut short or damaged ({said})") from error
    columns: Columns = {}
    names = {}
    for name in data.dtype.names:
        values = np.ascontiguousarray(data[name])
        if name in ("rgb", "rgba") and values.dtype.itemsize == 4:
            packed = values.view(np.uint32)
            parts = (*RGB, "alpha") if name == "rgba" else RGB
            columns |= {k: (packed >> SHIFTS[k] & 0xFF).astype(np.uint8) for k in parts}
            names[name] = name
        elif not name.startswith("#$%&~~"):  # padding
            columns[NORMALS.get(name, name)] = values
    missing = [name for name in XYZ if name not in columns]
    if missing:
        raise FileError(f"{path}: has no field {', '.join(missing)}; is it a cloud?")
    points = np.column_stack([columns[name] for name in XYZ]).astype(np.float64)
    return [Layer(path.stem, points, columns, origin=Origin(cloud.metadata, names))]


def _check_size(path: Path) -> None:
    """Refuse a file that declares more points than it can have, before memory is asked for."""
    with path.open("rb") as file:
        head = file.read(8192).decode("ascii", "replace")
    fields = {words[0]: words[1:] for words in map(str.split, head.splitlines()) if words}
    declared = int(fields["POINTS"][0])
    sizes = np.array(fields["SIZE"], dtype=np.int64)
    width = int(sizes @ np.array(fields.get("COUNT", np.ones_like(sizes)), dtype=np.int64))
    least = {"ascii": 2 * declared, "binary": width * declared}.get(fields["DATA"][0], 0)
    if path.stat().st_size < least or declared > 1000 * path.stat().st_size:
        raise ValueError(f"{declared} points do not fit into {path.stat().st_size} bytes")


def write(layer: Layer, path: Path, warn: Warn = ignore) -> None:
    """Write a cloud in binary form."""
    pypcd4 = required("pypcd4", path)
    fields: dict[str, NDArray[Any]] = {}
    lost = []
    back = {short: long for long, short in NORMALS.items()}
    packed = _packed(layer.columns)
    for name, values in layer.columns.items():
        if packed is not None and name in SHIFTS:
            fields.setdefault("rgba" if "alpha" in layer.columns else "rgb", packed)
        elif values.dtype.kind in "iuf" and values.dtype.itemsize <= 8 and values.dtype != "f2":
            fields[back.get(name, name.replace(" ", "_"))] = values
        elif values.dtype.kind == "b":
            fields[name] = values.astype(np.uint8)
        else:
            lost.append(name)
    if lost:
        warn(f"{path}: .pcd files do not keep {', '.join(lost)}; .csv does")
    types = tuple(values.dtype.type for values in fields.values())
    cloud = pypcd4.PointCloud.from_points(list(fields.values()), tuple(fields), types)
    if isinstance(layer.origin, Origin):
        viewpoint = layer.origin.metadata.viewpoint
        cloud.metadata = cloud.metadata.derive(viewpoint=viewpoint)
    cloud.save(path)


def _packed(columns: Columns) -> NDArray[Any] | None:
    """Return colours in one field, as the library does; None where they are no bytes."""
    names = [name for name in SHIFTS if name in columns]
    if not set(RGB) <= set(names) or any(columns[name].dtype != np.uint8 for name in names):
        return None
    packed = np.zeros(len(columns["red"]), dtype=np.uint32)
    for name in names:
        packed |= columns[name].astype(np.uint32) << np.uint32(SHIFTS[name])
    return packed if "alpha" in names else packed.view(np.float32)
