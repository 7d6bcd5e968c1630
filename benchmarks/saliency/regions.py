# SPDX-License-Identifier: GPL-3.0-or-later
"""What regions find on a machine part, and how steady they are.

The faces of a part are its triangles between sharp edges, those of more than 20 degrees. Agreement
is the adjusted Rand index (1: the same regions, 0: by chance) of the regions with the faces, over
the vertices on no sharp edge, and of the regions of a noisy or thinner model with those of the
model itself. Recall is the share of the sharp edges' vertices with a region's border within one
ring, precision the share of the borders' vertices with a sharp edge within one.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

import salcore
from benchmarks.common.page import table
from benchmarks.common.shapes import Shape

from .models import shuffled

SHARP = np.radians(20.0)
PART = "fandisk.obj"
MODELS = ("Laurana50k.ply", "bun_zipper.ply")
KINDS = ("islands", "basins", "components")


def adjusted_rand(first: np.ndarray, second: np.ndarray) -> float:
    """Return the adjusted Rand index of two labellings (Hubert and Arabie 1985)."""

    def pairs(sizes: np.ndarray) -> float:
        sizes = sizes.astype(float)
        return float((sizes * (sizes - 1) / 2).sum())

    both = pairs(np.unique(np.column_stack([first, second]), axis=0, return_counts=True)[1])
    one, two = (pairs(np.unique(labels, return_counts=True)[1]) for labels in (first, second))
    chance = one * two / max(pairs(np.array([len(first)])), 1.0)
    best = 0.5 * (one + two)
    return (both - chance) / (best - chance) if best > chance else 1.0


def part_faces(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the face of a part that each vertex lies on, and which are on sharp edges."""
    points, faces = shape.points, shape.faces
    a, b, c = points[faces.T]
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort(ends.T)
    ends, owner = ends[order], owner[order]
    same = np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    left, right = owner[same], owner[same + 1]
    cosine = np.einsum("ec,ec->e", normal[left], normal[right])
    sharp = cosine < np.cos(SHARP)
    size = (len(faces), len(faces))
    links = sparse.coo_array((np.ones((~sharp).sum()), (left[~sharp], right[~sharp])), shape=size)
    patch = csgraph.connected_components(links, directed=False)[1]
    label = np.empty(len(points), dtype=int)
    label[faces.ravel()] = np.repeat(patch, 3)
    edge = np.zeros(len(points), dtype=bool)
    edge[ends[same[sharp]].ravel()] = True
    return label, edge


def labels_of(analysis: salcore.Analysis, kind: str, **values: float) -> np.ndarray:
    """Return the regions of another kind; the analysis is not done again."""
    parameters = dataclasses.replace(analysis.parameters, segmentation=kind, **values)
    other = dataclasses.replace(analysis, parameters=parameters)
    other.__dict__["scales"] = analysis.scales
    return other.regions


def on_part(shape: Shape) -> str:
    """Return the table of how regions agree with the faces of a part."""
    face, edge = part_faces(shape)
    analysis = salcore.analyze(shape.points, shape.faces)
    near = analysis.graph.matrix()
    rows = []
    for kind in KINDS:
        labels = labels_of(analysis, kind)
        row = analysis.graph.rows()
        border = np.zeros(len(labels), dtype=bool)
        border[row[labels[row] != labels[analysis.graph.indices]]] = True
        recall = (border | (near @ border))[edge].mean()
        precision = (edge | (near @ edge))[border].mean()
        agreement = adjusted_rand(labels[~edge], face[~edge])
        count = labels.max() + 1
        figures = (f"{value:.2f}" for value in (agreement, recall, precision))
        rows.append([kind, f"{count}", *figures])
    head = [f"of {len(np.unique(face))} faces", "count", "agreement", "recall", "precision"]
    return table(head, rows)


def variants(shape: Shape) -> dict[str, tuple[salcore.Analysis, np.ndarray]]:
    """Return the model noisy and thinner, and which of its points each variant's are."""
    rng = np.random.default_rng(0)
    everything = np.arange(len(shape.points))
    quarter = np.sort(rng.choice(len(everything), len(everything) // 4, replace=False))
    result = {}
    for share in (0.0005, 0.001):
        noise = rng.normal(size=len(everything)) * share * shape.diagonal
        points = shape.points + noise[:, None] * shape.normals
        result[f"{share:.2%} noise"] = salcore.analyze(points, shape.faces), everything
    result["bare points"] = salcore.analyze(shape.points), everything
    result["a quarter of them"] = salcore.analyze(shape.points[quarter]), quarter
    moved, faces, order = shuffled(shape)
    result["another order"] = salcore.analyze(moved, faces), order
    return result


def steadiness(shape: Shape) -> str:
    """Return the table of how regions agree with those of the clean model."""
    analysis, others = salcore.analyze(shape.points, shape.faces), variants(shape)
    rows = []
    for kind in KINDS:
        labels = labels_of(analysis, kind)
        sizes = np.bincount(labels)
        values = [
            adjusted_rand(labels[which], labels_of(other, kind)) for other, which in others.values()
        ]
        largest = f"{sizes.max() / len(labels):.0%}"
        rows.append([kind, f"{len(sizes)}", largest, *(f"{value:.2f}" for value in values)])
    return table(["regions", "count", "largest", *others], rows)
