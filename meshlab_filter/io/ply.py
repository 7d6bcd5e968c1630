# SPDX-License-Identifier: GPL-3.0-or-later
"""Read PLY files with every property of points and faces, in its own type.

plyfile knows the header's grammar and reads lists of mixed lengths; all else is read by numpy in
one piece.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray
from plyfile import PlyData, PlyListProperty, PlyParseError

from ..errors import FileError, Warn, ignore
from .layer import XYZ, Columns, Layer
from .polygons import triangulate

FACE_LISTS = ("vertex_indices", "vertex_index")
TEXCOORD = "texcoord"
MAX_HEADER = 1 << 20
TEXTURE = "TextureFile"


class Header(NamedTuple):
    """What a PLY file declares."""

    text: bool
    order: str
    elements: list[Any]
    counts: list[int]
    comments: list[str]
    size: int


class Origin(NamedTuple):
    """What a layer remembers of its PLY file besides points and faces."""

    comments: tuple[str, ...]
    others: tuple[Any, ...]


def is_plain(path: Path) -> bool:
    """Return whether this module reads a file: points, triangles and polygons, as most are."""
    try:
        header = read_header(path)
    except FileError:
        return True  # to be refused
    names = {element.name for element in header.elements}
    vertices = next((e for e in header.elements if e.name == "vertex"), None)
    if vertices is None or not set(XYZ) <= {p.name for p in vertices.properties}:
        return False
    return not names & {"tristrips", "range_grid"}


def read_header(path: Path) -> Header:
    """Read the header of a PLY file.

    Raises
    ------
    FileError
        If it is none.
    """
    with path.open("rb") as file:
        start = file.read(MAX_HEADER)
    head, end, rest = start.partition(b"end_header")
    newline = re.match(rb"[ \t]*(\r\n|\n|\r)", rest)
    if not start.startswith(b"ply") or not end or newline is None:
        raise FileError(f"{path}: is no PLY file, for its header is missing or cut short")
    lines = re.split(r"\r\n|\n|\r", head.decode("utf-8", "surrogateescape"))
    kept, counts, comments = [], [], []
    for line in lines:
        words = line.split()
        if words[:1] in (["comment"], ["obj_info"]):
            comments.append(line)
        elif words[:1] == ["element"]:
            if len(words) != 3 or not words[2].isdecimal():
                raise FileError(f"{path}: {line!r} in the header does not say how many there are")
            counts.append(int(words[2]))
            kept.append(f"element {words[1]} 0")
        elif words:
            kept.append(line)
    text = "\n".join([*kept, "end_header", ""])
    try:
        data = PlyData.read(io.BytesIO(text.encode("utf-8", "surrogateescape")))
    except (PlyParseError, ValueError, UnicodeError) as error:
        raise FileError(f"{path}: its header cannot be understood ({error})") from error
    size = len(head) + len(end) + newline.end()
    return Header(data.text, data.byte_order, list(data.elements), counts, comments, size)


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read a PLY file.

    Parameters
    ----------
    path : Path
    warn : callable
        Called with a sentence for each thing that is not carried over.

    Raises
    ------
    FileError
        If the file is damaged.
    """
    header = read_header(path)
    _check_size(header, path)
    tables = _read_tables(header, path)
    vertices = tables.pop("vertex")
    columns = {name: _native(vertices[name]) for name in names_of(vertices)}
    lists = [name for name, values in columns.items() if is_list(values)]
    if lists:
        warn(f"{path}: lists at points are left out: {', '.join(lists)}")
    columns = {name: values for name, values in columns.items() if name not in lists}
    points = np.column_stack([columns[name] for name in XYZ]).astype(np.float64)
    faces, face_columns, corners = _split_faces(tables.pop("face", None), points, path, warn)
    textures = [
        words[2].strip()
        for words in (line.split(maxsplit=2) for line in header.comments)
        if len(words) == 3 and words[:2] == ["comment", TEXTURE]
    ]
    left = [name for name, table in tables.items() if _refers(table)]
    if left:
        warn(
            f"{path}: elements that refer to points by number are left out: "
            f"{', '.join(f'{len(tables[name])} {name}' for name in left)}"
        )
    others = tuple((name, table) for name, table in tables.items() if name not in left)
    origin = Origin(tuple(header.comments), others)
    return [
        Layer(path.stem, points, columns, faces, face_columns, corners, origin, tuple(textures))
    ]


def _check_size(header: Header, path: Path) -> None:
    """Refuse a file that is shorter than its header demands, before memory is asked for."""
    least = header.size
    for element, count in zip(header.elements, header.counts, strict=True):
        listed = [isinstance(p, PlyListProperty) for p in element.properties]
        if header.text:
            least += count * 2 * max(len(listed), 1) - 1
        else:
            least += count * sum(
                np.dtype(p.list_dtype()[0] if is_list else p.dtype()).itemsize
                for p, is_list in zip(element.properties, listed, strict=True)
            )
    size = path.stat().st_size
    if size < least:
        raise FileError(f"{path}: is cut short, to {size} of at least {least} bytes; copy it again")


def _read_tables(header: Header, path: Path) -> dict[str, NDArray[Any]]:
    """Return the elements as structured arrays; lists of one length are columns of that width."""
    for length in (3, 4):
        try:
            return _read_uniform(header, path, length)
        except _MixedLengthsError:
            continue
        except (ValueError, OSError) as error:
            raise FileError(f"{path}: is cut short or damaged ({error})") from error
    with path.open("rb") as file:
        file.seek(header.size)
        data = file.read()
    lines = [f"format {_FORMATS[header.order] if not header.text else 'ascii'} 1.0"]
    for element, count in zip(header.elements, header.counts, strict=True):
        lines += [f"element {element.name} {count}", *map(str, element.properties)]
    start = "\n".join(["ply", *lines, "end_header", ""]).encode()
    try:
        whole = PlyData.read(io.BytesIO(start + data))
    except (PlyParseError, ValueError, UnicodeError, MemoryError) as error:
        raise FileError(f"{path}: is cut short or damaged ({error})") from error
    return {element.name: element.data for element in whole.elements}


class _MixedLengthsError(Exception):
    """Lists are not of the length that was tried."""


_FORMATS = {"<": "binary_little_endian", ">": "binary_big_endian"}


def _read_uniform(header: Header, path: Path, length: int) -> dict[str, NDArray[Any]]:
    """Read all elements, with lists of indices of this length, and texture coordinates to match."""
    tables = {}
    with path.open("rb") as file:
        file.seek(header.size)
        lines = io.TextIOWrapper(file, "ascii", errors="replace") if header.text else None
        for element, count in zip(header.elements, header.counts, strict=True):
            fields: list[Any] = []
            expected = {}
            for p in element.properties:
                if isinstance(p, PlyListProperty):
                    number, value = p.list_dtype(header.order)
                    expected[p.name] = 2 * length if p.name == TEXCOORD else length
                    fields += [(f"{p.name} count", number), (p.name, value, (expected[p.name],))]
                else:
                    fields.append((p.name, p.dtype(header.order)))
            dtype = np.dtype(fields)
            if lines is None:
                table = _read_binary(file, dtype, count)
            else:
                table = _read_text(lines, dtype, count, bool(expected))
            for name, width in expected.items():
                if (table[f"{name} count"] != width).any():
                    raise _MixedLengthsError
            tables[element.name] = table[[p.name for p in element.properties]]
    return tables


def _read_binary(file: BinaryIO, dtype: np.dtype[Any], count: int) -> NDArray[Any]:
    data = file.read(count * dtype.itemsize)
    if len(data) < count * dtype.itemsize:
        if any(name.endswith(" count") for name in dtype.names or ()):
            raise _MixedLengthsError
        raise ValueError(f"{len(data) // max(dtype.itemsize, 1)} of {count} rows are there")
    return np.frombuffer(data, dtype, count)


def _read_text(lines: Any, dtype: np.dtype[Any], count: int, lists: bool) -> NDArray[Any]:
    if not count:
        return np.empty(0, dtype)
    try:
        table = np.loadtxt(lines, dtype, comments=None, max_rows=count, ndmin=1)
    except ValueError as error:
        if lists:
            raise _MixedLengthsError from error
        raise
    if len(table) < count:
        raise ValueError(f"{len(table)} of {count} rows are there")
    return np.asarray(table)


def names_of(table: NDArray[Any]) -> tuple[str, ...]:
    """Return the names of a table's columns."""
    return table.dtype.names or ()


def _native(values: NDArray[Any]) -> NDArray[Any]:
    """Return values in the machine's byte order."""
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))


def _refers(table: NDArray[Any]) -> bool:
    """Return whether an element holds numbers of points, which a subset makes wrong."""
    return any(re.match(r"vert(ex|ices)", name) for name in names_of(table))


def _split_faces(
    table: NDArray[Any] | None, points: NDArray[np.float64], path: Path, warn: Warn
) -> tuple[NDArray[np.int64] | None, Columns, Columns]:
    """Return triangles, values of faces, and values of corners."""
    name = next((n for n in FACE_LISTS if table is not None and n in names_of(table)), None)
    if table is None or name is None or not len(table):
        return None, {}, {}
    flat, counts = _flat(table[name])
    if len(flat) and (flat.min() < 0 or flat.max() >= len(points)):
        raise FileError(
            f"{path}: a face refers to a point outside 0 to {len(points) - 1}; the file is damaged"
        )
    corner, polygon = triangulate(points, flat, counts)
    if not len(corner):
        return None, {}, {}
    if (counts > 3).any():
        warn(
            f"{path}: {np.count_nonzero(counts > 3)} of {len(counts)} faces are no triangles and "
            f"were cut into triangles, which makes {len(corner)}"
        )
    columns, corners = _split_values(table, name, counts, corner, polygon, path, warn)
    return flat[corner].astype(np.int64), columns, corners


def _split_values(
    table: NDArray[Any],
    indices: str,
    counts: NDArray[np.int64],
    corner: NDArray[np.int64],
    polygon: NDArray[np.int64],
    path: Path,
    warn: Warn,
) -> tuple[Columns, Columns]:
    """Return the values of faces, and those of corners: lists as long as the face or twice that."""
    columns, corners, left = {}, {}, []
    for name in (n for n in names_of(table) if n != indices):
        values = table[name]
        if not is_list(values):
            columns[name] = _native(values)[polygon]
            continue
        numbers, lengths = _flat(values)
        if (lengths == 2 * counts).all():
            corners[name] = numbers.reshape(-1, 2)[corner]
        elif (lengths == counts).all():
            corners[name] = numbers.reshape(-1, 1)[corner]
        else:
            left.append(name)
    if left:
        warn(f"{path}: lists at faces are left out: {', '.join(left)}")
    return columns, corners


def is_list(values: NDArray[Any]) -> bool:
    """Return whether a column holds lists."""
    return values.dtype.kind == "O" or values.ndim > 1


def _flat(lists: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return the entries of all lists in one array, and the length of each list."""
    if lists.dtype != object:
        width = lists.shape[1]
        return _native(lists.reshape(-1)), np.full(len(lists), width, dtype=np.int64)
    counts = np.fromiter(map(len, lists), dtype=np.int64, count=len(lists))
    return np.concatenate(list(lists)), counts
