# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that an operator works on: which, and whose geometry."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import read
from .read import HostError

KEPT = ("keep_seams", "keep_sharp", "keep_border", "keep_topology")
"""Switches of what has to stay."""


@dataclass
class Source:
    """One geometry, and the objects that show it.

    Attributes
    ----------
    objects : list of bpy.types.Object
        Lengths are measured in the space of the first.
    data : bpy.types.Mesh or bpy.types.PointCloud
    fresh : bool
        Whether `data` is a copy made for this work, of what the modifiers made.
    problem : HostError or None
        Why there are no data.
    upright : bool
        Whether lengths are measured along the first object's own axes, only scaled: its planes of
        symmetry lie along these.
    """

    objects: list[Any]
    data: Any
    fresh: bool = False
    problem: HostError | None = None
    upright: bool = False

    @property
    def object(self) -> Any:
        """The object whose matrix counts."""
        return self.objects[0]

    @property
    def matrix(self) -> Any:
        """From the space of the data to the one that points are handed over in."""
        matrix = self.object.matrix_world
        return np.diag([*matrix.to_scale(), 1.0]) if self.upright else matrix

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.data.vertices if read.is_mesh(self.data) else self.data.points)

    @property
    def weighted(self) -> bool:
        """Whether vertices may carry weights."""
        return read.is_mesh(self.data) and bool(self.object.vertex_groups)

    def discard(self) -> None:
        """Remove a copy that has not been used."""
        if self.fresh and self.data.users == 0:
            _collection(self.data).remove(self.data)

    def require_present(self) -> None:
        """Raise `HostError` if there is no geometry."""
        if self.problem is not None:
            raise self.problem
        if not self.count:
            raise HostError(f"{self.object.name}: has no points")
        if not abs(self.object.matrix_world.determinant()) > 0.0:
            raise HostError(
                f"{self.object.name}: its scale is 0 along an axis, so it has no shape; scale it "
                "to what it should be"
            )

    def require_axes(self) -> None:
        """Raise `HostError` if the axes are not at right angles: no side is like the other then."""
        axes = np.array(self.object.matrix_world)[:3, :3]
        axes = axes / np.linalg.norm(axes, axis=0)
        if np.abs(axes.T @ axes - np.eye(3)).max() > 1e-4:
            raise HostError(
                f"{self.object.name}: is sheared, so that its sides are not alike; apply its scale "
                "and rotation, or turn Symmetry off"
            )

    def require_editable(self) -> None:
        """Raise `HostError` if the geometry must not be changed."""
        for block in (self.object.data, self.object):
            if block.library is not None or not block.is_editable:
                origin = f" from {block.library.filepath}" if block.library else ""
                raise HostError(
                    f"{block.name}: is linked{origin} and cannot be changed; make it local, or "
                    "let the result be a new object"
                )


def _collection(data: Any) -> Any:
    return bpy.data.meshes if read.is_mesh(data) else bpy.data.pointclouds


def eligible(objects: Iterable[Any]) -> Iterator[Any]:
    """Yield the meshes and point clouds among objects."""
    return (obj for obj in objects if obj.type in {"MESH", "POINTCLOUD"})


def selected(context: Any, kind: str) -> list[Source]:
    """Return the selected geometries: "ORIGINAL", or "EVALUATED" with modifiers applied."""
    return evaluated(context) if kind == "EVALUATED" else originals(context)


def originals(context: Any) -> list[Source]:
    """Return the selected objects' own geometries, each once however many objects share it."""
    sources: dict[Any, Source] = {}
    for obj in _chosen(context):
        sources.setdefault(obj.data, Source([], obj.data)).objects.append(obj)
    return list(sources.values())


def evaluated(context: Any) -> list[Source]:
    """Return copies of what the modifiers make of each selected object."""
    depsgraph = context.evaluated_depsgraph_get()
    found: list[Source] = []
    for obj in _chosen(context):
        try:
            found.append(Source([obj], _after_modifiers(obj, depsgraph), True))
        except HostError as error:
            found.append(Source([obj], None, problem=error))
    return found


def _chosen(context: Any) -> list[Any]:
    """Return the selected meshes and clouds, the active one first."""
    objects = list(eligible(context.selected_objects))
    if not objects:
        raise HostError("nothing to work on: select a mesh or a point cloud")
    objects.sort(key=lambda obj: obj is not context.active_object)
    return objects


def _after_modifiers(obj: Any, depsgraph: Any) -> Any:
    final = obj.evaluated_get(depsgraph)
    parts = final.evaluated_geometry()  # to be kept until its parts have been copied
    cloud, mesh = parts.pointcloud, parts.mesh
    if cloud is not None and not (mesh is not None and len(mesh.vertices)):
        return cloud.copy()
    if mesh is None:
        raise HostError(
            f"{obj.name}: its modifiers leave no mesh and no point cloud; take the original "
            "geometry, or change the modifiers"
        )
    copy = bpy.data.meshes.new_from_object(
        final, preserve_all_data_layers=True, depsgraph=depsgraph
    )
    copy.name = obj.data.name
    return copy


def geometry(source: Source) -> dict[str, Any]:
    """Return points, triangles and normals of a source in world space, for a request."""
    found = read.arrays(source.data, source.matrix)
    return found._asdict()


def geometry_with_mesh(source: Source, settings: Any) -> dict[str, Any]:
    """Return a source as `requests.simplify` wants it, with what settings say has to stay."""
    found = geometry(source)
    del found["faces"]  # they follow from the mesh
    mesh = read.mesh_arrays(source.data)._asdict() if read.is_mesh(source.data) else None
    return found | {
        "mesh": mesh,
        "colors": read.point_color(source.data),
        "protect": protected(source, settings.protect),
        "importance": important(source, settings.importance, settings.importance_factor),
        **{name: getattr(settings, name) for name in KEPT},
    }


def to_simplify(source: Source, settings: Any) -> dict[str, Any]:
    """Return a source as `requests.simplify` wants it, cleaned and by halves as settings say."""
    symmetry = None if settings.symmetry == "NONE" else settings.symmetry.lower()
    source.upright = symmetry is not None
    if source.upright:
        source.require_axes()
    return geometry_with_mesh(source, settings) | {
        "symmetry": symmetry,
        "weld": settings.weld,
        "remove_loose": settings.remove_loose,
    }


def protected(source: Source, name: str) -> NDArray[np.bool_] | None:
    """Return which points are never to go, or None without a name."""
    if not name:
        return None
    result: NDArray[np.bool_] = read.weights(source.object, source.data, name) > 0.0
    return result


def important(source: Source, name: str, factor: float) -> NDArray[np.float64] | None:
    """Return how many times more the removal of each point costs, or None without a name."""
    if not name:
        return None
    values = read.weights(source.object, source.data, name)
    if not np.isfinite(values).all() or (values < 0.0).any():
        raise HostError(
            f"{source.object.name}: values of {name!r} are negative or no numbers; importance "
            "wants values from 0 on"
        )
    result: NDArray[np.float64] = factor * values
    return result
