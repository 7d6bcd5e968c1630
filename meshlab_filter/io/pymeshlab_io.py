# SPDX-License-Identifier: GPL-3.0-or-later
"""Call pymeshlab's readers and writers, silently and with errors of one kind."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab

from ..errors import FileError
from . import formats
from .headers import PROJECT, mesh_files


class UnknownFormatError(FileError):
    """A format that MeshLab does not read."""


def load(path: Path) -> Any:
    """Load a mesh file, or a project with all its layers, into a new `pymeshlab.MeshSet`.

    Raises
    ------
    FileError
        If MeshLab does not understand the file.
    """
    mesh_set = pymeshlab.MeshSet(verbose=False)
    absolute = str(path.resolve())
    read = mesh_set.load_project if path.suffix.lower() == PROJECT else mesh_set.load_new_mesh
    try:
        with _silence():
            read(absolute)
    except (pymeshlab.PyMeshLabException, RuntimeError, IndexError) as error:
        text = _one_line(error, path)
        if "Unknown format" in text:
            raise UnknownFormatError(f"{path}: {formats.unknown(path)}") from error
        raise FileError(f"{path}: {text}") from error
    if not mesh_set.mesh_number():
        raise FileError(f"{path}: holds no mesh")
    _correct_textures(mesh_set, path)
    return mesh_set


def _correct_textures(mesh_set: Any, path: Path) -> None:
    """Give the layers of a project the textures from their own folders.

    MeshLab prefers textures of the same names in the project's folder. Only a mesh with a single
    texture can be given another.
    """
    current = mesh_set.current_mesh_id()
    for mesh, part in zip(mesh_set, mesh_files(path), strict=False):
        for name in mesh.textures() if mesh.texture_number() == 1 else ():
            own, loaded = part.parent / name, path.parent / name
            if own.is_file() and loaded.is_file() and not own.samefile(loaded):
                mesh_set.set_current_mesh(mesh.id())
                mesh_set.set_texture_per_mesh(textname=str(own.resolve()))
    mesh_set.set_current_mesh(current)


def save(mesh_set: Any, path: Path, shown_as: Path, **options: Any) -> None:
    """Save the current layer as `path`; messages name the file `shown_as` instead.

    Raises
    ------
    FileError
        If the format cannot hold the layer.
    OSError
        If the disk is full.
    """
    try:
        with _silence():
            mesh_set.save_current_mesh(str(path.resolve()), **options)
    except (pymeshlab.PyMeshLabException, RuntimeError, IndexError) as error:
        _check_space(path, shown_as)
        text = _one_line(error, path)
        raise FileError(f"{shown_as}: {text}; choose another format, such as .ply") from error
    _check_space(path, shown_as)


def save_project(mesh_set: Any, path: Path, shown_as: Path) -> None:
    """Save a project, whose layers are already saved, as `path`.

    Raises
    ------
    OSError
        If MeshLab could not write it, which it does not always report.
    """
    try:
        with _silence():
            # Given a relative path, MeshLab fails without an exception.
            mesh_set.save_project(str(path.resolve()))
    except (pymeshlab.PyMeshLabException, RuntimeError, IndexError) as error:
        raise OSError(f"{shown_as}: {_one_line(error, path)}") from error
    _check_space(path, shown_as)
    if not path.is_file():
        raise OSError(f"{shown_as}: could not be written")


def writes(ending: str) -> bool:
    """Return whether MeshLab writes files of an ending such as ``.obj``."""
    # The options of a writer can be asked for by its ending, as those of a filter by its name.
    mesh_set = pymeshlab.MeshSet(verbose=False)
    mesh_set.add_mesh(pymeshlab.Mesh(np.zeros((1, 3))))
    try:
        mesh_set.filter_parameter_values(ending.removeprefix("."))
    except pymeshlab.PyMeshLabException:
        return False
    return True


@contextmanager
def _silence() -> Iterator[None]:
    """Discard what compiled code prints, and restore the working directory, which it may change."""
    with ExitStack() as stack:
        here = os.getcwd()
        stack.callback(os.chdir, here)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        stack.callback(os.close, nowhere)
        for stream in (1, 2):
            with suppress(OSError):  # the stream may be closed
                kept = os.dup(stream)
                stack.callback(os.close, kept)
                stack.callback(os.dup2, kept, stream)
                os.dup2(nowhere, stream)
        yield


def _check_space(path: Path, shown_as: Path) -> None:
    """Raise an OSError if a file that was written cannot grow: some writers ignore a full disk."""
    if not path.is_file():
        return
    size = path.stat().st_size
    try:
        with path.open("ab") as file:
            file.write(bytes(65536))
            file.flush()
            os.fsync(file.fileno())
        os.truncate(path, size)
    except OSError as error:
        raise OSError(f"{shown_as}: not written to the end ({error.strerror})") from error


def _one_line(error: Exception, path: Path) -> str:
    """Return MeshLab's message as one line, without the path that it was given."""
    text = str(error).replace(str(path.resolve()), "").replace(str(path), "")
    lines = [line.strip(" :") for line in text.splitlines()]
    return ": ".join(filter(None, lines)) or type(error).__name__
