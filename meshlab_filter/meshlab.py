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
from .headers import PROJECT


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
    return mesh_set


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
        text = _one_line(error, path)
        if "stream error" in text.lower() or _is_full(path.parent):
            raise OSError(f"{known}: not written to the end; the disk may be full") from error
        raise FileError(f"{known}: {text}; choose another format, such as .ply") from error
    if _is_full(path.parent):
        raise OSError(f"{known}: could not be written to the end; the disk is full")


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
    if not path.is_file() or not path.stat().st_size or _is_full(path.parent):
        raise OSError(f"{known}: could not be written; the disk may be full")


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


def _is_full(folder: Path) -> bool:
    """Whether no space is left: some writers do not notice."""
    if not hasattr(os, "statvfs"):
        return False
    state = os.statvfs(folder)
    return state.f_blocks > 0 and state.f_bfree == 0


def _one_line(error: Exception, path: Path) -> str:
    """Return MeshLab's message as one line, without the path that it was given."""
    text = str(error).replace(str(path.resolve()), "").replace(str(path), "")
    lines = [line.strip(" :") for line in text.splitlines()]
    return ": ".join(filter(None, lines)) or type(error).__name__
