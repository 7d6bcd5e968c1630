# SPDX-License-Identifier: GPL-3.0-or-later
"""Methods that choose points: simple samplings, and the classes that the paper's section 1 names.

Those that use normals or bend get them for nothing. Clusters are worth what they cost: each keeps
the point nearest to its centre, so that every result is a subset.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.common.shapes import Shape
from benchmarks.peers.registry import NEAR, OURS, Outcome, Ready, Unreachable, halve, method, seek


def chosen(indices: np.ndarray) -> Outcome:
    """Return a subset as an outcome."""
    return Outcome(indices=np.unique(np.asarray(indices, dtype=np.int64)))


def snapped(shape: Shape, points: np.ndarray) -> Outcome:
    """Return points of a method's own; the original points nearest to them stand for them."""
    return Outcome(points=points, indices=np.unique(cKDTree(shape.points).query(points)[1]))


def nearest_of_cells(features: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Return the point nearest to the mean of each cell."""
    cell = np.unique(cell, return_inverse=True)[1].ravel()
    share = 1 / np.bincount(cell)
    mean = np.stack([np.bincount(cell, column) * share for column in features.T], axis=1)
    order = np.lexsort((((features - mean[cell]) ** 2).sum(axis=1), cell))
    return order[np.append(True, np.diff(cell[order]) > 0)]


def lines(normals: np.ndarray) -> np.ndarray:
    """Return six numbers for each normal, whose distances are those of lines: the sign is lost."""
    x, y, z = normals.T
    root = np.sqrt(2)
    return np.stack([x * x, y * y, z * z, root * x * y, root * y * z, root * z * x], axis=1)


def clustered(
    features: np.ndarray, weights: np.ndarray, seeds: np.ndarray, rounds: int = 5
) -> np.ndarray:
    """Return the points nearest to the centres of clusters (Lloyd's k-means on a k-d tree)."""
    centres = features[seeds]
    for _ in range(rounds):
        cell = cKDTree(centres).query(features, workers=-1)[1]
        total = np.maximum(np.bincount(cell, weights, len(centres)), 1e-300)
        sums = [np.bincount(cell, weights * column, len(centres)) for column in features.T]
        mean = np.stack(sums, axis=1) / total[:, None]
        centres = np.where(total[:, None] > 1e-300, mean, centres)
    return nearest_of_cells(features, cKDTree(centres).query(features, workers=-1)[1])


@method("random", "numpy")
def random(shape: Shape, count: int) -> Ready:
    """Draw points."""
    return Ready(
        lambda: np.random.default_rng(0).choice(len(shape.points), count, replace=False), chosen
    )


@method("voxel grid", "open3d")
def voxel(shape: Shape, count: int) -> Ready:
    """Take the mean of each cell of a grid."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(shape.points))
    side = seek(
        lambda side: len(cloud.voxel_down_sample(side).points),
        count,
        shape.diagonal / count**0.5,
        -2,
    )
    return Ready(
        lambda: cloud.voxel_down_sample(side),
        lambda result: snapped(shape, np.asarray(result.points)),
    )


@method("farthest point", "fpsample")
def farthest(shape: Shape, count: int) -> Ready:
    """Take the farthest point again and again (Moenning and Dodgson's class)."""
    import fpsample

    points = shape.points.astype(np.float32)
    height = 7 if len(points) > 20_000 else 5
    return Ready(
        lambda: fpsample.bucket_fps_kdline_sampling(points, count, h=height, start_idx=0), chosen
    )


@method("Poisson disk", "pymeshlab")
def poisson(shape: Shape, count: int) -> Ready:
    """Take points no two of which are close."""
    import pymeshlab

    def sample(number: float) -> np.ndarray:
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(shape.points))
        meshes.generate_simplified_point_cloud(samplenum=int(number), bestsampleflag=True)
        return meshes.current_mesh().vertex_matrix()

    number = seek(lambda number: len(sample(number)), count, count, 1)
    return Ready(lambda: sample(number), lambda result: snapped(shape, result))


@method("hierarchy", "cgal", most=500_000)
def hierarchy(shape: Shape, count: int) -> Ready:
    """Split clusters by their variation (Pauly's class)."""
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Point_set_processing_3 import hierarchy_simplify_point_set

    largest = 3 * len(shape.points) // count

    original = Point_set_3()
    for point in shape.points.tolist():
        original.insert(Point_3(*point))

    def cloud() -> Point_set_3:
        result = Point_set_3()
        result.join(original)
        return result

    def simplified(variation: float) -> Point_set_3:
        result = cloud()
        hierarchy_simplify_point_set(result, largest, variation)
        result.collect_garbage()
        return result

    def read(result: Point_set_3) -> Outcome:
        found = (result.point(i) for i in result.indices())
        return snapped(shape, np.array([(p.x(), p.y(), p.z()) for p in found]))

    variation = halve(lambda value: simplified(value).size(), count, 1e-7, 0.33)
    begun = cloud()

    def work() -> Point_set_3:
        hierarchy_simplify_point_set(begun, largest, variation)
        begun.collect_garbage()
        return begun

    return Ready(work, read)


@method("k-means with normals", "scipy", most=200_000)
def means_with_normals(shape: Shape, count: int) -> Ready:
    """Cluster places and normals together (Shi's class)."""
    spacing = shape.diagonal / count**0.5
    features = np.hstack([shape.points / spacing, lines(shape.normals)])
    seeds = np.random.default_rng(0).choice(len(features), count, replace=False)
    return Ready(lambda: clustered(features, np.ones(len(features)), seeds), chosen)


@method("curvature-weighted clusters", "scipy", most=200_000)
def curvature_weighted(shape: Shape, count: int) -> Ready:
    """Cluster with more seeds and more weight where the surface bends (Miao's class)."""
    weights = shape.bend / shape.bend.mean() + 0.2
    seeds = np.random.default_rng(0).choice(
        len(weights), count, replace=False, p=weights / weights.sum()
    )
    return Ready(lambda: clustered(shape.points, weights, seeds), chosen)


@method("grid with normals", "numpy")
def grid_with_normals(shape: Shape, count: int) -> Ready:
    """Split a grid's cells while their normals differ (Lee's class)."""
    least, side = shape.points.min(axis=0), np.ptp(shape.points, axis=0).max() * 1.001
    normals = lines(shape.normals)

    def cells_at(level: int, points: np.ndarray) -> np.ndarray:
        x, y, z = ((shape.points[points] - least) / side * 2**level).astype(np.int64).T
        return np.unique((x << 40) + (y << 20) + z, return_inverse=True)[1].ravel()

    everything = np.arange(len(shape.points))
    first = 1
    while cells_at(first + 1, everything).max() + 1 < count / 2:
        first += 1

    def cells(spread: float) -> np.ndarray:
        label, left, used = np.zeros(len(everything), dtype=np.int64), everything, 0
        for level in range(first, first + 4):
            cell = cells_at(level, left)
            share = 1 / np.bincount(cell)
            mean = np.stack([np.bincount(cell, n[left]) * share for n in normals.T], axis=1)
            label[left] = used + cell
            used += len(share)
            left = left[(1 - (mean**2).sum(axis=1) > spread)[cell]]
        return label

    spread = halve(lambda value: len(np.unique(cells(value))), count, 1e-7, 1)
    return Ready(lambda: nearest_of_cells(shape.points, cells(spread)), chosen)


@method("ours, cloud", OURS)
def ours_cloud(shape: Shape, count: int) -> Ready:
    """Order all points by elimination; faces are not looked at."""
    import salcore

    return Ready(lambda: chosen(salcore.simplify(shape.points, count=count).indices))


@method("ours, threshold α", OURS, most=200_000)
def ours_threshold(shape: Shape, count: int) -> Ready:
    """Keep the paper's interest points, with the narrowest guard against gaps that allows it."""
    import salcore

    analysis = salcore.analyze(shape.points, shape.faces)
    least = len(shape.points)
    for gap in (1, 2, 3, 4, 6, 8, 0):
        parameters = dataclasses.replace(salcore.Parameters(), max_gap=gap)
        guarded = dataclasses.replace(analysis, parameters=parameters)
        least = min(least, len(guarded.simplify(alpha=100).indices))
        if least > count * (1 + 10 * NEAR):
            continue
        alpha = halve(lambda a, g=guarded: len(g.simplify(alpha=a).indices), count, 0.01, 100)

        def work(alpha: float = alpha, chosen_parameters: object = parameters) -> Outcome:
            result = salcore.simplify(
                shape.points, shape.faces, parameters=chosen_parameters, alpha=alpha
            )
            return chosen(result.indices)

        return Ready(work)
    raise Unreachable(f"keeps {least} points at the least")
