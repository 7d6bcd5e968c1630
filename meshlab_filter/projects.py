# SPDX-License-Identifier: GPL-3.0-or-later
"""MeshLab projects: all layers as files beside the project, whole or not at all."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from . import meshlab
from .errors import FileError
from .headers import home
from .saving import save_layer, texture_names
from .staging import publish, staging


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
    the layer, so the folder can be moved. Different textures of one name get different ones.
    Raster layers refer to the pictures where they are.

    Parameters
    ----------
    mesh_set, path, force, like, source
        As for `save_mesh`; `like` speaks of the current layer.

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
    kept = _textures_at_home(mesh_set, path, current if like is None else like.id(), source)
    everybodys = set().union(*kept.values())
    with staging(path) as folder:
        for number, name in names.items():
            apart = folder / f"layer {number}"
            apart.mkdir()
            only = like if number == current else None
            with _current(mesh_set, number):
                save_layer(mesh_set, apart / name, path.parent / name, only)
            taken = everybodys - kept[number]
            _gather(apart, folder, name, f"{path.stem}_{number}_", taken)
        _write_project(mesh_set, folder / path.name, path, names)
        publish(folder, path, force=force, kept=everybodys)


@contextmanager
def _current(mesh_set: Any, number: int) -> Iterator[None]:
    """Make a layer current for a while, and keep its label, which saving changes."""
    before = mesh_set.current_mesh_id()
    mesh_set.set_current_mesh(number)
    label = mesh_set.current_mesh().label()
    try:
        yield
    finally:
        mesh_set.current_mesh().set_label(label)
        mesh_set.set_current_mesh(before)


def _textures_at_home(
    mesh_set: Any, path: Path, origin: int, source: Path | None
) -> dict[int, set[str]]:
    """Return for every layer the textures that lie already where the project goes.

    The current layer may be new, made from the layer `origin`.
    """
    result: dict[int, set[str]] = {}
    for mesh in mesh_set:
        number = origin if mesh.id() == mesh_set.current_mesh_id() else mesh.id()
        at_home = source is not None and path.parent.samefile(home(source, number))
        names = texture_names(mesh) if at_home else set()
        result[mesh.id()] = {name for name in names if (path.parent / name).exists()}
    return result


def _gather(apart: Path, folder: Path, name: str, prefix: str, taken: Collection[str]) -> None:
    """Move a layer's file and its textures to the others, with names that are not yet taken."""
    renamed = {}
    for file in sorted(f for f in apart.rglob("*") if f.is_file() and f.name != name):
        texture = file.relative_to(apart)
        other = folder / texture
        differs = other.exists() and other.read_bytes() != file.read_bytes()
        if differs or texture.as_posix() in taken:
            other = other.with_name(prefix + other.name)
            renamed[texture.as_posix()] = other.relative_to(folder).as_posix()
        other.parent.mkdir(parents=True, exist_ok=True)
        os.replace(file, other)
    layer = apart / name
    if renamed:
        header, end, data = layer.read_bytes().partition(b"end_header")
        for before, after in renamed.items():
            comment = b"comment TextureFile "
            header = header.replace(
                comment + os.fsencode(before) + b"\n", comment + os.fsencode(after) + b"\n"
            )
        layer.write_bytes(header + end + data)
    os.replace(layer, folder / name)
    shutil.rmtree(apart)


def _write_project(mesh_set: Any, project: Path, known: Path, names: dict[int, str]) -> None:
    """Write the project itself, which refers to the files of these names."""
    meshlab.save_project(mesh_set, project, known)
    # MeshLab writes labels as they are; control characters have no place in XML.
    text = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f]", "?", project.read_text(encoding="utf-8"))
    tree = ElementTree.fromstring(text)
    for element, mesh in zip(tree.iter("MLMesh"), mesh_set, strict=True):
        element.set("filename", names[mesh.id()])
        # MeshLab writes six digits, too few for a scan in map coordinates.
        matrix = element.find("MLMatrix44")
        if matrix is not None:
            rows = [" ".join(f"{value:.17g}" for value in row) for row in mesh.transform_matrix()]
            matrix.text = "\n" + " \n".join(rows) + " \n"
    for plane in tree.iter("Plane"):
        picture = (project.parent.resolve() / plane.get("fileName", "")).resolve()
        plane.set("fileName", Path(os.path.relpath(picture, known.parent.resolve())).as_posix())
    text = ElementTree.tostring(tree, encoding="unicode")
    project.write_text(f"<!DOCTYPE MeshLabDocument>\n{text}\n", encoding="utf-8")


def _layer_file(project: Path, mesh: Any) -> str:
    """Return the name of a layer's file: project, number and label, without odd characters."""
    name = re.sub(r"[\x00-\x1f]", "_", project.stem)
    label = re.sub(r"[^\w.-]+", "_", Path(mesh.label()).stem)[:60] or "layer"
    return f"{name}_{mesh.id()}_{label}.ply"
