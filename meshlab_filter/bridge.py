# SPDX-License-Identifier: GPL-3.0-or-later
"""Move data between MeshLab layers and arrays, without any decision."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pymeshlab
from numpy.typing import NDArray

import salcore

from .io.layer import NORMAL, RGB, XYZ, Layer, are_split, byte_colors

Floats = NDArray[np.float64]
IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".ppm")


class Arrays(NamedTuple):
    """Geometry of a layer in its own coordinates: its matrix is not applied."""

    points: Floats
    faces: NDArray[np.int32] | None
    normals: Floats | None


def read(mesh: Any) -> Arrays:
    """Return the geometry of a `pymeshlab.Mesh`.

    Normals are read for a cloud only: MeshLab computes those of a mesh from its faces.
    """
    mesh.compact()
    points = mesh.vertex_matrix()
    if mesh.face_number():
        return Arrays(points, mesh.face_matrix(), None)
    normals = mesh.vertex_normal_matrix()
    return Arrays(points, None, normals if normals.any() else None)


def merge_layers(mesh_set: Any, name: str) -> None:
    """Add a layer with all visible ones, each where its matrix puts it, as the current layer."""
    mesh_set.generate_by_merging_visible_meshes(
        mergevisible=True, deletelayer=False, mergevertices=False, alsounreferenced=True
    )
    mesh_set.current_mesh().set_label(name)


def corner_layers(mesh: Any) -> dict[str, Any]:
    """Return what tells the charts of a mesh apart, as arguments of `salcore.Analysis.simplify`.

    Wedge texture coordinates are values of corners; texture coordinates, colours and normals of
    vertices that lie at one place are so too, for files split vertices along seams.
    """
    if not mesh.face_number():
        return {}
    faces, points = mesh.face_matrix(), mesh.vertex_matrix()
    values = []
    if mesh.has_wedge_tex_coord():
        values.append(mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2))
    elif mesh.has_vertex_tex_coord():
        values.append(mesh.vertex_tex_coord_matrix()[faces])
    if mesh.has_face_color():
        values.append(np.repeat(mesh.face_color_matrix()[:, None], 3, axis=1))
    split = are_split(points)
    if split and mesh.has_vertex_color():
        values.append(mesh.vertex_color_matrix()[faces])
    # MeshLab does not tell which other attributes a vertex has: copies may differ in those.
    given: dict[str, Any] = {"corner_values": [np.nan_to_num(v) for v in values] or None}
    if mesh.has_vertex_color():
        given["point_values"] = np.nan_to_num(mesh.vertex_color_matrix()[:, :3])
    normals = mesh.vertex_normal_matrix()
    if split and normals.any():
        given["corner_normals"] = np.nan_to_num(normals)[faces]
    return given


def read_surface(mesh: Any) -> salcore.Surface:
    """Return the surface of a mesh, with its matrix applied, for `salcore.compare`."""
    faces = read(mesh).faces
    return salcore.make_surface(mesh.transformed_vertex_matrix(), faces)


def make_mesh(layer: Layer) -> tuple[Any, tuple[str, ...]]:
    """Return a cloud as a `pymeshlab.Mesh`, and the names of the columns that it does not hold."""
    columns = byte_colors(layer.columns)
    held, arrays = set(XYZ), {}
    if set(NORMAL) <= columns.keys():
        arrays["v_normals_matrix"] = np.column_stack([columns[k] for k in NORMAL]).astype(float)
        held |= set(NORMAL)
    if set(RGB) <= columns.keys() and columns["red"].dtype == np.uint8:
        alpha = columns.get("alpha", np.full(len(layer.points), 255, dtype=np.uint8))
        paint = np.column_stack([*(columns[k] for k in RGB), alpha])
        arrays["v_color_matrix"] = paint / 255.0
        held |= {*RGB, "alpha"}
    if "quality" in columns:
        arrays["v_scalar_array"] = columns["quality"].astype(np.float64)
        held.add("quality")
    mesh = pymeshlab.Mesh(np.ascontiguousarray(layer.points), **arrays)
    return mesh, tuple(name for name in columns if name not in held)


def make_layer(mesh: Any, reference: Any) -> Layer:
    """Return the points of a mesh with what `reference`, from which it was made, has."""
    points = mesh.vertex_matrix()
    columns = {name: points[:, axis] for axis, name in enumerate(XYZ)}
    normals = mesh.vertex_normal_matrix()
    if normals.any():
        columns |= {name: normals[:, axis] for axis, name in enumerate(NORMAL)}
    if reference.has_vertex_color():
        paint = np.round(255.0 * mesh.vertex_color_matrix()).astype(np.uint8)
        columns |= {name: paint[:, axis] for axis, name in enumerate(RGB)}
    if reference.has_vertex_scalar():
        columns["quality"] = mesh.vertex_scalar_array()
    faces = mesh.face_matrix().astype(np.int64) if mesh.face_number() else None
    return Layer(mesh.label(), points, columns, faces)


def add_simplified(
    mesh_set: Any,
    mesh: Any,
    result: salcore.Simplification,
    name: str,
    *,
    custom: Iterable[str] = (),
    with_faces: bool = True,
) -> None:
    """Add a layer with what a simplification keeps of `mesh`, and make it the current one.

    Kept points keep their colours, normals, quality, texture coordinates and selection, and the
    custom scalar attributes named in `custom`, which pymeshlab cannot list. Kept faces keep their
    colours, quality, wedge texture coordinates and the texture. Without faces, a vertex that has no
    texture coordinates gets those of its first corner. The layer keeps the matrix of `mesh`.
    """
    indices = result.indices
    arrays = _vertex_arrays(mesh, result)
    if not with_faces and mesh.has_wedge_tex_coord() and not mesh.has_vertex_tex_coord():
        arrays["v_tex_coords_matrix"] = _corner_tex_coords(mesh)[indices]
    points = mesh.vertex_matrix()[indices] if result.positions is None else result.positions
    faces = result.faces if with_faces else None
    if faces is not None and len(faces):
        arrays |= {"face_matrix": faces.astype(np.int32)} | _face_arrays(mesh, result)
    selected = mesh.vertex_selection_array()[indices]
    attributes = {key: mesh.vertex_custom_scalar_attribute_array(key)[indices] for key in custom}
    matrix, textures = mesh.transform_matrix(), {} if faces is None else mesh.textures()
    before = mesh_set.current_mesh_id()
    mesh_set.add_mesh(pymeshlab.Mesh(points, **arrays), name)
    try:
        # An attribute added to a mesh before it joins the set crashes the next filter.
        for key, values in attributes.items():
            mesh_set.current_mesh().add_vertex_custom_scalar_attribute(values, key)
        if selected.any():
            set_selection(mesh_set, selected)
        if not np.array_equal(matrix, np.eye(4)):
            mesh_set.set_matrix(transformmatrix=matrix, freeze=False)
        if len(textures) == 1:
            _use_first_texture(mesh_set)
            set_texture(mesh_set, *next(iter(textures.items())))
    except BaseException:
        mesh_set.delete_current_mesh()
        mesh_set.set_current_mesh(before)
        raise


def _vertex_arrays(mesh: Any, result: salcore.Simplification) -> dict[str, Any]:
    """Return the attributes of the kept vertices as arguments of `pymeshlab.Mesh`."""
    faces = mesh.face_matrix()
    given = {"v_normals_matrix": mesh.vertex_normal_matrix()}
    if mesh.has_vertex_color():
        given["v_color_matrix"] = mesh.vertex_color_matrix()
    if mesh.has_vertex_scalar():
        given["v_scalar_array"] = mesh.vertex_scalar_array()
    if mesh.has_vertex_tex_coord():
        given["v_tex_coords_matrix"] = mesh.vertex_tex_coord_matrix()
    return {name: salcore.carry_points(result, values, faces) for name, values in given.items()}


def _corner_tex_coords(mesh: Any) -> Floats:
    """Return the texture coordinates (n, 2) of every vertex in its first face."""
    result = np.zeros((mesh.vertex_number(), 2))
    # Where an index repeats, the last assignment wins, so the corners are assigned in reverse.
    result[mesh.face_matrix().ravel()[::-1]] = mesh.wedge_tex_coord_matrix()[::-1]
    return result


def _face_arrays(mesh: Any, result: salcore.Simplification) -> dict[str, Any]:
    """Return the attributes of the kept faces as arguments of `pymeshlab.Mesh`."""
    origin = result.face_source
    arrays = {}
    if mesh.has_face_color():
        arrays["f_color_matrix"] = mesh.face_color_matrix()[origin]
    if mesh.has_face_scalar():
        arrays["f_scalar_array"] = mesh.face_scalar_array()[origin]
    if mesh.has_wedge_tex_coord():
        arrays["w_tex_coords_matrix"] = _wedges(mesh, result)
    return arrays


def _wedges(mesh: Any, result: salcore.Simplification) -> Floats:
    """Return texture coordinates (3 K, 2) for the corners of the kept faces."""
    if result.face_corners is None:
        return np.empty((0, 2))
    wedges = mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    return salcore.carry_corners(result, wedges).reshape(-1, 2)


def _use_first_texture(mesh_set: Any) -> None:
    """Make the faces of the current layer refer to its first texture.

    The wedges of a mesh made from arrays refer to none, so that a material file would name no
    texture. MeshLab's trivial parametrization sets the reference, but also the coordinates, which
    are restored afterwards from custom attributes.
    """
    mesh = mesh_set.current_mesh()
    if not mesh.has_wedge_tex_coord():
        return
    wedges, names = mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2), {}
    for corner in range(3):
        for axis, letter in enumerate("uv"):
            name = f"{letter}{corner}"
            names[name] = f"wedge_{name}"
            values = np.ascontiguousarray(wedges[:, corner, axis])
            mesh.add_face_custom_scalar_attribute(values, names[name])
    mesh_set.compute_texcoord_parametrization_triangle_trivial_per_wedge(
        border=0, method="Basic", textdim=16384
    )
    mesh_set.compute_texcoord_by_function_per_wedge(**names)


def set_texture(mesh_set: Any, name: str, image: Any) -> None:
    """Give the current layer a texture, by way of a file, as pymeshlab requires."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / Path(name).name
        if path.suffix.lower() not in IMAGES:  # an image from within a file has no ending
            path = path.with_name(f"{path.name}.png")
        image.save(str(path))
        mesh_set.set_texture_per_mesh(textname=str(path))


def set_scalar(mesh_set: Any, values: NDArray[Any], name: str) -> None:
    """Set the quality of the current layer, and its custom attribute `name`, to `values`."""
    mesh_set.compute_scalar_by_function_per_vertex(q=_attribute(mesh_set, values, name))


def set_colors(mesh_set: Any, colors: Floats) -> None:
    """Set the vertex colours of the current layer to `colors` (n, 3) in [0, 1]."""
    red, green, blue = (
        f"255*{_attribute(mesh_set, colors[:, k], 'color_' + 'rgb'[k])}" for k in range(3)
    )
    mesh_set.compute_color_by_function_per_vertex(x=red, y=green, z=blue, a="255")


def set_selection(mesh_set: Any, selected: NDArray[np.bool_], name: str = "selected") -> None:
    """Select these vertices of the current layer and no others."""
    attribute = _attribute(mesh_set, selected, name)
    mesh_set.compute_selection_by_condition_per_vertex(condselect=f"({attribute} > 0.5)")


def _attribute(mesh_set: Any, values: NDArray[Any], name: str) -> str:
    """Add a custom attribute to the current layer and return its name.

    pymeshlab cannot set the arrays of a mesh, but MeshLab's filters can compute them from an
    attribute. An attribute can be neither changed nor removed, so further ones of a name are
    numbered. MeshLab does not save them; they only take memory for as long as the layer exists.
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
