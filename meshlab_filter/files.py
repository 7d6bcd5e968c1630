# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files and MeshLab projects: read with clear errors, written whole or not at all."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pymeshlab

import salcore

PROJECT = ".mlp"
NORMALS = {".ply", ".obj", ".off", ".xyz", ".e57"}
"""Formats whose writers take `save_vertex_normal`."""


class FileError(salcore.SalcoreError):
    """A file that cannot be read or written."""


def load(path: Path, warn: Callable[[str], None] = lambda message: None) -> Any:
    """Return a `pymeshlab.MeshSet` with the file's mesh, or with a project's layers.

    Parameters
    ----------
    path : Path
    warn : callable
        Called with a sentence where the file holds more than could be read.

    Raises
    ------
    FileError
        If the file is missing, a folder, unreadable or not understood.
    """
    if not path.exists():
        raise FileError(f"{path}: no such file")
    if path.is_dir():
        raise FileError(f"{path}: is a folder; name a mesh file or a MeshLab project")
    if not os.access(path, os.R_OK):
        raise FileError(f"{path}: cannot be read; check its permissions")
    mesh_set = pymeshlab.MeshSet(verbose=False)
    absolute = str(path.resolve())
    try:
        if path.suffix.lower() == PROJECT:
            mesh_set.load_project(absolute)
        else:
            mesh_set.load_new_mesh(absolute)
    except pymeshlab.PyMeshLabException as error:
        raise FileError(f"{path}: {_first_line(error)}") from error
    if not mesh_set.mesh_number():
        raise FileError(f"{path}: holds no mesh")
    declared = _declared_vertices(path)
    read = mesh_set.current_mesh().vertex_number()
    if declared is not None and declared > read:
        warn(
            f"{path}: {declared - read} of {declared} points have no valid coordinates "
            "and were left out by the reader"
        )
    return mesh_set


def choose_layer(mesh_set: Any, layer: str | None) -> None:
    """Make a layer current by its name or number; with None the current one stays."""
    if layer is None:
        return
    labels = {mesh.id(): mesh.label() for mesh in mesh_set}
    for number, label in labels.items():
        if layer in (label, str(number)):
            mesh_set.set_current_mesh(number)
            return
    listed = ", ".join(f"{number} ({label})" for number, label in labels.items())
    raise FileError(f"layer {layer!r}: there is none of that name or number; there are {listed}")


def check_output(path: Path, inputs: list[Path], *, force: bool) -> None:
    """Refuse an output that would overwrite something, or that cannot be written.

    Raises
    ------
    FileError
        If the file exists and `force` is False, if it is a folder, or if its folder is missing.
    """
    if path.is_dir():
        raise FileError(f"{path}: is a folder; name a file")
    if not path.parent.is_dir():
        raise FileError(f"{path.parent}: no such folder; make it first")
    if not os.access(path.parent, os.W_OK):
        raise FileError(f"{path.parent}: cannot be written to; check its permissions")
    if path.exists() and not force:
        same = any(path.samefile(other) for other in inputs if other.exists())
        what = "is the input" if same else "exists already"
        raise FileError(f"{path}: {what}; name another file, or overwrite it with --force")


def save_mesh(mesh_set: Any, path: Path) -> None:
    """Write the current layer; the file, and what belongs to it, appear whole or not at all."""
    with _staging(path) as folder:
        _save_layer(mesh_set, folder / path.name)
        _publish(folder, path)


def save_project(mesh_set: Any, path: Path, *, force: bool) -> None:
    """Write a project and all its meshes beside it, whole or not at all.

    A project holds references to files; each layer becomes a PLY file named after the project and
    the layer, so the folder can be moved.

    Raises
    ------
    FileError
        If one of the files exists and `force` is False, or a mesh cannot be written.
    """
    current = mesh_set.current_mesh_id()
    names = {mesh.id(): _layer_file(path, mesh) for mesh in mesh_set}
    for name in names.values():
        if (path.parent / name).exists() and not force:
            raise FileError(
                f"{path.parent / name}: exists already; name another project, or overwrite it "
                "with --force"
            )
    with _staging(path) as folder:
        for number, name in names.items():
            mesh_set.set_current_mesh(number)
            label = mesh_set.current_mesh().label()
            _save_layer(mesh_set, folder / name)
            mesh_set.current_mesh().set_label(label)
        mesh_set.set_current_mesh(current)
        # An absolute path: with a relative one MeshLab fails without a word.
        mesh_set.save_project(str((folder / path.name).resolve()))
        _publish(folder, path)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with _staging(path) as folder:
        (folder / path.name).write_text(text, encoding="utf-8")
        _publish(folder, path)


def _staging(path: Path) -> _Staging:
    return _Staging(path)


class _Staging:
    """A hidden folder beside an output; it goes away with all that was not published."""

    def __init__(self, path: Path) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._path = path

    def __enter__(self) -> Path:
        try:
            self._folder = tempfile.TemporaryDirectory(prefix=".salient-", dir=self._path.parent)
        except OSError as error:
            raise FileError(f"{self._path}: cannot be written ({error.strerror})") from error
        return Path(self._folder.name)

    def __exit__(self, *_: object) -> None:
        if self._folder is not None:
            self._folder.cleanup()


def _publish(folder: Path, path: Path) -> None:
    """Move what was written into place; the named file last, for it refers to the others."""
    written = sorted(folder.iterdir(), key=lambda file: file.name == path.name)
    if not (folder / path.name).is_file():
        raise FileError(f"{path}: MeshLab wrote nothing; choose another format, such as .ply")
    for file in written:
        os.replace(file, path.parent / file.name)


def _save_layer(mesh_set: Any, path: Path) -> None:
    """Save the current layer with all that the format holds."""
    mesh = mesh_set.current_mesh()
    options: dict[str, Any] = {}
    if path.suffix.lower() in NORMALS and mesh.vertex_normal_matrix().any():
        options["save_vertex_normal"] = True
    if path.suffix.lower() == ".ply" and mesh.vertex_selection_array().any():
        options["save_vertex_flag"] = True
    try:
        mesh_set.save_current_mesh(str(path), **options)
    except pymeshlab.PyMeshLabException as error:
        raise FileError(f"{path.name}: {_first_line(error)}") from error


def _layer_file(project: Path, mesh: Any) -> str:
    """Return the name of a layer's file: project, number and label, without odd characters."""
    label = re.sub(r"[^\w.-]+", "_", Path(mesh.label()).stem) or "layer"
    return f"{project.stem}_{mesh.id()}_{label}.ply"


def _declared_vertices(path: Path) -> int | None:
    """Return how many vertices a PLY file says it holds."""
    if path.suffix.lower() != ".ply":
        return None
    with path.open("rb") as file:
        found = re.search(rb"element\s+vertex\s+(\d+)", file.read(8192))
    return int(found.group(1)) if found else None


def _first_line(error: Exception) -> str:
    """Return MeshLab's message as one line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return ": ".join(lines) or type(error).__name__
