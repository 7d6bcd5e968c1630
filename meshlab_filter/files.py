# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files and MeshLab projects: read with clear errors, written whole or not at all."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pymeshlab

import salcore

PROJECT = ".mlp"
NORMALS = {".ply", ".obj", ".off", ".xyz", ".e57"}
"""Formats whose writers take `save_vertex_normal`."""
OPTIONAL = {
    "has_vertex_color": ("save_vertex_color", {".ply", ".obj", ".off", ".wrl", ".dae", ".e57"}),
    "has_vertex_scalar": ("save_vertex_quality", {".ply", ".e57", ".ctm"}),
    "has_face_color": ("save_face_color", {".ply", ".obj", ".off", ".stl"}),
    "has_face_scalar": ("save_face_quality", {".ply"}),
}
"""Components that can be left out of a file: the option that does, and the formats that take it."""
EXACT = {".ply", ".obj", ".off", ".xyz"}
"""Formats that hold points without faces, and coordinates to nearly all digits."""
ROUNDING = 1e-6
"""Share of the bounding box's diagonal up to which rounding by a format goes unmentioned."""

Warn = Callable[[str], None]


class FileError(salcore.SalcoreError):
    """A file that cannot be read or written."""


def _silent(message: str) -> None:
    """Take a warning and say nothing."""


def load(path: Path, warn: Warn = _silent) -> Any:
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


def choose_layer(mesh_set: Any, layer: str | None, warn: Warn = _silent) -> None:
    """Make a layer current by its name or number; with None the current one stays."""
    labels = {mesh.id(): mesh.label() for mesh in mesh_set}
    if layer is None:
        if len(labels) > 1:
            number = mesh_set.current_mesh_id()
            warn(
                f"the file has {len(labels)} layers; this is about number {number} "
                f"({labels[number]}), choose another with --layer"
            )
        return
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


def check_format(path: Path) -> None:
    """Refuse an output in a format that MeshLab does not write, before any work is done."""
    ending = path.suffix.lower()
    if ending == PROJECT:
        return
    mesh_set = pymeshlab.MeshSet(verbose=False)
    mesh_set.add_mesh(pymeshlab.Mesh(np.zeros((1, 3))))
    try:
        mesh_set.filter_parameter_values(ending.removeprefix("."))
    except pymeshlab.PyMeshLabException as error:
        what = f"MeshLab does not write {ending} files" if ending else "the name has no ending"
        raise FileError(f"{path}: {what}; choose a format such as .ply or .obj") from error


def save_mesh(
    mesh_set: Any,
    path: Path,
    *,
    force: bool = True,
    like: Any = None,
    source: Path | None = None,
    warn: Warn = _silent,
) -> None:
    """Write the current layer; the file, and what belongs to it, appear whole or not at all.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    path : Path
    force : bool
        Whether files that go along, as textures and materials, may replace others.
    like : pymeshlab.Mesh, optional
        Colour and quality that this mesh does not have are left out: a mesh made from arrays has
        both, white and zero.
    source : Path, optional
        File the mesh came from. Textures beside it are its own and stay as they are.
    warn : callable
        Called with a sentence where the format holds less than was written.

    Raises
    ------
    FileError
        If the format cannot hold the mesh, or a file that goes along exists already.
    """
    with _Staging(path) as folder:
        _save_layer(mesh_set, folder / path.name, like)
        _check_written(mesh_set.current_mesh(), folder / path.name, path, warn)
        _publish(folder, path, force=force, kept=_textures(mesh_set, path, source))


def save_project(
    mesh_set: Any,
    path: Path,
    *,
    force: bool,
    like: Any = None,
    source: Path | None = None,
) -> None:
    """Write a project and all its meshes beside it, whole or not at all.

    A project holds references to files; each layer becomes a PLY file named after the project and
    the layer, so the folder can be moved. Raster layers refer to the pictures where they are.

    Parameters
    ----------
    mesh_set, path, force, like, source
        As for `save_mesh`; `like` speaks of the current layer.

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
    with _Staging(path) as folder:
        kept: set[str] = set()
        for number, name in names.items():
            mesh_set.set_current_mesh(number)
            label = mesh_set.current_mesh().label()
            _save_layer(mesh_set, folder / name, like if number == current else None)
            mesh_set.current_mesh().set_label(label)
            kept |= _textures(mesh_set, path, source)
        mesh_set.set_current_mesh(current)
        # An absolute path: with a relative one MeshLab fails without a word.
        mesh_set.save_project(str((folder / path.name).resolve()))
        if (folder / path.name).is_file():
            _mend_project(mesh_set, folder / path.name, path.parent)
        _publish(folder, path, force=force, kept=kept)


def write(path: Path, writer: Callable[[Path], object]) -> None:
    """Let `writer` write a file of the same name elsewhere, then move it into place."""
    with _Staging(path) as folder:
        writer(folder / path.name)
        _publish(folder, path, force=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    write(path, lambda staged: staged.write_text(text, encoding="utf-8"))


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


def _textures(mesh_set: Any, path: Path, source: Path | None) -> set[str]:
    """Return the current layer's textures if they lie where the output goes."""
    if source is None or not path.parent.samefile(source.parent):
        return set()
    return {Path(name).as_posix() for name in mesh_set.current_mesh().textures()}


def _publish(folder: Path, path: Path, *, force: bool, kept: set[str] | None = None) -> None:
    """Move what was written into place; the named file last, for it refers to the others.

    Files named in `kept` stay as they are where they exist already.
    """
    if not (folder / path.name).is_file():
        raise FileError(f"{path}: MeshLab wrote nothing; choose another format, such as .ply")
    written = {f.relative_to(folder): f for f in folder.rglob("*") if f.is_file()}
    moves = {
        path.parent / name: file
        for name, file in written.items()
        if name.as_posix() not in (kept or ()) or not (path.parent / name).exists()
    }
    # The output itself was checked before the work was done.
    taken = [target for target in moves if target.exists() and target.name != path.name]
    if taken and not force:
        raise FileError(
            f"{taken[0]}: exists already and goes along with {path.name}; name another folder, "
            "or overwrite it with --force"
        )
    for target in sorted(moves, key=lambda target: target.name == path.name):
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(moves[target], target)


def _save_layer(mesh_set: Any, path: Path, like: Any = None) -> None:
    """Save the current layer with all that the format holds, and no more than `like` has."""
    mesh, ending = mesh_set.current_mesh(), path.suffix.lower()
    options: dict[str, Any] = {}
    if ending in NORMALS and mesh.vertex_normal_matrix().any():
        options["save_vertex_normal"] = True
    if ending == ".ply" and mesh.vertex_selection_array().any():
        options["save_vertex_flag"] = True
    for component, (option, formats) in OPTIONAL.items():
        if like is not None and ending in formats and not getattr(like, component)():
            options[option] = False
    try:
        mesh_set.save_current_mesh(str(path), **options)
    except pymeshlab.PyMeshLabException as error:
        text = _first_line(error).replace(str(path.resolve()), "").replace(str(path), "")
        raise FileError(f"{path.name}: {text}; choose another format, such as .ply") from error


def _check_written(mesh: Any, written: Path, path: Path, warn: Warn) -> None:
    """Read a file back: some formats drop points that no face uses, or round coordinates.

    Formats that MeshLab writes and cannot read go unchecked.
    """
    if path.suffix.lower() in EXACT or not written.is_file():
        return
    again = pymeshlab.MeshSet(verbose=False)
    try:
        again.load_new_mesh(str(written.resolve()))
    except pymeshlab.PyMeshLabException as error:
        if "Unknown format" in str(error):
            return
        raise FileError(
            f"{path}: MeshLab cannot read back what it wrote; choose another format, such as .ply"
        ) from error
    points, found = mesh.vertex_matrix(), again.current_mesh().vertex_matrix()
    if again.current_mesh().face_number() != mesh.face_number() or (
        not mesh.face_number() and len(found) != len(points)
    ):
        raise FileError(
            f"{path}: {len(points)} points and {mesh.face_number()} faces became {len(found)} and "
            f"{again.current_mesh().face_number()} in this format; choose another, such as .ply"
        )
    if len(found) < len(points):
        warn(f"{path}: the format dropped {len(points) - len(found)} points that no face uses")
    box = np.array([points.min(axis=0), points.max(axis=0)])
    moved = np.abs([found.min(axis=0), found.max(axis=0)] - box)
    if len(found) == len(points):
        moved = np.abs(found - points)
    if moved.max() > ROUNDING * np.linalg.norm(box[1] - box[0]):
        warn(
            f"{path}: the format rounds coordinates, here by up to {moved.max():.2g}; .ply does not"
        )


def _mend_project(mesh_set: Any, project: Path, home: Path) -> None:
    """Give a project its matrices to all digits, and references that hold in its own folder.

    MeshLab writes six digits, too few for a scan in map coordinates.
    """
    tree = ElementTree.parse(project)
    for element, mesh in zip(tree.iter("MLMesh"), mesh_set, strict=True):
        matrix = element.find("MLMatrix44")
        if matrix is not None:
            rows = [" ".join(f"{value:.17g}" for value in row) for row in mesh.transform_matrix()]
            matrix.text = "\n" + " \n".join(rows) + " \n"
    for plane in tree.iter("Plane"):
        picture = (project.parent.resolve() / plane.get("fileName", "")).resolve()
        plane.set("fileName", Path(os.path.relpath(picture, home.resolve())).as_posix())
    text = ElementTree.tostring(tree.getroot(), encoding="unicode")
    project.write_text(f"<!DOCTYPE MeshLabDocument>\n{text}\n", encoding="utf-8")


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
