# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers as mesh files, with all that their format holds."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from . import bridge, meshlab
from .errors import FileError
from .files import Warn, silent
from .headers import home
from .readback import check_written
from .staging import publish, staging

NORMALS = {".ply", ".obj", ".off", ".xyz", ".e57"}
"""Formats whose writers take `save_vertex_normal`."""
OPTIONAL = {
    "has_vertex_color": ("save_vertex_color", {".ply", ".obj", ".off", ".wrl", ".dae", ".e57"}),
    "has_vertex_scalar": ("save_vertex_quality", {".ply", ".e57", ".ctm"}),
    "has_face_color": ("save_face_color", {".ply", ".obj", ".off", ".stl"}),
    "has_face_scalar": ("save_face_quality", {".ply"}),
}
"""Components that can be left out of a file: the option that does, and the formats that take it."""
WITHOUT_TEXTURES = {".stl", ".off", ".xyz", ".e57", ".ctm", ".dxf"}
"""Formats that refer to no textures, which MeshLab would nevertheless write beside them."""


def save_mesh(
    mesh_set: Any,
    path: Path,
    *,
    force: bool = True,
    like: Any = None,
    source: Path | None = None,
    warn: Warn = silent,
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
    OSError
        If the disk is full.
    """
    mesh = mesh_set.current_mesh()
    with staging(path) as folder:
        save_layer(mesh_set, folder / path.name, path, like)
        check_written(mesh, folder / path.name, path, like=like or mesh, warn=warn)
        number = mesh.id() if like is None else like.id()
        at_home = source is not None and path.parent.samefile(home(source, number))
        publish(folder, path, force=force, kept=texture_names(mesh) if at_home else set())


def save_layer(mesh_set: Any, path: Path, known: Path, like: Any = None) -> None:
    """Save the current layer with all that the format holds, and no more than `like` has."""
    ending = path.suffix.lower()
    _keep_textures_inside(mesh_set, known)
    mesh = mesh_set.current_mesh()
    options: dict[str, Any] = {}
    for component, (option, formats) in OPTIONAL.items():
        if like is not None and ending in formats and not getattr(like, component)():
            options[option] = False
    # MeshLab writes colours before normals into OFF files and reads them the other way round.
    mixed = ending == ".off" and (like or mesh).has_vertex_color()
    if ending in NORMALS and (mixed or mesh.vertex_normal_matrix().any()):
        options["save_vertex_normal"] = not mixed
    if ending == ".ply" and mesh.vertex_selection_array().any():
        options["save_vertex_flag"] = True
    if ending in WITHOUT_TEXTURES:
        options["save_textures"] = False
    meshlab.save(mesh_set, path, known, **options)


def texture_names(mesh: Any) -> set[str]:
    """Return the names of a mesh's textures, as paths from its own folder."""
    return {Path(name).as_posix() for name in mesh.textures()}


def _keep_textures_inside(mesh_set: Any, known: Path) -> None:
    """Let no texture be written outside the output's folder, where its name may point."""
    textures = mesh_set.current_mesh().textures()
    outside = [name for name in textures if os.path.isabs(name) or ".." in re.split(r"[\\/]", name)]
    if outside and len(textures) == 1:
        bridge.set_texture(mesh_set, outside[0], textures[outside[0]])
    elif outside:
        raise FileError(
            f"{known}: the mesh has several textures, and {outside[0]} is outside its folder; "
            "put them beside the mesh"
        )
