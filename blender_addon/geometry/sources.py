# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that an operator works on: which, and whose geometry; and the work up to a result."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import analyses, bridge, topology
from .bridge import HostError
from .salcore import Analysis, Parameters, Progress, Simplification
from .salcore.progress import part


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
    """

    objects: list[Any]
    data: Any
    fresh: bool = False

    @property
    def object(self) -> Any:
        """The object whose matrix counts."""
        return self.objects[0]

    @property
    def weighted(self) -> bool:
        """Whether vertices may carry weights."""
        return bridge.is_mesh(self.data) and bool(self.object.vertex_groups)

    def discard(self) -> None:
        """Remove a copy that has not been used."""
        if self.fresh and self.data.users == 0:
            _collection(self.data).remove(self.data)

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
    return bpy.data.meshes if bridge.is_mesh(data) else bpy.data.pointclouds


def eligible(objects: Iterable[Any]) -> Iterator[Any]:
    """Yield the meshes and point clouds among objects."""
    return (obj for obj in objects if obj.type in {"MESH", "POINTCLOUD"})


def originals(context: Any) -> list[Source]:
    """Return the selected objects' own geometries, each once however many objects share it."""
    sources: dict[Any, Source] = {}
    for obj in _chosen(context):
        sources.setdefault(obj.data, Source([], obj.data)).objects.append(obj)
    return list(sources.values())


def evaluated(context: Any) -> list[Source]:
    """Return copies of what the modifiers make of each selected object."""
    depsgraph = context.evaluated_depsgraph_get()
    return [Source([obj], _after_modifiers(obj, depsgraph), True) for obj in _chosen(context)]


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


def analysis_steps(source: Source, parameters: Parameters) -> Generator[Progress, None, Analysis]:
    """Yield progress and return the analysis of a source, in world space."""
    yield Progress("Read", 0.0)
    arrays = bridge.read(source.data, source.object.matrix_world)
    if not len(arrays.points):
        raise HostError(f"{source.object.name}: has no points")
    return (yield from analyses.steps(arrays, parameters))


def protected(source: Source, name: str) -> NDArray[np.bool_] | None:
    """Return which points are never to go, or None without a name."""
    if not name:
        return None
    result: NDArray[np.bool_] = bridge.weights(source.object, source.data, name) > 0.0
    return result


def wishes(source: Source, protect: str, keep_seams: bool) -> dict[str, Any]:
    """Return what must stay, as salcore's arguments."""
    mesh = bridge.is_mesh(source.data)
    return {
        "protect": protected(source, protect),
        "seams": topology.seams(source.data) if keep_seams and mesh else None,
    }


def simplification_steps(
    source: Source,
    parameters: Parameters,
    target: dict[str, float],
    protect: str = "",
    keep_seams: bool = True,
) -> Generator[Progress, None, Simplification]:
    """Yield progress and return the simplification of a source."""
    analysis = yield from part(0.0, 0.4, analysis_steps(source, parameters))
    steps = analysis.simplify_steps(**wishes(source, protect, keep_seams), **target)
    return (yield from part(0.4, 1.0, steps))


def each(
    sources: list[Source], steps_of: Any, check: Callable[[Source], None] | None = None
) -> Generator[Progress, None, list[tuple[Source, Any]]]:
    """Do the same work for every source, and return them with what came of it.

    All are checked first. Copies made for the work are removed if it ends before its time.
    """
    results = []
    try:
        if check is not None:
            for source in sources:
                check(source)
        for k, source in enumerate(sources):
            steps = part(k / len(sources), (k + 1) / len(sources), steps_of(source))
            result = yield from steps
            results.append((source, result))
    except BaseException:
        for source in sources:
            source.discard()
        raise
    return results
