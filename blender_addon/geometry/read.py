# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry of an object as arrays; nothing is decided here.

Points are in world space: lengths, normals and errors are those that a user sees in the scene,
whatever the object's scale.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..salcore import SalcoreError
from . import attributes, vertices
from .topology import MeshArrays

Floats = NDArray[np.float64]


class HostError(SalcoreError):
    """Something in the scene that stands in the way; the message says what and the remedy."""


class Arrays(NamedTuple):
    """What salcore wants of an object."""

    points: Floats
    faces: NDArray[np.int32] | None
    normals: Floats | None


def is_mesh(data: Any) -> bool:
    """Return whether this is a mesh, with or without faces."""
    return isinstance(data, bpy.types.Mesh)


def positions(data: Any) -> NDArray[np.float32]:
    """Return the coordinates (n, 3) of a mesh or point cloud, in its own space."""
    return attributes.topology(data, "position")


def arrays(data: Any, matrix: Any) -> Arrays:
    """Return points, triangles and normals of a mesh or point cloud, taken through a matrix.

    Parameters
    ----------
    data : bpy.types.Mesh or bpy.types.PointCloud
    matrix : (4, 4) matrix
        From its space to the world.

    Returns
    -------
    Arrays
        A cloud's normals come from its attribute "normal"; a mesh's follow from its faces.
    """
    linear = np.array(matrix)[:3, :3]
    points = _transform(positions(data), linear) + np.array(matrix)[:3, 3]
    if is_mesh(data) and len(data.polygons):
        return Arrays(points, triangles(data)[0], None)
    attribute = data.attributes.get("normal")
    if attribute is None or (attribute.data_type, attribute.domain) != ("FLOAT_VECTOR", "POINT"):
        return Arrays(points, None, None)
    # Normals go with the transposed inverse, here without the division by the determinant.
    across = np.cross(np.roll(linear, -1, axis=0), np.roll(linear, -2, axis=0))
    return Arrays(points, None, _transform(np.asarray(attributes.read(attribute)), across))


def _transform(vectors: NDArray[np.float32], linear: Floats) -> Floats:
    """Return float64 vectors (n, 3), multiplied by a (3, 3) matrix unless that changes nothing."""
    wide = vectors.astype(np.float64)
    return wide if np.array_equal(linear, np.eye(3)) else wide @ linear.T


def precision_note(data: Any) -> str:
    """Return a sentence if coordinates are too far from the origin for Blender's single precision.

    Their step is compared with the mean spacing, which the bounding box and the count tell.
    """
    points = positions(data)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 2:
        return ""
    step = float(np.spacing(np.abs(points).max()))
    extent = np.sort(np.ptp(points.astype(np.float64), axis=0))
    spacing = float(np.sqrt(extent[1] * extent[2] / len(points)))
    if not step > MAX_STEP * spacing > 0.0:
        return ""
    return (
        f"its points lie so far from its origin that Blender holds their coordinates in steps of "
        f"{step:.3g}, and they are about {spacing:.3g} apart; take an offset off before the import"
    )


MAX_STEP = 0.05
"""Step of the coordinates, as a share of the spacing of points, up to which nothing is said."""


def triangles(mesh: Any) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Return the triangles of a mesh: their vertices (t, 3), corners (t, 3) and polygons (t,)."""
    vertex = attributes.topology(mesh, ".corner_vert")
    if len(vertex) == 3 * len(mesh.polygons):  # all are triangles
        corners = np.arange(len(vertex), dtype=np.int32).reshape(-1, 3)
        return vertex.reshape(-1, 3), corners, np.arange(len(corners), dtype=np.int32)
    mesh.calc_loop_triangles()
    corners = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    polygons = np.empty(len(corners), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return vertex[corners], corners, polygons


def mesh_arrays(mesh: Any) -> MeshArrays:
    """Return polygons, corners and edges of a mesh, and which of them carry something."""
    first = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", first)
    edges = attributes.topology(mesh, ".edge_verts")
    loose = np.ones(len(edges), dtype=bool)
    loose[attributes.topology(mesh, ".corner_edge")] = False
    all_triangles = len(mesh.loops) == 3 * len(mesh.polygons)
    _, corners, polygons = (None,) * 3 if all_triangles else triangles(mesh)
    maps = list(mesh.uv_layers)
    active = mesh.uv_layers.active
    material = mesh.attributes.get("material_index")
    return MeshArrays(
        first=first,
        vertices=attributes.topology(mesh, ".corner_vert"),
        triangles=corners,
        polygon_of=polygons,
        loose_edges=edges[loose],
        edges=edges if _carries(mesh, "EDGE") else None,
        corner_values=_carries(mesh, "CORNER"),
        uv_maps=[np.asarray(attributes.read(mesh.attributes[uv.name])) for uv in maps],
        active_uv=-1 if active is None else [uv.name for uv in maps].index(active.name),
        corner_colors=_colors(mesh, "CORNER"),
        point_colors=_colors(mesh, "POINT"),
        custom_normals=custom_normals(mesh),
        materials=None if material is None else np.asarray(attributes.read(material)),
        marked_seams=_marked(mesh, edges, "uv_seam"),
        sharp=_marked(mesh, edges, *SHARP),
    )


def _colors(mesh: Any, domain: str) -> list[NDArray[np.float32]]:
    """Return the colours of a domain."""
    return [np.asarray(attributes.read(color)) for color in _color_attributes(mesh, domain)]


def point_color(data: Any) -> NDArray[np.float64] | None:
    """Return the colour (n, 3) of points: the active one, else the first; None without any."""
    found = _color_attributes(data, "POINT")
    if not found:
        return None
    active = data.attributes.active_color_name if is_mesh(data) else ""
    chosen = next((color for color in found if color.name == active), found[0])
    values = np.asarray(attributes.read(chosen), dtype=np.float64)[:, :3]
    return np.nan_to_num(values, posinf=0.0, neginf=0.0)


def _color_attributes(data: Any, domain: str) -> list[Any]:
    """Return the colours of a domain, but for those by which results are shown."""
    return [
        attribute
        for attribute in data.attributes
        if attribute.domain == domain
        and attribute.data_type in COLORS
        and attribute.name not in SHOWN_COLORS
    ]


COLORS = ("FLOAT_COLOR", "BYTE_COLOR")
SHOWN_COLORS = ("Saliency Color", "Region Color", "Interest Color")
"""Colours that Show Saliency and its like store."""


def custom_normals(mesh: Any) -> NDArray[np.float32] | None:
    """Return the normals (C, 3) of the corners, if they are not those that polygons give."""
    if not mesh.has_custom_normals:
        return None
    normals = np.empty((len(mesh.loops), 3), dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    return normals


def _marked(mesh: Any, edges: NDArray[np.int32], *names: str) -> NDArray[np.int32] | None:
    """Return the edges (s, 2) where one of these attributes of edges is not zero, or None."""
    found = [mesh.attributes.get(name) for name in names]
    marks = [np.asarray(attributes.read(item)) != 0 for item in found if _of_edges(item)]
    if "freestyle_edge" in names and hasattr(bpy.types.MeshEdge, "use_freestyle_mark"):
        freestyle = np.zeros(len(edges), dtype=bool)  # no attribute before Blender 5.0
        mesh.edges.foreach_get("use_freestyle_mark", freestyle)
        marks.append(freestyle)
    return edges[np.logical_or.reduce(marks)] if marks else None


def _of_edges(attribute: Any) -> bool:
    return attribute is not None and attribute.domain == "EDGE" and attribute.data_type in WEIGHTS


def _carries(mesh: Any, domain: str) -> bool:
    """Return whether elements of a domain have values that a new element has to get."""
    return any(a.domain == domain and a.name not in attributes.TOPOLOGY for a in mesh.attributes)


def weights(obj: Any, data: Any, name: str) -> NDArray[np.float64]:
    """Return a value for every point from a vertex group or an attribute of this name.

    Parameters
    ----------
    obj : bpy.types.Object
        Whose vertex groups are meant.
    data : bpy.types.Mesh or bpy.types.PointCloud
    name : str

    Returns
    -------
    (n,) float64

    Raises
    ------
    HostError
        If there is neither.
    """
    group = obj.vertex_groups.get(name) if is_mesh(data) else None
    if group is not None:
        return vertices.weights(data, name).astype(np.float64)
    faces = _in_face_set(data, name)
    if faces is not None:
        return _largest_round(data, faces.astype(np.float64))
    attribute = data.attributes.get(name)
    domains = ("POINT", "FACE") if is_mesh(data) else ("POINT",)
    if attribute is None or attribute.domain not in domains or attribute.data_type not in WEIGHTS:
        raise HostError(
            f"{obj.name}: no vertex group and no boolean, integer or float attribute of points "
            f"or faces is called {name!r}; clear the field or choose another"
        )
    values = np.asarray(attributes.read(attribute), dtype=np.float64)
    return values if attribute.domain == "POINT" else _largest_round(data, values)


def weight_names(obj: Any) -> list[str]:
    """Return the names that `weights` understands for an object, the useful ones."""
    if obj is None or obj.type not in {"MESH", "POINTCLOUD"}:
        return []
    mesh = is_mesh(obj.data)
    domains = ("POINT", "FACE") if mesh else ("POINT",)
    found = [
        attribute.name
        for attribute in obj.data.attributes
        if attribute.domain in domains
        and attribute.data_type in WEIGHTS
        and (not attribute.name.startswith(".") or attribute.name in SCULPTED)
    ]
    sets = _face_sets(obj.data)
    if sets is not None:
        found += [f"{FACE_SET}{number}" for number in np.unique(sets)[:MOST_SETS]]
    return [*(group.name for group in obj.vertex_groups if mesh), *found]


def _face_sets(data: Any) -> NDArray[np.int32] | None:
    """Return the number of each polygon's face set, as sculpting has them, or None."""
    attribute = data.attributes.get(SCULPT_FACE_SET)
    if attribute is None or (attribute.data_type, attribute.domain) != ("INT", "FACE"):
        return None
    values: NDArray[np.int32] = np.asarray(attributes.read(attribute))
    return values


def _in_face_set(data: Any, name: str) -> NDArray[np.bool_] | None:
    """Return the polygons of the face set, or of all painted ones, that a name means, or None."""
    number = name.removeprefix(FACE_SET)
    wanted = name.startswith(FACE_SET) and number.isdecimal()
    sets = _face_sets(data) if wanted or name == SCULPT_FACE_SET else None
    if sets is None:
        return None
    chosen = np.asarray(sets == int(number) if wanted else sets != UNPAINTED)
    return chosen if chosen.any() or not wanted else None


def _largest_round(mesh: Any, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest value of the polygons round each vertex; 0 where there is none."""
    first = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", first)
    vertex = attributes.topology(mesh, ".corner_vert")
    result = np.zeros(len(mesh.vertices))
    sizes = np.diff(np.append(first, len(vertex)))
    np.maximum.at(result, vertex, np.repeat(values, sizes))
    return result


SCULPT_FACE_SET = ".sculpt_face_set"
SCULPTED = (".sculpt_mask", SCULPT_FACE_SET)
"""Attributes of sculpting, which are hidden elsewhere."""
FACE_SET = "Face Set "
"""Followed by a number, one of the face sets."""
UNPAINTED = 1
"""Number of the face set that all polygons are in before any is painted."""
MOST_SETS = 100
"""Face sets that are offered by number."""
SHARP = ("sharp_edge", "crease_edge", "bevel_weight_edge", "freestyle_edge")
"""Attributes of edges that make an edge a line to keep."""
WEIGHTS = ("BOOLEAN", "FLOAT", "INT", "INT8")
"""Attribute types that can protect points."""
