# SPDX-License-Identifier: GPL-3.0-or-later
"""Data between a MeshLab layer and arrays; nothing is decided here."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pymeshlab
from numpy.typing import NDArray

import salcore

Floats = NDArray[np.float64]


class Arrays(NamedTuple):
    """Geometry of a layer, in its own coordinates (its matrix is not applied)."""

    points: Floats
    faces: NDArray[np.int32] | None
    normals: Floats | None


def read(mesh: Any) -> Arrays:
    """Return the geometry of a `pymeshlab.Mesh`.

    A cloud's normals are those it came with; a mesh's follow from its faces, so none are read.
    """
    mesh.compact()
    points = mesh.vertex_matrix()
    if mesh.face_number():
        return Arrays(points, mesh.face_matrix(), None)
    normals = mesh.vertex_normal_matrix()
    return Arrays(points, None, normals if normals.any() else None)


def surface(mesh: Any) -> salcore.Surface:
    """Return a mesh as something to measure to, with its matrix applied."""
    faces = read(mesh).faces
    return salcore.make_surface(mesh.transformed_vertex_matrix(), faces)


def add_subset(
    mesh_set: Any, mesh: Any, indices: NDArray[np.integer], name: str, custom: Iterable[str] = ()
) -> None:
    """Add a layer of some points of `mesh`, with all that MeshLab keeps on points, as current.

    Colours, normals, quality, texture coordinates and selection are carried over, and so is the
    layer's matrix; `custom` names custom scalar attributes to carry over too (pymeshlab cannot
    list them).
    """
    arrays = {
        "v_normals_matrix": mesh.vertex_normal_matrix()[indices],
        "v_color_matrix": mesh.vertex_color_matrix()[indices] if mesh.has_vertex_color() else None,
        "v_scalar_array": mesh.vertex_scalar_array()[indices] if mesh.has_vertex_scalar() else None,
        "v_tex_coords_matrix": (
            mesh.vertex_tex_coord_matrix()[indices] if mesh.has_vertex_tex_coord() else None
        ),
    }
    selected = mesh.vertex_selection_array()[indices]
    attributes = {key: mesh.vertex_custom_scalar_attribute_array(key)[indices] for key in custom}
    matrix = mesh.transform_matrix()
    present = {key: value for key, value in arrays.items() if value is not None}
    # An attribute added to a mesh before it joins the set crashes the next filter.
    mesh_set.add_mesh(pymeshlab.Mesh(mesh.vertex_matrix()[indices], **present), name)
    for key, values in attributes.items():
        mesh_set.current_mesh().add_vertex_custom_scalar_attribute(values, key)
    if selected.any():
        set_selection(mesh_set, selected)
    if not np.array_equal(matrix, np.eye(4)):
        mesh_set.set_matrix(transformmatrix=matrix, freeze=False)


def set_scalar(mesh_set: Any, values: NDArray[Any], name: str) -> None:
    """Make `values` the quality of the current layer, and its custom attribute `name`."""
    mesh_set.compute_scalar_by_function_per_vertex(q=_attribute(mesh_set, values, name))


def set_colors(mesh_set: Any, colors: Floats) -> None:
    """Give the vertices of the current layer colours (n, 3) in [0, 1]."""
    red, green, blue = (
        f"255*{_attribute(mesh_set, colors[:, k], 'color_' + 'rgb'[k])}" for k in range(3)
    )
    mesh_set.compute_color_by_function_per_vertex(x=red, y=green, z=blue, a="255")


def set_selection(mesh_set: Any, selected: NDArray[np.bool_], name: str = "selected") -> None:
    """Select exactly these vertices of the current layer."""
    attribute = _attribute(mesh_set, selected, name)
    mesh_set.compute_selection_by_condition_per_vertex(condselect=f"({attribute} > 0.5)")


def _attribute(mesh_set: Any, values: NDArray[Any], name: str) -> str:
    """Add a custom attribute to the current layer and return its name.

    A mesh's own arrays cannot be set; filters can compute them from an attribute. An attribute
    can be neither changed nor removed, so a second one gets a number.
    """
    mesh = mesh_set.current_mesh()
    number, free = 1, name
    while True:
        try:
            mesh.add_vertex_custom_scalar_attribute(np.asarray(values, dtype=np.float64), free)
        except pymeshlab.PyMeshLabException:
            number += 1
            free = f"{name}_{number}"
            if number > 10000:
                raise
        else:
            return free
