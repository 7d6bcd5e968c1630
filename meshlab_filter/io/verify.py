# SPDX-License-Identifier: GPL-3.0-or-later
"""Read a file back after writing it, and report what its format lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn
from . import pymeshlab_io

LOSSLESS = {".ply"}
"""Formats that hold all that MeshLab does, and whose writers report a full disk."""
ROUNDING = 1e-6
"""Share of the bounding box's diagonal up to which a format may round in silence."""
_ATTRIBUTES = {
    "colours": ("has_vertex_color", "vertex_color_matrix", 0.04),
    "quality": ("has_vertex_scalar", "vertex_scalar_array", 1e-5),
    "colours of faces": ("has_face_color", "face_color_matrix", 0.04),
    "quality of faces": ("has_face_scalar", "face_scalar_array", 1e-5),
    "texture coordinates": ("has_wedge_tex_coord", "wedge_tex_coord_matrix", 1e-4),
    "texture coordinates of points": ("has_vertex_tex_coord", "vertex_tex_coord_matrix", 1e-4),
    "textures": ("texture_number", "", 0.0),
    "selection": ("selected_vertex_number", "vertex_selection_array", 0.0),
}  # fmt: skip
"""For each attribute the methods of a mesh that tell whether it is there and what its values are,
and the share of the largest value by which a format may change it: STL stores five bits per colour.
"""


def check_written(mesh: Any, written: Path, path: Path, *, reference: Any, warn: Warn) -> None:
    """Read a file back, and warn of what the format lost or rounded.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
        The mesh that was written.
    written, path : Path
        The file, and the path that messages name.
    reference : pymeshlab.Mesh
        Attributes that this mesh does not have are not missed.
    warn : callable
        Called with a sentence for each loss.

    Raises
    ------
    FileError
        If points or faces are missing, or nothing can be read.
    """
    ending = path.suffix.lower()
    if ending in LOSSLESS or not written.is_file():
        return
    try:
        mesh_set = pymeshlab_io.load(written)  # the set owns its mesh
    except pymeshlab_io.UnknownFormatError:
        warn(f"{path}: MeshLab cannot read {ending} files, so what is in it was not checked")
        return
    except FileError as error:
        raise FileError(
            f"{path}: MeshLab cannot read back what it wrote; the disk may be full, or else choose "
            "another format, such as .ply"
        ) from error
    reread = mesh_set.current_mesh()
    reread.compact()
    mesh.compact()
    points, found = mesh.vertex_matrix(), reread.vertex_matrix()
    if reread.face_number() != mesh.face_number() or (
        not mesh.face_number() and len(found) != len(points)
    ):
        raise FileError(
            f"{path}: {len(points)} points and {mesh.face_number()} faces became {len(found)} and "
            f"{reread.face_number()} in this format; choose another, such as .ply"
        )
    if len(found) < len(points):
        warn(f"{path}: the format dropped {len(points) - len(found)} points that no face uses")
    lost = _lost(mesh, reread, reference)
    if lost:
        warn(f"{path}: {ending} files do not keep the {', '.join(lost)}; .ply does")
    _check_rounding(points, found, path, warn)


def _check_rounding(points: NDArray[Any], found: NDArray[Any], path: Path, warn: Warn) -> None:
    """Warn if coordinates changed; if the format dropped points, compare the bounding boxes."""
    box = np.array([points.min(axis=0), points.max(axis=0)])
    if len(found) == len(points):
        moved = np.abs(found - points)
    else:
        moved = np.abs([found.min(axis=0), found.max(axis=0)] - box)
    if moved.max() > ROUNDING * np.linalg.norm(box[1] - box[0]):
        warn(
            f"{path}: the format rounds coordinates, here by up to {moved.max():.2g}; .ply does not"
        )


def _lost(mesh: Any, reread: Any, reference: Any) -> list[str]:
    """Return the attributes that `mesh` and `reference` have and `reread` lacks or changed."""
    lost = []
    for name, (has, values, tolerance) in _ATTRIBUTES.items():
        expected = getattr(mesh, has)() and getattr(reference, has)()
        if expected and not (
            getattr(reread, has)()
            and (not values or _values_agree(mesh, reread, values, tolerance))
        ):
            lost.append(name)
    normals, found = mesh.vertex_normal_matrix(), reread.vertex_normal_matrix()
    # The reader computes those of a mesh from its faces.
    if not mesh.face_number() and normals.any() and not _normals_agree(normals, found):
        lost.append("normals")
    return lost


def _values_agree(mesh: Any, reread: Any, values: str, tolerance: float) -> bool:
    """Return whether values agree; if the format changed their number, they are not compared."""
    before, after = getattr(mesh, values)(), getattr(reread, values)()
    if before.shape != after.shape:
        return True
    scale = max(float(np.abs(before).max(initial=0.0)), 1e-300)
    return bool(np.abs(before.astype(float) - after).max(initial=0.0) <= tolerance * scale)


def _normals_agree(before: NDArray[Any], after: NDArray[Any]) -> bool:
    return before.shape == after.shape and bool(np.abs(after - before).max() <= 0.01)
