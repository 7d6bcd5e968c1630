# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary PLY meshes in blocks: rows of points and faces as they lie in the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from plyfile import PlyListProperty

from ..errors import FileError
from ..io.layer import XYZ
from ..io.ply import FACE_LISTS, read_header
from .job import Source

BLOCK = 500_000
"""Rows that are in memory at a time."""
WHOLE = "simplify it in memory, without --tiled and its like"


class Table(NamedTuple):
    """An element of a PLY file whose rows are all of one size."""

    offset: int
    dtype: np.dtype[Any]
    length: int


class Layout(NamedTuple):
    """Where points and triangles lie in a PLY file.

    Attributes
    ----------
    path : str
    vertices, faces : Table
    corners : str
        Column of the faces that names their corners.
    head : str
        Header, with ``{vertex}`` and ``{face}`` for the numbers of points and faces.
    dropped : tuple of str
        Other elements.
    """

    path: str
    vertices: Table
    faces: Table
    corners: str
    head: str
    dropped: tuple[str, ...]


def look_at_mesh(path: Path) -> tuple[Source, Layout]:
    """Return a file and its layout.

    Raises
    ------
    FileError
        If it is no binary PLY file of triangles, or is cut short.
    """
    header = read_header(path)
    if header.text:
        raise FileError(f"{path}: tiles are read from binary files only; convert it, or {WHOLE}")
    tables: dict[str, Table] = {}
    offset, corners = header.size, ""
    lines: list[str] = []
    dropped: list[str] = []
    for element, count in zip(header.elements, header.counts, strict=True):
        if {"vertex", "face"} <= tables.keys():
            dropped.append(element.name)  # what follows is not read
            continue
        fields, lists = _fields(element, header.order, path)
        table = Table(offset, np.dtype(fields), count)
        offset += table.dtype.itemsize * count
        tables[element.name], corners = table, lists or corners
        if element.name in ("vertex", "face"):
            lines += [f"element {element.name} {{{element.name}}}"]
            lines += [_escaped(str(p)) for p in element.properties]
        else:
            dropped.append(element.name)
    vertices, faces = tables.get("vertex"), tables.get("face")
    if vertices is None or faces is None or not set(XYZ) <= set(vertices.dtype.names or ()):
        raise FileError(f"{path}: holds no points and faces that tiles could be cut from")
    if not corners:
        raise FileError(f"{path}: its faces have no corners ({' or '.join(FACE_LISTS)})")
    status = path.stat()
    least = max(table.offset + table.length * table.dtype.itemsize for table in (vertices, faces))
    if status.st_size < least:
        raise FileError(f"{path}: is cut short, to {status.st_size} of at least {least} bytes")
    form = "binary_big_endian" if header.order == ">" else "binary_little_endian"
    comments = [_escaped(line) for line in header.comments]
    head = "\n".join(["ply", f"format {form} 1.0", *comments, *lines, "end_header", ""])
    name, size, changed = str(path.resolve()), status.st_size, status.st_mtime_ns
    source = Source(name, size, changed, vertices.length, 0, (), ())
    return source, Layout(name, vertices, faces, corners, head, tuple(dropped))


def _fields(element: Any, order: str, path: Path) -> tuple[list[Any], str]:
    """Return the fields of an element whose rows are of one size, and its list of corners."""
    fields: list[Any] = []
    corners = ""
    for p in element.properties:
        if not isinstance(p, PlyListProperty):
            fields.append((p.name, p.dtype(order)))
            continue
        if element.name != "face" or p.name not in FACE_LISTS or corners:
            raise FileError(
                f"{path}: lists such as {p.name!r} of {element.name} are not carried by tiles; "
                f"{WHOLE}"
            )
        corners = p.name
        number, value = p.list_dtype(order)
        fields += [(f"{p.name} count", number), (p.name, value, (3,))]
    return fields, corners


def _escaped(line: str) -> str:
    """Return a line of a header that `str.format` leaves as it is."""
    return line.replace("{", "{{").replace("}", "}}")


def rows(layout: Layout, table: Table, start: int = 0, stop: int | None = None) -> NDArray[Any]:
    """Return rows of a table; they are read when they are looked at, and let go with the array."""
    stop = table.length if stop is None else min(stop, table.length)
    if stop <= start:
        return np.empty(0, dtype=table.dtype)
    offset = table.offset + start * table.dtype.itemsize
    return np.memmap(layout.path, table.dtype, "r", offset, (stop - start,))


def blocks(table: Table) -> list[tuple[int, int]]:
    """Return the bounds of blocks of rows."""
    return [(start, start + BLOCK) for start in range(0, table.length, BLOCK)]


def coordinates(points: NDArray[Any], chosen: Any = slice(None)) -> NDArray[np.float64]:
    """Return coordinates (n, 3) of rows of points, or of some of them."""
    return np.stack([points[name][chosen].astype(np.float64) for name in XYZ], axis=-1)


def read_points(layout: Layout, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the coordinates (n, 3) of points by their ascending numbers."""
    result = np.empty((len(numbers), 3))
    for start, stop in blocks(layout.vertices):
        first, last = np.searchsorted(numbers, [start, stop])
        if first < last:
            block = rows(layout, layout.vertices, start, stop)
            result[first:last] = coordinates(block, numbers[first:last] - start)
    return result


def read_corners(layout: Layout, start: int, stop: int) -> NDArray[np.int64]:
    """Return the corners (n, 3) of a block of faces.

    Raises
    ------
    FileError
        If some are no triangles, or refer to points that are not there.
    """
    block = rows(layout, layout.faces, start, stop)
    bad = block[f"{layout.corners} count"] != 3
    if bad.any():
        raise FileError(
            f"{layout.path}: not all faces are triangles, and tiles are made of these; cut it into "
            f"triangles, or {WHOLE}"
        )
    corners = block[layout.corners].astype(np.int64)
    if corners.min(initial=0) < 0 or corners.max(initial=0) >= layout.vertices.length:
        raise FileError(
            f"{layout.path}: a face refers to a point outside 0 to {layout.vertices.length - 1}; "
            "the file is damaged"
        )
    return corners
