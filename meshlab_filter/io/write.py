# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a layer with its textures, whole or not at all, in a format that needs no MeshLab."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

from ..errors import FileError, Warn, ignore
from . import formats
from .files import check_holds_faces
from .layer import Layer
from .mtl import resolve
from .staging import publish, staging


def write_layer(
    layer: Layer, path: Path, *, source: Path, force: bool = True, warn: Warn = ignore
) -> None:
    """Write a layer.

    Parameters
    ----------
    layer : Layer
    path : Path
    source : Path
        File that the layer was read from; its textures are copied as they are.
    force : bool
        Whether textures may replace existing files.
    warn : callable
        Called with a sentence for each thing that the format cannot hold.

    Raises
    ------
    FileError
        If the format is not known, or a texture exists already.
    OSError
        If the disk is full.
    """
    module = formats.writer(path)
    if module is None:
        raise FileError(f"{path}: no format for this ending; choose one such as .ply")
    if layer.faces is not None:
        check_holds_faces(path)
    said: list[str] = []  # where writing fails, that alone is said
    with staging(path) as folder:
        layer, same = _copy_textures(layer, source, path, folder, said.append)
        try:
            module.write(layer, folder / path.name, said.append)
        except OSError as error:
            raise OSError(f"{path}: not written to the end ({error.strerror})") from error
        publish(folder, path, force=force, preserve=same)
    for message in said:
        warn(message.replace(str(folder / path.name), str(path)))


def _copy_textures(
    layer: Layer, source: Path, path: Path, folder: Path, warn: Warn
) -> tuple[Layer, set[str]]:
    """Copy images into the staging folder; return the layer and the names that need no writing."""
    wanted = layer.textures
    if layer.materials and path.suffix.lower() == ".ply":  # which knows one image a material
        wanted = tuple(dict.fromkeys(m.texture for m in layer.materials if m.texture))
    names, same = {}, set()
    for name in wanted:
        outside = Path(name).is_absolute() or ".." in re.split(r"[\\/]", name)
        target = re.split(r"[\\/]", name)[-1] if outside else name.replace("\\", "/")
        names[name] = target
        image = None if name in layer.images else resolve(name, [source.parent])
        if image is None and name not in layer.images:
            warn(f"{path}: its texture {name} is missing beside {source}; the name is kept")
            continue
        data = layer.images[name] if image is None else image.read_bytes()
        there = path.parent / target
        if there.is_file() and there.read_bytes() == data:
            same.add(Path(target).as_posix())
            continue
        (folder / target).parent.mkdir(parents=True, exist_ok=True)
        (folder / target).write_bytes(data)
    materials = tuple(
        m._replace(texture=names.get(m.texture, m.texture)) if m.texture else m
        for m in layer.materials
    )
    return dataclasses.replace(layer, textures=tuple(names.values()), materials=materials), same
