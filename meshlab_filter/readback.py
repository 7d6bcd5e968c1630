# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a mesh is in the file that was just written, seen by reading it again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import meshlab
from .errors import FileError

WHOLE = {".ply"}
"""Formats that hold all that MeshLab keeps, and whose writer reports a full disk."""
ROUNDING = 1e-6
"""Share of the bounding box's diagonal up to which rounding by a format goes unmentioned."""


def check_written(
    mesh: Any, written: Path, path: Path, *, like: Any, warn: Callable[[str], None]
) -> None:
    """Read a file back, and tell what the format lost or rounded.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
        What was to be written.
    written, path : Path
        Where it is, and the name that the user knows.
    like : pymeshlab.Mesh
        What this mesh does not have is not missed.
    warn : callable

    Raises
    ------
    FileError
        If points or faces are missing, or nothing can be read.
    """
    ending = path.suffix.lower()
    if ending in WHOLE or not written.is_file():
        return
    try:
        mesh_set = meshlab.load(written)  # its mesh lives no longer
    except meshlab.UnknownFormatError:
        warn(f"{path}: MeshLab cannot read {ending} files, so what is in it was not checked")
        return
    except FileError as error:
        raise FileError(
            f"{path}: MeshLab cannot read back what it wrote; the disk may be full, or else choose "
            "another format, such as .ply"
        ) from error
    again = mesh_set.current_mesh()
    again.compact()
    mesh.compact()
    points, found = mesh.vertex_matrix(), again.vertex_matrix()
    if again.face_number() != mesh.face_number() or (
        not mesh.face_number() and len(found) != len(points)
    ):
        raise FileError(
            f"{path}: {len(points)} points and {mesh.face_number()} faces became {len(found)} and "
            f"{again.face_number()} in this format; choose another, such as .ply"
        )
    if len(found) < len(points):
        warn(f"{path}: the format dropped {len(points) - len(found)} points that no face uses")
    lost = _lost(mesh, again, like)
    if lost:
        warn(f"{path}: {ending} files do not keep the {', '.join(lost)}; .ply does")
    _check_rounding(points, found, path, warn)


def _check_rounding(
    points: NDArray[Any], found: NDArray[Any], path: Path, warn: Callable[[str], None]
) -> None:
    box = np.array([points.min(axis=0), points.max(axis=0)])
    moved = np.abs([found.min(axis=0), found.max(axis=0)] - box)
    if len(found) == len(points):
        moved = np.abs(found - points)
    if moved.max() > ROUNDING * np.linalg.norm(box[1] - box[0]):
        warn(
            f"{path}: the format rounds coordinates, here by up to {moved.max():.2g}; .ply does not"
        )


def _lost(mesh: Any, again: Any, like: Any) -> list[str]:
    """Return what `mesh` and `like` have and the file does not give back."""
    # Colours may come back with five bits each, as STL has them.
    parts: dict[str, tuple[str, str, float]] = {
        "colours": ("has_vertex_color", "vertex_color_matrix", 0.04),
        "quality": ("has_vertex_scalar", "vertex_scalar_array", 1e-5),
        "colours of faces": ("has_face_color", "face_color_matrix", 0.04),
        "quality of faces": ("has_face_scalar", "face_scalar_array", 1e-5),
        "texture coordinates": ("has_wedge_tex_coord", "wedge_tex_coord_matrix", 1e-4),
        "texture coordinates of points": ("has_vertex_tex_coord", "vertex_tex_coord_matrix", 1e-4),
        "textures": ("texture_number", "", 0.0),
        "selection": ("selected_vertex_number", "vertex_selection_array", 0.0),
    }  # fmt: skip
    lost = [
        name
        for name, (has, values, near) in parts.items()
        if getattr(mesh, has)()
        and getattr(like, has)()
        and not (getattr(again, has)() and (not values or _same(mesh, again, values, near)))
    ]
    normals = mesh.vertex_normal_matrix()
    # Those of a mesh follow from its faces.
    if not mesh.face_number() and normals.any() and not _near(normals, again, 0.01):
        lost.append("normals")
    return lost


def _same(mesh: Any, again: Any, values: str, near: float) -> bool:
    """Whether values are the same; where the format exchanged points, they are not compared."""
    before, after = getattr(mesh, values)(), getattr(again, values)()
    if before.shape != after.shape:
        return True
    scale = max(float(np.abs(before).max(initial=0.0)), 1e-300)
    return bool(np.abs(before.astype(float) - after).max(initial=0.0) <= near * scale)


def _near(normals: NDArray[Any], again: Any, near: float) -> bool:
    found = again.vertex_normal_matrix()
    return found.shape == normals.shape and bool(np.abs(found - normals).max() <= near)
