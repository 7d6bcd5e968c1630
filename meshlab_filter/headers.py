# SPDX-License-Identifier: GPL-3.0-or-later
"""What files say of themselves, where MeshLab does not look: their length, and what they hold."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree

from .errors import FileError

PROJECT = ".mlp"
_READ = {
    *("x", "y", "z", "nx", "ny", "nz", "quality", "confidence", "intensity", "flags", "s", "t"),
    *("u", "v", "texture_u", "texture_v", "vertex_index", "vertex_indices", "texcoord"),
    "texnumber",
}
"""Properties of PLY files that MeshLab reads, of whatever type; colours are bytes only."""
_COLORS = {
    prefix + name for prefix in ("", "diffuse_") for name in ("red", "green", "blue", "alpha")
}
_BYTE = {b"uchar", b"uint8"}


def check_whole(path: Path) -> None:
    """Refuse a file that is empty or cut short, of those whose readers crash, wait or say nothing.

    A project's meshes are looked at too.

    Raises
    ------
    FileError
    """
    for part in (path, *mesh_files(path)):
        size = part.stat().st_size if part.is_file() else None
        if size == 0:
            raise FileError(f"{part}: is empty")
        told = _CLAIMS.get(part.suffix.lower(), _claims_nothing)
        if size is None or told is _claims_nothing:
            continue
        with part.open("rb") as file:
            least = told(file)
        if least > size:
            raise FileError(f"{part}: is cut short, to {size} of at least {least} bytes")


def declared_vertices(path: Path) -> int | None:
    """Return how many vertices a PLY file says it holds."""
    found = re.search(rb"element\s+vertex\s+(\d+)", _ply_header(path))
    return int(found.group(1)) if found else None


def unread_properties(path: Path) -> list[str]:
    """Return the properties of a PLY file's vertices and faces that MeshLab does not read."""
    names = []
    element = b""
    for line in _ply_header(path).splitlines():
        words = line.split()
        if words[:1] == [b"element"]:
            element = words[1] if len(words) > 1 else b""
        elif words[:1] == [b"property"] and len(words) > 2 and element in (b"vertex", b"face"):
            name = words[-1].decode("ascii", "replace")
            if name not in _READ and not (name in _COLORS and words[1] in _BYTE):
                names.append(name)
    return list(dict.fromkeys(names))


def _ply_header(path: Path) -> bytes:
    """Return the header of a PLY file; nothing of other files."""
    if path.suffix.lower() != ".ply":
        return b""
    with path.open("rb") as file:
        return file.read(65536).partition(b"end_header")[0]


def home(source: Path, number: int) -> Path:
    """Return the folder of a mesh file, or of the file of a project's layer."""
    parts = mesh_files(source)
    return (parts[number] if number < len(parts) else source).parent


def mesh_files(path: Path) -> list[Path]:
    """Return the mesh files that a project refers to, in the order of its layers."""
    if path.suffix.lower() != PROJECT:
        return []
    try:
        meshes = ElementTree.parse(path).iter("MLMesh")
        return [path.parent / mesh.get("filename", "") for mesh in meshes]
    except ElementTree.ParseError:
        return []  # MeshLab says what it is


def _claims_nothing(_: BinaryIO) -> int:
    return 0


def _stl(file: BinaryIO) -> int:
    """Return the length of a binary STL: a header, a number, and 50 bytes a triangle."""
    start = file.read(84)
    if start.lstrip().startswith(b"solid"):
        return 0
    return 84 + 50 * int.from_bytes(start[80:84], "little") if len(start) == 84 else 84


def _3ds(file: BinaryIO) -> int:
    """Return the length that the outermost chunk of a 3DS file tells."""
    return int.from_bytes(file.read(6)[2:6], "little")


def _ctm(_: BinaryIO) -> int:
    """Return the length of a CTM file's header; with less its reader waits for ever."""
    return 36


_CLAIMS = {".stl": _stl, ".3ds": _3ds, ".ctm": _ctm}
