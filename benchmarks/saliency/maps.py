# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of saliency: ours and its peers, each from points and faces to one value a point."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

import salcore

Map = Callable[[np.ndarray, np.ndarray | None], np.ndarray]


def every_scale(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
    """Return our saliency."""
    return salcore.analyze(points, faces).saliency


def one_level(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
    """Return our saliency at the neighbours' distance alone."""
    return salcore.analyze(points, faces, parameters=salcore.Parameters(coarsest=0.0)).saliency


def paper(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
    """Return the published formulas' saliency."""
    return salcore.analyze(points, faces, parameters=salcore.Parameters.preset("paper")).saliency


def mean_curvature(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
    """Return |mean curvature| over one ring."""
    analysis = salcore.analyze(points, faces)
    return np.abs(analysis.frames.curvature)[analysis.geometry.vertex_of]


def lee(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
    """Return mesh saliency (Lee, Varshney and Jacobs, SIGGRAPH 2005).

    Differences of Gaussian means of the mean curvature at five scales from 0.6 to 1.8 % of the
    diagonal, each weighted by the square of its largest value less its mean.
    """
    analysis = salcore.analyze(points, faces)
    curvature = analysis.frames.curvature[analysis.geometry.vertex_of]
    unit = 0.003 * np.linalg.norm(np.ptp(points, axis=0))
    means = {s: _gaussian_mean(points, curvature, s * unit) for s in (2, 3, 4, 5, 6, 8, 10, 12)}
    total = np.zeros(len(points))
    for s in (2, 3, 4, 5, 6):
        scale = np.abs(means[s] - means[2 * s])
        scale /= max(scale.max(), 1e-300)
        total += scale * (1.0 - scale.mean()) ** 2
    return total


def _gaussian_mean(points: np.ndarray, values: np.ndarray, sigma: float) -> np.ndarray:
    """Return means with Gaussian weights within two standard deviations, block by block."""
    tree, result = cKDTree(points), np.empty(len(points))
    for start in range(0, len(points), 2000):
        block = slice(start, start + 2000)
        near = cKDTree(points[block]).sparse_distance_matrix(tree, 2 * sigma, output_type="ndarray")
        weight = np.exp(-(near["v"] ** 2) / (2 * sigma**2))
        size = len(points[block])
        total = np.bincount(near["i"], weight * values[near["j"]], size)
        result[block] = total / np.bincount(near["i"], weight, size)
    return result


def surface_variation(neighbors: int) -> Map:
    """Return the map of surface variation (Pauly, Gross and Kobbelt 2002) over nearest points."""

    def measure(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
        near = points[cKDTree(points).query(points, k=neighbors)[1]]
        near = near - near.mean(axis=1, keepdims=True)
        values = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", near, near))
        return values[:, 0] / np.maximum(values.sum(axis=1), 1e-300)

    return measure


def normal_variation(share: float) -> Map:
    """Return the map of how much normals vary within a radius, a share of the diagonal."""

    def measure(points: np.ndarray, faces: np.ndarray | None) -> np.ndarray:
        normals = salcore.analyze(points, faces).normals
        radius = share * np.linalg.norm(np.ptp(points, axis=0))
        tree = cKDTree(points)
        near = tree.sparse_distance_matrix(tree, radius, output_type="ndarray")
        ends, shape = (near["i"], near["j"]), (len(points), len(points))
        total = sparse.coo_array((np.ones(len(near)), ends), shape=shape).tocsr() @ normals
        return 1.0 - np.linalg.norm(total, axis=1) / np.bincount(near["i"], minlength=len(points))

    return measure


OURS: dict[str, Map] = {"every scale": every_scale, "one level": one_level}
PEERS: dict[str, Map] = {
    "preset paper": paper,
    "absolute mean curvature": mean_curvature,
    "Lee 2005": lee,
    "surface variation, 16": surface_variation(16),
    "surface variation, 64": surface_variation(64),
    "normal variation, 1 %": normal_variation(0.01),
    "normal variation, 2 %": normal_variation(0.02),
    "normal variation, 4 %": normal_variation(0.04),
}
