# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a PLY file in the precision they are stored in: Blender's own import rounds them.

plyfile knows the grammar of headers and lists; tables of plain numbers are read by numpy at once.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .libraries import required
from .read import HostError

LONGEST_HEADER = 1 << 20
END = b"end_header"


def read_points(path: Path) -> dict[str, NDArray[Any]]:
    """Return the properties of a PLY file's vertices, one array (n,) each.

    Raises
    ------
    HostError
        If it is no PLY file, has no vertices or ends too early.
    OSError
        If it cannot be opened.
    """
    plyfile = required("plyfile", path)
    with path.open("rb") as file:
        try:
            header, counts = _read_header(plyfile, file)
            names = [element.name for element in header.elements]
            if "vertex" not in names:
                raise _Damage("it has no vertices")
            before = header.elements[: names.index("vertex") + 1]
            if any(isinstance(p, plyfile.PlyListProperty) for e in before for p in e.properties):
                rows = plyfile.PlyData.read(str(path))["vertex"].data
            else:
                for element in before:
                    rows = _read_rows(header, file, element, counts[element.name])
        except (_Damage, plyfile.PlyParseError, ValueError) as error:
            said = " ".join(str(error).split()) or type(error).__name__
            raise HostError(f"{path.name}: {said}; give a PLY file of points") from None
    found = {name: rows[name] for name in rows.dtype.names or ()}
    if not {"x", "y", "z"} <= found.keys():
        raise HostError(f"{path.name}: its vertices have no x, y and z; give a PLY file of points")
    return {name: values for name, values in found.items() if values.dtype != object}


class _Damage(ValueError):
    """What is wrong with a file."""


def _read_header(plyfile: Any, file: Any) -> tuple[Any, dict[str, int]]:
    """Return a file without rows that has a file's elements, and their numbers of rows."""
    start = file.read(LONGEST_HEADER)
    head, end, rest = start.partition(END)
    if not start.startswith(b"ply"):
        raise _Damage("is no PLY file")
    if not end or b"\n" not in rest:
        raise _Damage("its header has no end")
    file.seek(len(head) + len(end) + rest.index(b"\n") + 1)
    lines = head.decode("utf-8", "replace").replace("\r", "").split("\n")
    counts: dict[str, int] = {}
    for k, line in enumerate(lines):
        words = line.split()
        if words[:1] == ["element"] and len(words) == 3 and words[2].isdecimal():
            counts[words[1]] = int(words[2])
            lines[k] = f"element {words[1]} 0"
    bare = "\n".join([*filter(None, lines), END.decode(), ""])
    return plyfile.PlyData.read(io.BytesIO(bare.encode())), counts


def _read_rows(header: Any, file: Any, element: Any, count: int) -> NDArray[Any]:
    """Return the values of an element's properties."""
    dtype = np.dtype([(p.name, p.dtype(header.byte_order)) for p in element.properties])
    if header.text:
        rows = np.loadtxt(file, dtype=dtype, max_rows=count, ndmin=1, comments=None)
    else:
        data = file.read(dtype.itemsize * count)
        rows = np.frombuffer(data[: len(data) // dtype.itemsize * dtype.itemsize], dtype=dtype)
    if len(rows) < count:
        raise _Damage(f"has {len(rows)} of {count} {element.name} elements")
    return rows
