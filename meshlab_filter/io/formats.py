# SPDX-License-Identifier: GPL-3.0-or-later
"""Which module reads and writes which format; all other formats are MeshLab's."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

from ..errors import FileError

MESHES = (".ply", ".obj")
"""Endings of meshes that MeshLab reads as well, with their textures as it wants to have them."""
TEXT = (".xyz", ".txt", ".csv", ".asc", ".pts")
SCANS = {".las": "las", ".laz": "las", ".pcd": "pcd"}
OTHERS = SCANS | dict.fromkeys(TEXT, "text")
READERS = {".ply": "ply", ".obj": "obj", ".e57": "e57", ".ptx": "ptx"} | OTHERS
WRITERS = {".ply": "ply", ".obj": "obj_write"} | OTHERS
"""Modules of this package by the ending of a file."""


def reader(path: Path) -> ModuleType | None:
    """Return the module that reads a file, with a function ``read(path, warn)``; None for none."""
    module = _module(READERS, path)
    if module is None or not module.is_plain(path):
        return None
    return module


def writer(path: Path) -> ModuleType | None:
    """Return the module that writes a file, with a function ``write(layer, path, warn)``."""
    return _module(WRITERS, path)


def _module(table: dict[str, str], path: Path) -> ModuleType | None:
    name = table.get(path.suffix.lower())
    return None if name is None else importlib.import_module(f".{name}", __package__)


def required(library: str, path: Path) -> ModuleType:
    """Import a library that reads scans.

    Raises
    ------
    FileError
        If it is not installed.
    """
    try:
        return importlib.import_module(library)
    except ImportError as error:
        raise FileError(
            f"{path}: {path.suffix} files need {library}: install it with "
            "pip install 'salient-simplify[scans]'"
        ) from error
