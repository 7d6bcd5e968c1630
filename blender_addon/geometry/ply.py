# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a PLY file in the precision they are stored in: Blender's own import rounds them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .read import HostError

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
LONGEST_HEADER = 1 << 16


class Element(NamedTuple):
    """One element of a header: its name, number of rows, and properties' names and types."""

    name: str
    rows: int
    properties: list[tuple[str, str]]


def read_points(path: Path) -> dict[str, NDArray[Any]]:
    """Return the properties of a PLY file's vertices, one array (n,) each.

    Raises
    ------
    HostError
        If it is no PLY file, has no vertices or ends too early.
    OSError
        If it cannot be opened.
    """
    with path.open("rb") as file:
        kind, elements = _read_header(path, file)
        for element in elements:
            last = element.name == "vertex"
            if any(of == "list" for _, of in element.properties):
                raise _damaged(path, f"its {element.name} elements have lists before the vertices")
            rows = _read_rows(path, file, element, kind)
            if last:
                if not {"x", "y", "z"} <= set(rows.dtype.names or ()):
                    raise _damaged(path, "its vertices have no x, y and z")
                return {name: rows[name] for name in rows.dtype.names or ()}
    raise _damaged(path, "it has no vertices")


def _damaged(path: Path, why: str) -> HostError:
    return HostError(f"{path.name}: {why}; give a PLY file of points")


def _read_header(path: Path, file: Any) -> tuple[str, list[Element]]:
    """Return the format, and the elements up to the vertices."""
    if file.readline(16).strip() != b"ply":
        raise _damaged(path, "is no PLY file")
    kind, elements = "", []
    while True:
        line = file.readline(LONGEST_HEADER)
        words = line.decode("ascii", "replace").split()
        if not line.endswith(b"\n") or file.tell() > LONGEST_HEADER:
            raise _damaged(path, "its header has no end")
        try:
            if words[:1] == ["end_header"]:
                break
            if words[:1] == ["format"]:
                kind = words[1]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                of = "list" if words[1] == "list" else TYPES[words[1]]
                elements[-1].properties.append((words[-1], of))
        except (IndexError, KeyError, ValueError):
            raise _damaged(path, f"{' '.join(words)!r} in its header means nothing") from None
    if kind not in ORDERS:
        raise _damaged(path, f"its format is {kind!r}")
    return kind, elements


def _read_rows(path: Path, file: Any, element: Element, kind: str) -> NDArray[Any]:
    """Return the values of an element's properties."""
    order = ORDERS[kind]
    dtype = np.dtype([(name, order + of) for name, of in element.properties])
    if kind == "ascii":
        try:
            rows = np.loadtxt(file, dtype=dtype, max_rows=element.rows, ndmin=1, comments=None)
        except ValueError as error:
            raise _damaged(path, f"its {element.name} elements cannot be read: {error}") from None
    else:
        data = file.read(dtype.itemsize * element.rows)
        rows = np.frombuffer(data[: len(data) // dtype.itemsize * dtype.itemsize], dtype=dtype)
    if len(rows) < element.rows:
        raise _damaged(path, f"has {len(rows)} of {element.rows} {element.name} elements")
    return rows
