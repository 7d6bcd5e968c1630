# SPDX-License-Identifier: GPL-3.0-or-later
"""Read E57 files: several stations, each with its pose."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileError, Warn, ignore
from .layer import RGB, XYZ, Columns, Layer
from .scans import transform

CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
INVALID = ("cartesianInvalidState", "sphericalInvalidState")
COLORS = dict(zip(("colorRed", "colorGreen", "colorBlue"), RGB, strict=True))


def is_plain(path: Path) -> bool:
    """Return whether pye57, which has no wheels for some systems, is there to read the file."""
    return importlib.util.find_spec("pye57") is not None


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read all scans, each with its pose applied; invalid points are left out.

    Raises
    ------
    FileError
        If the file is damaged.
    """
    import pye57

    layers, left, invalid = [], set(), 0
    try:
        with pye57.E57(str(path)) as file:
            for number in range(file.scan_count):
                layer, unread, bad = _read_scan(file, number, path)
                layers.append(layer)
                left |= unread
                invalid += bad
    except MemoryError:
        raise
    except Exception as error:  # of the compiled library
        said = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: is cut short or damaged ({said})") from error
    if not layers:
        raise FileError(f"{path}: holds no scans")
    if left:
        warn(
            f"{path}: fields that the reader does not know are left out: {', '.join(sorted(left))}"
        )
    if invalid:
        warn(f"{path}: {invalid} points that the file calls invalid were left out")
    return layers


def _read_scan(file: Any, number: int, path: Path) -> tuple[Layer, set[str], int]:
    """Return a scan, the names of fields that are not read, and the number of invalid points."""
    header = file.get_header(number)
    size = path.stat().st_size
    if header.point_count > 100 * size:
        raise ValueError(f"{header.point_count} points do not fit into {size} bytes")
    data = file.read_scan_raw(number, ignore_unsupported_fields=True)
    unread = set(header.point_fields) - set(data)
    valid = np.ones(header.point_count, dtype=bool)
    for name in INVALID:
        if name in data:
            valid &= data.pop(name) == 0
    if set(CARTESIAN) <= data.keys():
        points = np.column_stack([data.pop(name) for name in CARTESIAN])
    else:
        distance, azimuth, elevation = (data.pop(name) for name in SPHERICAL)
        level = distance * np.cos(elevation)
        points = np.column_stack(
            [level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)]
        )
    if header.has_pose():
        points = transform(points, _matrix(header.rotation), np.asarray(header.translation))
    points = points[valid]
    columns: Columns = {name: points[:, axis] for axis, name in enumerate(XYZ)}
    columns |= {
        COLORS.get(name, name): v[valid] for name, v in data.items() if name not in SPHERICAL
    }
    label = _name(header) or f"{path.stem} {number}"
    return Layer(label, points, columns), unread, int(np.count_nonzero(~valid))


def _name(header: Any) -> str:
    try:
        return str(header["name"].value())
    except Exception:  # the library has one kind of error, for scans without a name too
        return ""


def _matrix(quaternion: Any) -> Any:
    """Return the rotation matrix of a quaternion (w, x, y, z)."""
    from scipy.spatial.transform import Rotation

    w, x, y, z = quaternion
    return Rotation.from_quat([x, y, z, w]).as_matrix()
