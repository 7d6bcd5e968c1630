# SPDX-License-Identifier: GPL-3.0-or-later
"""MeshLab's library where it meets the disk: quiet, and with errors of one kind."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import pymeshlab

from .errors import FileError
from .headers import PROJECT, mesh_files


class UnknownFormatError(FileError):
    """A format that MeshLab does not read."""


def load(path: Path) -> Any:
    """Return a `pymeshlab.MeshSet` with a file's mesh, or with a project's layers.

    Raises
    ------
    FileError
        If MeshLab does not understand the file.
    """
    mesh_set = pymeshlab.MeshSet(verbose=False)
    absolute = str(path.resolve())
    read = mesh_set.load_project if path.suffix.lower() == PROJECT else mesh_set.load_new_mesh
    try:
        with _quiet():
            read(absolute)
    except (pymeshlab.PyMeshLabException, RuntimeError) as error:
        text = _one_line(error, path)
        kind = UnknownFormatError if "Unknown format" in text else FileError
        raise kind(f"{path}: {text}") from error
    if not mesh_set.mesh_number():
        raise FileError(f"{path}: holds no mesh")
    _mend_textures(mesh_set, path)
    return mesh_set


def _mend_textures(mesh_set: Any, path: Path) -> None:
    """Give layers of a project the textures of their own folders.

    MeshLab takes those of the project's folder if there are any of the same names. Only a mesh
    with a single texture can be given another.
    """
    current = mesh_set.current_mesh_id()
    for mesh, part in zip(mesh_set, mesh_files(path), strict=False):
        for name in mesh.textures() if mesh.texture_number() == 1 else ():
            right, taken = part.parent / name, path.parent / name
            if right.is_file() and taken.is_file() and not right.samefile(taken):
                mesh_set.set_current_mesh(mesh.id())
                mesh_set.set_texture_per_mesh(textname=str(right.resolve()))
    mesh_set.set_current_mesh(current)


def save(mesh_set: Any, path: Path, known: Path, **options: Any) -> None:
    """Save the current layer as `path`, of which the user knows as `known`.

    Raises
    ------
    FileError
        If the format cannot hold the layer, or the disk is full.
    """
    try:
        with _quiet():
            mesh_set.save_current_mesh(str(path.resolve()), **options)
    except (pymeshlab.PyMeshLabException, RuntimeError) as error:
        _check_space(path, known)
        text = _one_line(error, path)
        raise FileError(f"{known}: {text}; choose another format, such as .ply") from error
    _check_space(path, known)


def save_project(mesh_set: Any, path: Path, known: Path) -> None:
    """Save a project's references as `path`; its layers are saved already.

    Raises
    ------
    OSError
        If MeshLab could not write it, of which it does not tell.
    """
    try:
        with _quiet():
            # An absolute path: with a relative one MeshLab fails without a word.
            mesh_set.save_project(str(path.resolve()))
    except (pymeshlab.PyMeshLabException, RuntimeError) as error:
        raise OSError(f"{known}: {_one_line(error, path)}") from error
    _check_space(path, known)
    if not path.is_file():
        raise OSError(f"{known}: could not be written")


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence what the library prints past Python, and stay in the folder that it may leave."""
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


def _check_space(path: Path, known: Path) -> None:
    """Raise an OSError if a file that was written could not grow: some writers do not notice."""
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
        raise OSError(f"{known}: not written to the end ({error.strerror})") from error


def _one_line(error: Exception, path: Path) -> str:
    """Return MeshLab's message as one line, without the path that it was given."""
    text = str(error).replace(str(path.resolve()), "").replace(str(path), "")
    lines = [line.strip(" :") for line in text.splitlines()]
    return ": ".join(filter(None, lines)) or type(error).__name__
