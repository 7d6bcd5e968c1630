# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a layer as a mesh file, with all that its format can hold."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from .. import bridge
from ..errors import FileError, Warn, ignore
from . import pymeshlab_io
from .headers import layer_folder
from .staging import publish, staging
from .verify import check_written

NORMALS = {".ply", ".obj", ".off", ".xyz", ".e57"}
"""Formats whose writers take `save_vertex_normal`."""
OPTIONAL = {
    "has_vertex_color": ("save_vertex_color", {".ply", ".obj", ".off", ".wrl", ".dae", ".e57"}),
    "has_vertex_scalar": ("save_vertex_quality", {".ply", ".e57", ".ctm"}),
    "has_face_color": ("save_face_color", {".ply", ".obj", ".off", ".stl"}),
    "has_face_scalar": ("save_face_quality", {".ply"}),
}
"""Components that a writer can leave out: its option, and the formats whose writers have it."""
WITHOUT_TEXTURES = {".stl", ".off", ".xyz", ".e57", ".ctm", ".dxf"}
"""Formats without textures, beside which MeshLab would write them nevertheless."""


def save_mesh(
    mesh_set: Any,
    path: Path,
    *,
    force: bool = True,
    reference: Any = None,
    source: Path | None = None,
    warn: Warn = ignore,
) -> None:
    """Write the current layer, with its materials and textures, whole or not at all.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    path : Path
    force : bool
        Whether materials and textures may replace existing files.
    reference : pymeshlab.Mesh, optional
        Colour and quality that this mesh does not have are left out: a mesh made from arrays
        always has both, white and zero.
    source : Path, optional
        File that the mesh was read from. Textures beside it are not written again.
    warn : callable
        Called with a sentence if the format lost something.

    Raises
    ------
    FileError
        If the format cannot hold the mesh, or a material or texture exists already.
    OSError
        If the disk is full.
    """
    mesh = mesh_set.current_mesh()
    with staging(path) as folder:
        save_layer(mesh_set, folder / path.name, path, reference)
        check_written(mesh, folder / path.name, path, reference=reference or mesh, warn=warn)
        number = mesh.id() if reference is None else reference.id()
        beside = source is not None and path.parent.samefile(layer_folder(source, number))
        publish(folder, path, force=force, preserve=texture_names(mesh) if beside else set())


def save_layer(mesh_set: Any, path: Path, shown_as: Path, reference: Any = None) -> None:
    """Save the current layer with all that the format holds and `reference` has.

    Messages name the file `shown_as` instead of `path`.
    """
    ending = path.suffix.lower()
    _keep_textures_inside(mesh_set, shown_as)
    mesh = mesh_set.current_mesh()
    options: dict[str, Any] = {}
    for component, (option, formats) in OPTIONAL.items():
        if reference is not None and ending in formats and not getattr(reference, component)():
            options[option] = False
    # MeshLab writes colours before normals into OFF files and reads them in the other order.
    confused = ending == ".off" and (reference or mesh).has_vertex_color()
    if ending in NORMALS and (confused or mesh.vertex_normal_matrix().any()):
        options["save_vertex_normal"] = not confused
    if ending == ".ply" and mesh.vertex_selection_array().any():
        options["save_vertex_flag"] = True
    if ending in WITHOUT_TEXTURES:
        options["save_textures"] = False
    pymeshlab_io.save(mesh_set, path, shown_as, **options)


def texture_names(mesh: Any) -> set[str]:
    """Return the names of a mesh's textures, as paths relative to its folder."""
    return {Path(name).as_posix() for name in mesh.textures()}


def _keep_textures_inside(mesh_set: Any, shown_as: Path) -> None:
    """Rename a texture whose path would have it written outside the output's folder."""
    textures = mesh_set.current_mesh().textures()
    outside = [name for name in textures if os.path.isabs(name) or ".." in re.split(r"[\\/]", name)]
    if outside and len(textures) == 1:
        bridge.set_texture(mesh_set, outside[0], textures[outside[0]])
    elif outside:
        raise FileError(
            f"{shown_as}: the mesh has several textures, and {outside[0]} is outside its folder; "
            "put them beside the mesh"
        )
