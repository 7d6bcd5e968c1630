# SPDX-License-Identifier: GPL-3.0-or-later
"""Read what MeshLab's readers ignore: whether a file is complete, and what they will drop."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree

from ..errors import FileError

PROJECT = ".mlp"
_READ = {
    "x", "y", "z", "nx", "ny", "nz", "quality", "flags", "s", "t", "u",
    "v", "texture_u", "texture_v", "texcoord", "texnumber", "vertex_index", "vertex_indices",
}  # fmt: skip
"""Properties of PLY files that MeshLab reads as what they are; colours must be bytes."""
_COLORS = {
    prefix + name for prefix in ("", "diffuse_") for name in ("red", "green", "blue", "alpha")
}
_BYTE = {b"uchar", b"uint8"}


def check_complete(path: Path) -> None:
    """Refuse a file that is empty or truncated, also among the meshes of a project.

    Sizes are checked only in formats whose readers crash, hang or say nothing.

    Raises
    ------
    FileError
    """
    for part in (path, *mesh_files(path)):
        if not part.is_file():
            continue
        size = part.stat().st_size
        if size == 0:
            raise FileError(f"{part}: is empty; export or copy it again")
        if part.suffix.lower() in _MIN_SIZE:
            with part.open("rb") as file:
                least = _MIN_SIZE[part.suffix.lower()](file)
            if least > size:
                raise FileError(
                    f"{part}: is cut short, to {size} of at least {least} bytes; copy it again"
                )


def declared_vertices(path: Path) -> int | None:
    """Return the number of vertices in the header of a PLY file; None for other formats."""
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
    """Return the header of a PLY file; nothing for other formats."""
    if path.suffix.lower() != ".ply":
        return b""
    with path.open("rb") as file:
        return file.read(65536).partition(b"end_header")[0]


def layer_folder(source: Path, number: int) -> Path:
    """Return the folder of a mesh file, or of the file of layer `number` of a project."""
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
        return []  # MeshLab's reader says what is wrong


def _stl_size(file: BinaryIO) -> int:
    """Return the size of a binary STL file: a header, a count, and 50 bytes per triangle."""
    start = file.read(84)
    if start.lstrip().startswith(b"solid"):
        return 0  # text
    return 84 + 50 * int.from_bytes(start[80:84], "little") if len(start) == 84 else 84


def _3ds_size(file: BinaryIO) -> int:
    """Return the size that the outermost chunk of a 3DS file declares."""
    return int.from_bytes(file.read(6)[2:6], "little")


def _ctm_size(_: BinaryIO) -> int:
    """Return the size of a CTM file's header; the reader hangs on anything shorter."""
    return 36


_MIN_SIZE = {".stl": _stl_size, ".3ds": _3ds_size, ".ctm": _ctm_size}
"""Functions that read from an open file how many bytes it must have at least."""
