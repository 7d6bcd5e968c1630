# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a MeshLab project with all its layers as files beside it, whole or not at all."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ..errors import FileError
from . import pymeshlab_io
from .headers import layer_folder
from .save import save_layer, texture_names
from .staging import publish, staging


def save_project(
    mesh_set: Any,
    path: Path,
    *,
    force: bool,
    reference: Any = None,
    source: Path | None = None,
) -> None:
    """Write a project and all its layers beside it, whole or not at all.

    Each layer becomes a PLY file named after the project and the layer, to which the project
    refers by its name, so the folder can be moved. Different textures with the same name are
    renamed. Raster layers refer to their pictures where these are.

    Parameters
    ----------
    mesh_set, path, force, reference, source
        As for `save_mesh`; `reference` is that of the current layer.

    Raises
    ------
    FileError
        If one of the files exists and `force` is False, or a mesh cannot be written.
    OSError
        If the disk is full.
    """
    current = mesh_set.current_mesh_id()
    names = {mesh.id(): _layer_file(path, mesh) for mesh in mesh_set}
    for name in names.values():
        if (path.parent / name).exists() and not force:
            raise FileError(
                f"{path.parent / name}: exists already; name another project, or overwrite it "
                "with --force"
            )
    origin = current if reference is None else reference.id()
    in_place = _textures_in_place(mesh_set, path, origin, source)
    shared_textures = set().union(*in_place.values())
    with staging(path) as folder:
        for number, name in names.items():
            scratch = folder / f"layer {number}"
            scratch.mkdir()
            with _current_layer(mesh_set, number):
                only = reference if number == current else None
                save_layer(mesh_set, scratch / name, path.parent / name, only)
            taken = shared_textures - in_place[number]
            _gather(scratch, folder, name, f"{path.stem}_{number}_", taken)
        # Shown together, the source flickers through the layer that was made from it.
        hidden = None if origin == current else origin
        _write_project(mesh_set, folder / path.name, path, names, hidden)
        publish(folder, path, force=force, preserve=shared_textures)


@contextmanager
def _current_layer(mesh_set: Any, number: int) -> Iterator[None]:
    """Make a layer current for the block, and restore its label, which saving changes."""
    before = mesh_set.current_mesh_id()
    mesh_set.set_current_mesh(number)
    label = mesh_set.current_mesh().label()
    try:
        yield
    finally:
        mesh_set.current_mesh().set_label(label)
        mesh_set.set_current_mesh(before)


def _textures_in_place(
    mesh_set: Any, path: Path, origin: int, source: Path | None
) -> dict[int, set[str]]:
    """Return for every layer those of its textures that are already in the output's folder.

    The current layer may be new; it has the textures of layer `origin`, from which it was made.
    """
    result: dict[int, set[str]] = {}
    for mesh in mesh_set:
        number = origin if mesh.id() == mesh_set.current_mesh_id() else mesh.id()
        beside = source is not None and path.parent.samefile(layer_folder(source, number))
        names = texture_names(mesh) if beside else set()
        result[mesh.id()] = {name for name in names if (path.parent / name).exists()}
    return result


def _gather(scratch: Path, folder: Path, name: str, prefix: str, taken: Collection[str]) -> None:
    """Move a layer's file and textures from `scratch` to `folder`; rename textures that clash."""
    renamed = {}
    for file in sorted(f for f in scratch.rglob("*") if f.is_file() and f.name != name):
        texture = file.relative_to(scratch)
        other = folder / texture
        differs = other.exists() and other.read_bytes() != file.read_bytes()
        if differs or texture.as_posix() in taken:
            other = other.with_name(prefix + other.name)
            renamed[texture.as_posix()] = other.relative_to(folder).as_posix()
        other.parent.mkdir(parents=True, exist_ok=True)
        os.replace(file, other)
    layer = scratch / name
    if renamed:
        header, end, data = layer.read_bytes().partition(b"end_header")
        for before, after in renamed.items():
            comment = b"comment TextureFile "
            header = header.replace(
                comment + os.fsencode(before) + b"\n", comment + os.fsencode(after) + b"\n"
            )
        layer.write_bytes(header + end + data)
    os.replace(layer, folder / name)
    shutil.rmtree(scratch)


def _write_project(
    mesh_set: Any, project: Path, shown_as: Path, names: dict[int, str], hidden: int | None
) -> None:
    """Write the project itself, which refers to the layers' files by `names`."""
    invisible = {mesh.id() for mesh in mesh_set if not mesh.is_visible()} | {hidden}
    _show_all(mesh_set)  # for MeshLab saves no others
    pymeshlab_io.save_project(mesh_set, project, shown_as)
    # MeshLab does not escape labels, and XML allows no control characters.
    text = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", "?", project.read_text(encoding="utf-8"))
    tree = ElementTree.fromstring(text)
    for element, mesh in zip(tree.iter("MLMesh"), mesh_set, strict=True):
        element.set("filename", names[mesh.id()])
        if mesh.id() in invisible:
            element.set("visible", "0")
        # MeshLab writes six digits, too few for map coordinates.
        matrix = element.find("MLMatrix44")
        if matrix is not None:
            rows = [" ".join(f"{value:.17g}" for value in row) for row in mesh.transform_matrix()]
            matrix.text = "\n" + " \n".join(rows) + " \n"
    for plane in tree.iter("Plane"):
        picture = (project.parent.resolve() / plane.get("fileName", "")).resolve()
        plane.set("fileName", Path(os.path.relpath(picture, shown_as.parent.resolve())).as_posix())
    text = ElementTree.tostring(tree, encoding="unicode")
    project.write_text(f"<!DOCTYPE MeshLabDocument>\n{text}\n", encoding="utf-8")


def _show_all(mesh_set: Any) -> None:
    """Make all layers visible."""
    current = mesh_set.current_mesh_id()
    for number in [mesh.id() for mesh in mesh_set]:
        mesh_set.set_current_mesh(number)
        mesh_set.set_current_mesh_visibility(True)
    mesh_set.set_current_mesh(current)


def _layer_file(project: Path, mesh: Any) -> str:
    """Return the name of a layer's file: project, number and label, without special characters."""
    name = re.sub(r"[\x00-\x1f]", "_", project.stem)
    label = re.sub(r"[^\w.-]+", "_", Path(mesh.label()).stem)[:60] or "layer"
    return f"{name}_{mesh.id()}_{label}.ply"
