# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a simplification is from the original, measured with libraries other than ours.

All lengths are per cent of the diagonal of the bounding box.

mesh     distances of 200 000 samples of the original surface to the mesh that a method returned
rebuilt  the same to a surface rebuilt from the kept points: on a mesh the dual of their geodesic
         Voronoi cells, on a cloud CGAL's advancing front; of a cloud all points are samples
cover    distances of all original points to the nearest kept one: (5.1) and (5.2) of the paper

`feature` is the rms over the tenth of the original points where the surface bends most. Of a mesh
also `both`, the largest distance from samples of either surface to the other; `normal`, the rms
angle in degrees between smooth normals at the samples and at the nearest places of the mesh.
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
        self.samples = shape.points
        if shape.faces is not None:
            self.samples, face, weights = scattered(shape.points, shape.faces)
            smooth = vertex_normals(shape.points, shape.faces)
            self.normals = interpolated(smooth, shape.faces[face], weights)
            self.scene = raycasting(shape.points, shape.faces)
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
            result["mesh"]["normal"] = self.normal_angle(points, outcome.faces)
            back = self.distance(self.scene, scattered(points, outcome.faces)[0]).max()
            result["mesh"]["both"] = max(result["mesh"]["max"], float(back))
        if outcome.indices is not None and self.can_rebuild:
            result["rebuilt"] = self.surface(*self.rebuilt(outcome.indices))
        near = cKDTree(points).query(self.shape.points, workers=-1)[0] / self.unit
        result["cover"] = {"max": float(near.max()), "avg": float(near.mean())}
        return result

    def surface(self, points: np.ndarray, faces: np.ndarray) -> dict[str, float]:
        """Return the errors of a surface."""
        scene = raycasting(points, faces)
        far, at_features = (self.distance(scene, q) for q in (self.samples, self.feature))
        return {
            "rms": float(np.sqrt(np.mean(far**2))),
            "max": float(far.max()),
            "feature": float(np.sqrt(np.mean(at_features**2))),
        }

    def distance(self, scene: open3d.t.geometry.RaycastingScene, queries: np.ndarray) -> np.ndarray:
        """Return distances from points to a surface."""
        return scene.compute_distance(single(queries)).numpy().astype(float) / self.unit

    def normal_angle(self, points: np.ndarray, faces: np.ndarray) -> float:
        """Return the rms angle in degrees between smooth normals of the original and a mesh."""
        near = raycasting(points, faces).compute_closest_points(single(self.samples))
        corners = faces[near["primitive_ids"].numpy().astype(np.int64)]
        u, v = near["primitive_uvs"].numpy().astype(float).T
        weights = np.stack([1 - u - v, u, v], axis=1)
        normals = interpolated(vertex_normals(points, faces), corners, weights)
        cosine = np.einsum("nc,nc->n", normals, self.normals).clip(-1, 1)
        return float(np.degrees(np.sqrt(np.mean(np.arccos(cosine) ** 2))))

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


def single(points: np.ndarray) -> open3d.core.Tensor:
    """Return points in Open3D's form and precision."""
    return open3d.core.Tensor(np.ascontiguousarray(points, dtype=np.float32))


def raycasting(points: np.ndarray, faces: np.ndarray) -> open3d.t.geometry.RaycastingScene:
    """Return a surface that can be asked for distances and nearest places."""
    scene = open3d.t.geometry.RaycastingScene()
    corners = np.ascontiguousarray(faces, dtype=np.uint32)
    scene.add_triangles(single(points), open3d.core.Tensor(corners))
    return scene


def scattered(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places drawn evenly from a mesh's surface, their faces and weights of the corners."""
    rng = np.random.default_rng(1)
    a, b, c = points[faces.T]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    face = rng.choice(len(area), SAMPLES, p=area / area.sum())
    root, v = np.sqrt(rng.random(SAMPLES)), rng.random(SAMPLES)
    weights = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    return np.einsum("nk,nkc->nc", weights, points[faces[face]]), face, weights


def vertex_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals of vertices: their faces', weighted by the angle at the vertex."""
    corners = points[faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    across = np.cross(ahead, behind)  # at each corner the same direction
    length = np.linalg.norm(across, axis=2, keepdims=True)
    angle = np.arctan2(length[..., 0], np.einsum("fkc,fkc->fk", ahead, behind))
    pull = angle[..., None] * across / np.maximum(length, 1e-300)
    at = faces.ravel()
    total = [np.bincount(at, pull[..., axis].ravel(), len(points)) for axis in range(3)]
    return unit(np.stack(total, axis=1))


def interpolated(normals: np.ndarray, corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return unit normals inside faces, between those of their corners."""
    return unit(np.einsum("nk,nkc->nc", weights, normals[corners]))


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of length one; those of length zero stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


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
