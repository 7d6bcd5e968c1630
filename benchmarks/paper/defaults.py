# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurements behind the default parameters (the tables of docs/method.md).

    python benchmarks/defaults.py [--models FOLDER] [--only noise|selection]

noise: rank correlation between the saliency of a clean mesh and of the same mesh with Gaussian
noise, and between a mesh and its bare points. selection: surface error of the kept points as a
share of that of a random choice of equally many, by the dual of the kept points' cells on the mesh.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import numpy as np
import pymeshlab
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.stats import spearmanr

import salcore
from salcore.distances import surface_distances
from salcore.planes import vertex_normals

DEFAULT = salcore.Parameters()
PRINTED = dataclasses.replace(DEFAULT, contrast="difference", averaging="plain")
MAPS = {
    "difference, step at 3": dataclasses.replace(PRINTED, counting="step", deviation_threshold=3),
    "difference, ramp to 9": PRINTED,
    "default": DEFAULT,
}
SELECTIONS = {
    "tolerance 0.03, 30 degrees, guard 1": {"tolerance": 0.03, "collinear_angle": 30},
    "tolerance 0.05, 30 degrees, guard 1": {"tolerance": 0.05, "collinear_angle": 30},
    "default": {},
    "tolerance 0.05, 30 degrees, guard 2": {
        "tolerance": 0.05,
        "collinear_angle": 30,
        "max_gap": 2,
    },
    "tolerance 0.05, 30 degrees, no guard": {
        "tolerance": 0.05,
        "collinear_angle": 30,
        "max_gap": 0,
    },
}


def load(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the points that faces use, and the faces."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    used, faces = np.unique(mesh.face_matrix(), return_inverse=True)
    return mesh.vertex_matrix()[used], faces.reshape(-1, 3)


def noise(points: np.ndarray, faces: np.ndarray) -> None:
    """Print how well each map holds against noise and without faces."""
    rng = np.random.default_rng(0)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    noisy = [points + rng.normal(size=points.shape) * share * diagonal for share in (0.0005, 0.001)]
    for name, parameters in MAPS.items():
        clean = salcore.analyze(points, faces, parameters=parameters).saliency_map.raw
        others = [salcore.analyze(p, faces, parameters=parameters) for p in noisy]
        others.append(salcore.analyze(points, parameters=parameters))
        values = [spearmanr(clean, other.saliency_map.raw).statistic for other in others]
        print(
            f"  {name:24} noise 0.05 %: {values[0]:5.2f}   0.1 %: {values[1]:5.2f}   "
            f"bare points: {values[2]:5.2f}"
        )


def dual_errors(points: np.ndarray, faces: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return each vertex's distance to the dual of the kept vertices' cells on the mesh."""
    start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    length = np.linalg.norm(points[start] - points[end], axis=1)
    graph = sparse.csr_array((length, (start, end)), shape=(len(points),) * 2)
    graph = graph.maximum(graph.T)
    source = dijkstra(graph, indices=kept, min_only=True, return_predecessors=True)[2]
    cells = source[faces]
    a, b, c = cells.T
    cells = cells[(a != b) & (b != c) & (c != a) & (cells >= 0).all(axis=1)].astype(np.intp)
    surface = salcore.Surface(points, cells)
    bound = np.linalg.norm(points - points[np.where(source >= 0, source, kept[0])], axis=1)
    return surface_distances(points, surface, bound)


def features(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the tenth of the vertices whose normals differ most from a neighbour's."""
    normals = vertex_normals(points, faces)
    start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    angle = np.arccos(np.clip(np.einsum("ec,ec->e", normals[start], normals[end]), -1, 1))
    largest = np.zeros(len(points))
    np.maximum.at(largest, np.concatenate([start, end]), np.concatenate([angle, angle]))
    return largest >= np.quantile(largest, 0.9)


def selection(points: np.ndarray, faces: np.ndarray, alpha: float = 30.0) -> None:
    """Print the error of each selection as a share of that of a random one."""
    rng, feature = np.random.default_rng(0), features(points, faces)
    variants = {name: dataclasses.replace(DEFAULT, **kw) for name, kw in SELECTIONS.items()}
    variants["preset paper"] = salcore.Parameters.preset("paper")
    for name, parameters in variants.items():
        kept = salcore.simplify(points, faces, parameters=parameters, alpha=alpha).indices
        chance = rng.choice(len(points), len(kept), replace=False)
        ours, random = (dual_errors(points, faces, k) for k in (kept, chance))
        overall = np.sqrt(np.mean(ours**2) / np.mean(random**2))
        at_features = np.sqrt(np.mean(ours[feature] ** 2) / np.mean(random[feature] ** 2))
        print(
            f"  {name:38} kept {len(kept) / len(points):4.0%}   "
            f"all {overall:5.2f}   features {at_features:5.2f}"
        )


def main() -> None:
    """Run the chosen measurements on Bunny, Laurana and Rocker arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=Path, default=Path("../shared/models"))
    parser.add_argument("--only", choices=["noise", "selection"])
    options = parser.parse_args()
    for name in ("bun_zipper.ply", "Laurana50k.ply", "rockerArm.ply"):
        points, faces = load(options.models / name)
        print(name)
        if options.only != "selection":
            noise(points, faces)
        if options.only != "noise":
            selection(points, faces)


if __name__ == "__main__":
    main()
