# SPDX-License-Identifier: GPL-3.0-or-later
"""Methods that decimate meshes: MeshLab's, meshoptimizer's, fast-simplification's, Blender's, ours.

All but ours are asked for a number of faces; it is sought until the number of points is met.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.common.shapes import Shape
from benchmarks.peers.registry import OURS, Outcome, Ready, method, seek


def used(points: np.ndarray, faces: np.ndarray) -> int:
    """Return how many points faces use."""
    return len(np.unique(faces))


def guess(shape: Shape, count: int) -> float:
    """Return about how many faces so many points will have: as many each as in the original."""
    return count * len(shape.faces) / len(shape.points)


def own(points: np.ndarray, faces: np.ndarray) -> Outcome:
    """Return a mesh of moved vertices as an outcome."""
    corner, faces = np.unique(faces, return_inverse=True)
    return Outcome(points=points[corner], faces=faces.reshape(-1, 3))


def original(shape: Shape, points: np.ndarray, faces: np.ndarray) -> Outcome:
    """Return a mesh of original vertices as an outcome, with their numbers."""
    mesh = own(points, faces)
    return mesh._replace(indices=np.unique(cKDTree(shape.points).query(mesh.points)[1]))


def meshlab(shape: Shape, count: int, optimal: bool) -> tuple[Any, Any]:
    """Return the call that decimates a mesh set to the count, and how its mesh is read."""
    import pymeshlab

    def fresh() -> pymeshlab.MeshSet:
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(shape.points, shape.faces))
        return meshes

    def decimate(meshes: pymeshlab.MeshSet, faces: float) -> pymeshlab.MeshSet:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=int(faces), optimalplacement=optimal
        )
        return meshes

    def read(meshes: pymeshlab.MeshSet) -> tuple[np.ndarray, np.ndarray]:
        return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()

    faces = seek(lambda faces: used(*read(decimate(fresh(), faces))), count, guess(shape, count), 1)
    meshes = fresh()
    return lambda: decimate(meshes, faces), read


@method("MeshLab QEM, original vertices", "pymeshlab", faces=True)
def meshlab_original(shape: Shape, count: int) -> Ready:
    """Collapse edges into one of their ends."""
    work, read = meshlab(shape, count, optimal=False)
    return Ready(work, lambda result: original(shape, *read(result)))


@method("MeshLab QEM, optimal placement", "pymeshlab", faces=True)
def meshlab_optimal(shape: Shape, count: int) -> Ready:
    """Collapse edges into the best point."""
    work, read = meshlab(shape, count, optimal=True)
    return Ready(work, lambda result: own(*read(result)))


@method("meshoptimizer", "meshoptimizer", faces=True)
def meshoptimizer_subset(shape: Shape, count: int) -> Ready:
    """Collapse edges into one of their ends (zeux's)."""
    import meshoptimizer

    corners = np.ascontiguousarray(shape.faces.ravel(), dtype=np.uint32)
    points = np.ascontiguousarray(shape.points, dtype=np.float32)

    def simplified(faces: float) -> np.ndarray:
        kept = np.zeros_like(corners)
        number = meshoptimizer.simplify(
            kept, corners, points, target_index_count=3 * int(faces), target_error=1.0
        )
        return kept[:number].reshape(-1, 3).astype(np.int64)

    faces = seek(lambda faces: used(points, simplified(faces)), count, guess(shape, count), 1)
    return Ready(lambda: simplified(faces), lambda result: original(shape, shape.points, result))


@method("fast-simplification", "fast-simplification", faces=True)
def fast(shape: Shape, count: int) -> Ready:
    """Collapse edges in passes of a rising threshold, into the best point (sp4cerat's)."""
    import fast_simplification

    points = shape.points.astype(np.float32)
    corners = shape.faces.astype(np.int32)

    def simplified(faces: float) -> tuple[np.ndarray, np.ndarray]:
        return fast_simplification.simplify(points, corners, target_count=int(faces))[:2]

    faces = seek(lambda faces: used(*simplified(faces)), count, guess(shape, count), 1)
    return Ready(lambda: simplified(faces), lambda result: own(*result))


@method("Blender Decimate", "bpy", faces=True)
def blender(shape: Shape, count: int) -> Ready:
    """Collapse edges into the best point, as Blender's modifier does."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("shape")
    number = len(shape.faces)
    mesh.vertices.add(len(shape.points))
    mesh.vertices.foreach_set("co", shape.points.astype(np.float32).ravel())
    mesh.loops.add(3 * number)
    mesh.loops.foreach_set("vertex_index", shape.faces.astype(np.int32).ravel())
    mesh.polygons.add(number)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * number, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    thing = bpy.data.objects.new("shape", mesh)
    bpy.context.collection.objects.link(thing)
    modifier = thing.modifiers.new("Decimate", "DECIMATE")

    def simplified(faces: float) -> Any:
        modifier.ratio = min(1.0, faces / number)
        return thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data

    def read(result: Any) -> tuple[np.ndarray, np.ndarray]:
        points = np.empty(3 * len(result.vertices), dtype=np.float32)
        result.vertices.foreach_get("co", points)
        result.calc_loop_triangles()
        faces = np.empty(3 * len(result.loop_triangles), dtype=np.int32)
        result.loop_triangles.foreach_get("vertices", faces)
        return points.reshape(-1, 3).astype(float), faces.reshape(-1, 3)

    faces = seek(lambda faces: used(*read(simplified(faces))), count, guess(shape, count), 1)
    modifier.ratio = 1.0  # so that the last call has work to do
    bpy.context.evaluated_depsgraph_get()
    return Ready(lambda: simplified(faces), lambda result: own(*read(result)))


def ours(shape: Shape, count: int, placement: str, refine: bool = True) -> Ready:
    """Order all vertices by elimination."""
    import salcore

    parameters = salcore.Parameters(placement=placement, refine=refine)

    def read(result: salcore.Simplification) -> Outcome:
        if result.positions is not None:
            return own(result.positions, result.faces)
        return Outcome(result.indices, shape.points[result.indices], result.faces)

    return Ready(
        lambda: salcore.simplify(shape.points, shape.faces, parameters=parameters, count=count),
        read,
    )


@method("ours, mesh", OURS, faces=True)
def ours_original(shape: Shape, count: int) -> Ready:
    """Keep original vertices."""
    return ours(shape, count, "original")


@method("ours, mesh, optimal placement", OURS, faces=True)
def ours_optimal(shape: Shape, count: int) -> Ready:
    """Move the kept vertices to where the error is least."""
    return ours(shape, count, "optimal")


@method("ours, mesh, not refined", OURS, faces=True)
def ours_cut(shape: Shape, count: int) -> Ready:
    """Keep original vertices, and the faces that the collapses left."""
    return ours(shape, count, "original", refine=False)


@method("ours, mesh, optimal placement, not refined", OURS, faces=True)
def ours_minima(shape: Shape, count: int) -> Ready:
    """Move the kept vertices to the minima of their quadrics alone."""
    return ours(shape, count, "optimal", refine=False)
