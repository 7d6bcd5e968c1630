# SPDX-License-Identifier: GPL-3.0-or-later
"""Which module reads and writes which format; all other formats are MeshLab's."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ..errors import FileError


class Format(NamedTuple):
    """A kind of file.

    Attributes
    ----------
    endings : tuple of str
    read, write : str or None
        Modules of this package, or ``MeshLab``; None where it is not done.
    keeps : str
        What travels from such a file, and to it, for the table in the README.
    lost : str
        What a result cannot hold as such a file; each loss is said by its name.
    """

    endings: tuple[str, ...]
    read: str | None
    write: str | None
    keeps: str
    lost: str


MESHLAB = "MeshLab"
FORMATS = (
    Format((".ply",), "ply", "ply_write",
           "every property of points, faces and corners in its own type, comments, textures, other "
           "elements", "normals of corners, names of materials"),
    Format((".obj",), "obj", "obj_write",
           "texture coordinates and normals of corners, colours of points, materials with their "
           "library and images, groups", "all other values"),
    Format((".glb", ".gltf"), "gltf", None,
           "all parts where their nodes put them, colours, normals, texture coordinates, "
           "materials, images as they are", ""),
    Format((".xyz", ".txt", ".csv", ".asc", ".pts"), "text", "text",
           "all columns, to the last digit", "faces; xyz: all but colours or normals; pts: all but "
           "intensity and colours"),
    Format((".las", ".laz"), "las", "las",
           "all dimensions, extra bytes, scale, offset, coordinate system, point format (COPC is "
           "read)", "faces; coordinates of other formats are rounded to 32 bits"),
    Format((".pcd",), "pcd", "pcd", "all fields, the viewpoint", "faces"),
    Format((".e57",), "e57", MESHLAB,
           "all stations with their poses, intensity, colours, rows and columns", "faces and all "
           "but colours, normals and quality; coordinates are rounded"),
    Format((".ptx",), "ptx", None, "all scans with their poses, intensity, colours", ""),
    Format((".mlp",), MESHLAB, MESHLAB, "all layers with their matrices, pictures", "as for .ply"),
    Format((".stl", ".off", ".3ds", ".dae", ".x3d", ".wrl", ".ctm"), MESHLAB, MESHLAB,
           "what MeshLab reads", "see [limits](docs/limits.md)"),
    Format((".3mf", ".fbx"), MESHLAB, None, "what MeshLab reads", ""),
)  # fmt: skip
"""All formats, but for some rare ones of MeshLab's."""
READERS = {e: f.read for f in FORMATS for e in f.endings if f.read not in (MESHLAB, None)}
WRITERS = {e: f.write for f in FORMATS for e in f.endings if f.write not in (MESHLAB, None)}
"""Modules of this package by the ending of a file."""
_LIBRARIES = {"las": "laspy", "pcd": "pypcd4"}
"""What modules need that write formats of the extra `scans`."""
TEXT = tuple(e for f in FORMATS for e in f.endings if f.read == "text")
MESHES = (".ply", ".obj", ".glb", ".gltf")
"""Endings of meshes that MeshLab reads as well, with their textures as it wants to have them."""
BY_MESHLAB = tuple(e for f in FORMATS for e in f.endings if f.read == MESHLAB)
_BLENDER = "Blender opens it: use the extension there, or its command, blender -c salient_simplify"
_REMEDIES = dict.fromkeys(
    (".blend", ".usd", ".usda", ".usdc", ".usdz", ".abc", ".svg", ".bvh"), _BLENDER
) | dict.fromkeys(
    (".step", ".stp", ".iges", ".igs", ".dwg", ".ifc", ".sldprt"),
    "it holds no mesh but a model of CAD: export it as .stl or .obj there",
)


def is_hopeless(path: Path) -> bool:
    """Return whether a file is of a kind that only other programs read."""
    return path.suffix.lower() in _REMEDIES


def unknown(path: Path) -> str:
    """Return what to do about a file that nothing here reads."""
    ending = path.suffix.lower()
    remedy = _REMEDIES.get(ending, "convert it to one of these")
    what = f"{ending} files are" if ending else "a file without an ending is"
    return f"{what} not read; {', '.join(sorted([*READERS, *BY_MESHLAB]))} are; {remedy}"


def reader(path: Path) -> ModuleType | None:
    """Return the module that reads a file, with a function ``read(path, warn)``; None for none."""
    module = _module(READERS, path)
    if module is None or not module.is_plain(path):
        return None
    return module


def writer(path: Path) -> ModuleType | None:
    """Return the module that writes a file, with a function ``write(layer, path, warn)``."""
    return _module(WRITERS, path)


def check_writer(path: Path) -> bool:
    """Return whether a module of this package writes a file, with all that it needs.

    Raises
    ------
    FileError
        If a library that it needs is not installed.
    """
    name = WRITERS.get(path.suffix.lower())
    if name in _LIBRARIES:
        required(_LIBRARIES[name], path)
    return name is not None


def _module(table: Mapping[str, str | None], path: Path) -> ModuleType | None:
    name = table.get(path.suffix.lower())
    return None if name is None else importlib.import_module(f".{name}", __package__)


def required(library: str, path: Path) -> ModuleType:
    """Import a library that reads or writes scans.

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
