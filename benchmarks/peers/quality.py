# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a simplification is from the original, measured with libraries other than ours.

All lengths are per cent of the diagonal of the bounding box.

mesh     distances of 200 000 samples of the original surface to the mesh that a method returned
rebuilt  the same to a surface rebuilt from the kept points: on a mesh the dual of their geodesic
         Voronoi cells, on a cloud CGAL's advancing front; of a cloud all points are samples
cover    distances of all original points to the nearest kept one: (5.1) and (5.2) of the paper

`feature` is the rms over the tenth of the original points where the surface bends most.
"""

from __future__ import annotations

import tempfile
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import open3d
import pymeshlab
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from benchmarks.common.shapes import Shape
from benchmarks.peers.registry import Outcome

SAMPLES = 200_000


class Judge:
    """Measures outcomes against one original."""

    def __init__(self, shape: Shape):
        self.shape = shape
        self.unit = shape.diagonal / 100
        self.samples = shape.points if shape.faces is None else scattered(shape)
        self.feature = shape.points[shape.features]
        self.can_rebuild = shape.faces is not None or find_spec("CGAL") is not None
        if not self.can_rebuild:
            print("missing: cgal, which rebuilds surfaces from clouds")

    def figures(self, outcome: Outcome) -> dict[str, dict[str, float]]:
        """Return all figures of one outcome."""
        points = outcome.points
        if points is None:
            points = self.shape.points[outcome.indices]
        result = {}
        if outcome.faces is not None:
            result["mesh"] = self.surface(points, outcome.faces)
        if outcome.indices is not None and self.can_rebuild:
            result["rebuilt"] = self.surface(*self.rebuilt(outcome.indices))
        near = cKDTree(points).query(self.shape.points, workers=-1)[0] / self.unit
        result["cover"] = {"max": float(near.max()), "avg": float(near.mean())}
        return result

    def surface(self, points: np.ndarray, faces: np.ndarray) -> dict[str, float]:
        """Return the errors of a surface."""
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            open3d.core.Tensor(np.ascontiguousarray(points, dtype=np.float32)),
            open3d.core.Tensor(np.ascontiguousarray(faces, dtype=np.uint32)),
        )

        def distance(queries: np.ndarray) -> np.ndarray:
            tensor = open3d.core.Tensor(queries.astype(np.float32))
            return scene.compute_distance(tensor).numpy().astype(float) / self.unit

        far, at_features = distance(self.samples), distance(self.feature)
        return {
            "rms": float(np.sqrt(np.mean(far**2))),
            "max": float(far.max()),
            "feature": float(np.sqrt(np.mean(at_features**2))),
        }

    def rebuilt(self, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the surface that a neutral tool makes of kept points."""
        if self.shape.faces is None:
            return advancing_front(self.shape.points[kept])
        cells = dijkstra(self.graph, indices=kept, min_only=True, return_predecessors=True)[2]
        a, b, c = corner = cells[self.shape.faces.T]
        whole = (a != b) & (b != c) & (c != a) & (corner.min(axis=0) >= 0)
        return self.shape.points, corner[:, whole].T

    @cached_property
    def graph(self) -> sparse.csr_array:
        """Return the edges of the original mesh with their lengths."""
        faces, points = self.shape.faces, self.shape.points
        start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
        length = np.linalg.norm(points[start] - points[end], axis=1) + 1e-12
        graph = sparse.csr_array((length, (start, end)), shape=(len(points),) * 2)
        return graph.maximum(graph.T)


def scattered(shape: Shape) -> np.ndarray:
    """Return points drawn evenly from a mesh's surface."""
    rng = np.random.default_rng(1)
    a, b, c = shape.points[shape.faces.T]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    face = rng.choice(len(area), SAMPLES, p=area / area.sum())
    u, v = rng.random((2, SAMPLES, 1))
    root = np.sqrt(u)
    return a[face] * (1 - root) + b[face] * (root * (1 - v)) + c[face] * (root * v)


def advancing_front(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return CGAL's surface through points."""
    from CGAL.CGAL_Advancing_front_surface_reconstruction import (
        advancing_front_surface_reconstruction,
    )
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3

    cloud, surface = Point_set_3(), Polyhedron_3()
    for point in points.tolist():
        cloud.insert(Point_3(*point))
    advancing_front_surface_reconstruction(cloud, surface)
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "front.off")
        surface.write_to_file(path, 17)
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.load_new_mesh(path)
        mesh = meshes.current_mesh()
        return mesh.vertex_matrix(), mesh.face_matrix()
