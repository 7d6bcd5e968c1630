# SPDX-License-Identifier: GPL-3.0-or-later
"""Read and write LAS and LAZ files, COPC among them, with all their dimensions."""

from __future__ import annotations

import copy
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn, ignore
from .formats import required
from .layer import RGB, XYZ, Columns, Layer

FACES = False
RAW = ("X", "Y", "Z")
ROUNDING = 1e-6
"""Share of the bounding box's diagonal up to which a format may round in silence."""
MAX_RATIO = 50
"""Compression from which a LAZ file is read in pieces, lest it declare more than it has."""
MAX_NAME = 32


def is_plain(_: Path) -> bool:
    """Return whether this module reads a file."""
    return True


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read a cloud with all its dimensions, extra bytes among them.

    Raises
    ------
    FileError
        If the file is damaged, or laspy is not installed.
    """
    laspy = required("laspy", path)
    try:
        las = _read(laspy, path)
    except MemoryError:
        raise
    except Exception as error:  # each backend has errors of its own
        raise damage(path, error) from error
    columns: Columns = {name: np.array(las[name]) for name in XYZ}
    for name in las.point_format.dimension_names:
        if name not in RAW:
            values = np.array(las[name])
            if values.ndim == 1:
                columns[name] = values
            else:
                columns |= {f"{name}_{k}": values[:, k] for k in range(values.shape[1])}
    points = np.column_stack([columns[name] for name in XYZ])
    rows = np.arange(len(points), dtype=np.int64)
    return [Layer(path.stem, points, columns, origin=las, rows=rows)]


def damage(path: Path, error: Exception) -> FileError:
    """Return what to say where laspy cannot read a file.

    Raises
    ------
    FileError
        If it lacks a library.
    """
    said = " ".join(str(error).split()) or type(error).__name__
    if "backend" in said.lower():
        required("lazrs", path)
    return FileError(f"{path}: is cut short or damaged ({said})")


def join(layers: list[Layer], whole: Layer) -> Layer:
    """Return several clouds as one with the records of all, if they are of one format and scale."""
    first = layers[0].origin
    for layer in layers:
        header = layer.origin.header
        if header.point_format != first.header.point_format or not np.array_equal(
            header.scales, first.header.scales
        ):
            return whole
    las = required("laspy", Path("several.las")).LasData(copy.deepcopy(first.header))
    points = [layer.origin.points for layer in layers]
    shifts = [
        np.round((p.offsets - first.header.offsets) / first.header.scales).astype(np.int64)
        for p in points
    ]
    array = np.concatenate([p.array for p in points])
    at = 0
    for part, shift in zip(points, shifts, strict=True):
        for axis, name in enumerate(RAW):
            moved = part.array[name].astype(np.int64) + shift[axis]
            if np.abs(moved).max(initial=0) >= 2**31:
                return whole
            array[name][at : at + len(part)] = moved
        at += len(part)
    las.points = type(points[0])(
        array, points[0].point_format, scales=points[0].scales, offsets=points[0].offsets
    )
    return dataclasses.replace(whole, origin=las, rows=np.arange(len(array), dtype=np.int64))


def _read(laspy: Any, path: Path) -> Any:
    """Return the file as laspy has it, after a look at whether it is all there."""
    size = path.stat().st_size
    with laspy.open(path) as reader:
        header = reader.header
        declared = header.point_count * header.point_format.size
        if not header.are_points_compressed and header.offset_to_point_data + declared > size:
            raise ValueError(f"{header.point_count} points do not fit into {size} bytes")
        if declared > MAX_RATIO * size:
            for _ in reader.chunk_iterator(1_000_000):
                pass
    return laspy.read(path)


def write(layer: Layer, path: Path, warn: Warn = ignore) -> None:
    """Write a cloud; one that came from a LAS file keeps its format, scale, offset and records."""
    laspy = required("laspy", path)
    if path.suffix.lower() == ".laz":
        required("lazrs", path)
    make = _subset if isinstance(layer.origin, laspy.LasData) else _made
    las = make(laspy, layer)
    box = np.ptp(layer.points, axis=0)
    moved = np.abs(np.column_stack([las[name] for name in XYZ]) - layer.points).max(initial=0.0)
    if moved > ROUNDING * np.linalg.norm(box):
        warn(f"{path}: the format rounds coordinates, here by up to {moved:.2g}; .ply does not")
    lost = _set_columns(laspy, las, layer.columns)
    if lost:
        warn(f"{path}: {path.suffix} files do not keep {', '.join(lost)}; .ply and .csv do")
    las.write(str(path), do_compress=path.suffix.lower() == ".laz")


def _subset(laspy: Any, layer: Layer) -> Any:
    """Return the kept records of the file that the layer came from."""
    las = laspy.LasData(plain_header(layer.origin.header))
    las.points = layer.origin.points[layer.rows]
    for axis, name in enumerate(XYZ):
        if not np.array_equal(las[name], layer.points[:, axis]):
            las[name] = layer.points[:, axis]
    return las


def plain_header(header: Any) -> Any:
    """Return a copy of a header without the records that order the points of a COPC file."""
    header = copy.deepcopy(header)
    header.vlrs = [vlr for vlr in header.vlrs if vlr.user_id != "copc"]
    if header.evlrs is not None:
        header.evlrs = [vlr for vlr in header.evlrs if vlr.user_id != "copc"]
    return header


def _made(laspy: Any, layer: Layer) -> Any:
    """Return new records at the points, as finely as 32 bits allow in decimal steps."""
    colored = set(RGB) <= layer.columns.keys()
    header = laspy.LasHeader(version="1.4", point_format=7 if colored else 6)
    low, high = layer.points.min(axis=0), layer.points.max(axis=0)
    header.offsets = np.floor(0.5 * (low + high))
    reach = np.abs(layer.points - header.offsets).max(axis=0)
    header.scales = 10.0 ** np.ceil(np.log10(np.maximum(reach, 1e-30) / 2**31))
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord.zeros(len(layer.points), header=header)
    las.x, las.y, las.z = layer.points.T
    return las


def _set_columns(laspy: Any, las: Any, columns: Columns) -> list[str]:
    """Set the columns that differ from the records; others get a dimension of their own."""
    lost = []
    known = set(las.point_format.dimension_names)
    for name, values in columns.items():
        if name in XYZ:
            continue
        if name in RGB and set(RGB) <= known:
            values = _wide(values)
        if name in known and np.array_equal(np.asarray(las[name]), values):
            continue
        stem, _, number = name.rpartition("_")
        if stem in known and number.isdecimal() and np.ndim(las[stem]) == 2:
            continue  # a part of an array that the records have
        if name in known and _fits(las, name, values):
            las[name] = values.astype(np.asarray(las[name]).dtype)
            continue
        free = name if name not in known else f"{name}_value"
        if values.dtype.kind not in "iuf" or len(free.encode()) > MAX_NAME:
            lost.append(name)
            continue
        las.add_extra_dim(laspy.ExtraBytesParams(free, values.dtype))
        las[free] = values
    return lost


def _fits(las: Any, name: str, values: NDArray[Any]) -> bool:
    """Return whether a dimension holds values as they are."""
    if values.dtype.kind not in "iufb":
        return False
    held = np.asarray(las[name])
    if held.dtype.kind == "f":
        return bool((values.astype(held.dtype) == values).all())
    dimension = las.point_format.dimension_by_name(name)
    bits = dimension.num_bits
    low, high = (
        (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if held.dtype.kind == "i" else (0, 2**bits - 1)
    )
    whole = np.round(values) == values
    return bool(whole.all() and values.min(initial=0) >= low and values.max(initial=0) <= high)


def _wide(values: NDArray[Any]) -> NDArray[np.uint16]:
    """Return colours over the whole range of 16 bits, as the format demands."""
    if values.dtype == np.uint8:
        return values.astype(np.uint16) * np.uint16(257)
    if values.dtype.kind == "f":
        share = np.clip(np.nan_to_num(values), 0.0, 1.0)
        return np.asarray(np.round(65535.0 * share), dtype=np.uint16)
    return values.astype(np.uint16)
