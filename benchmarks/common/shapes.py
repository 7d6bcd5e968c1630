# SPDX-License-Identifier: GPL-3.0-or-later
"""What benchmarks measure on: a model's points, faces, normals and features, from file to arrays.

Needs numpy and scipy alone, except for reading model files, so that every peer's process can load
a shape without other peers' libraries.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.common.models import load


class Shape(NamedTuple):
    """A model: its points, its faces or None, a unit normal and a measure of bend at each point."""

    points: np.ndarray
    faces: np.ndarray | None
    normals: np.ndarray
    bend: np.ndarray

    @property
    def diagonal(self) -> float:
        """Return the diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def features(self) -> np.ndarray:
        """Return the tenth of the points where the surface bends most."""
        return np.flatnonzero(self.bend >= np.quantile(self.bend, 0.9))

    def save(self, path: Path) -> None:
        """Write the arrays; no faces are an empty array."""
        faces = np.empty((0, 3), dtype=np.int64) if self.faces is None else self.faces
        np.savez(path, points=self.points, faces=faces, normals=self.normals, bend=self.bend)


def saved(path: Path) -> Shape:
    """Return a shape that was saved."""
    with np.load(path) as arrays:
        faces = arrays["faces"]
        return Shape(
            arrays["points"],
            faces if len(faces) else None,
            arrays["normals"],
            arrays["bend"],
        )


def read(path: Path) -> Shape:
    """Return a model's shape, centred; of a mesh without the points that no face uses.

    Centred, because several peers work in single precision. Equal points of a mesh are one, so
    that every method counts the same.
    """
    points, faces = load(path)
    if faces is not None:
        first, copy_of = np.unique(points, axis=0, return_index=True, return_inverse=True)[1:]
        faces = first[copy_of.ravel()][faces]
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        used, faces = np.unique(faces, return_inverse=True)
        points, faces = points[used], faces.reshape(-1, 3).astype(np.int64)
    points = points - (points.min(axis=0) + points.max(axis=0)) / 2
    return cloud_shape(points) if faces is None else mesh_shape(points, faces)


def mesh_shape(points: np.ndarray, faces: np.ndarray) -> Shape:
    """Return a mesh's shape; bend is the largest angle between a normal and a neighbour's."""
    a, b, c = points[faces.T]
    across = np.cross(b - a, c - a)
    corner = faces.T.ravel()
    normals = np.stack(
        [np.bincount(corner, np.tile(across[:, k], 3), len(points)) for k in range(3)], axis=1
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    start, end = corner, np.roll(faces, -1, axis=1).T.ravel()
    angle = np.arccos(np.clip(np.einsum("ec,ec->e", normals[start], normals[end]), -1, 1))
    bend = np.zeros(len(points))
    np.maximum.at(bend, start, angle)
    np.maximum.at(bend, end, angle)
    return Shape(points, faces, normals, bend)


def cloud_shape(points: np.ndarray, neighbors: int = 16) -> Shape:
    """Return a cloud's shape; bend is the share of its nearest points' spread across their plane.

    Normals are those planes' and have no sign.
    """
    tree = cKDTree(points)
    normals, bend = np.empty_like(points), np.empty(len(points))
    for begin in range(0, len(points), 50_000):
        block = slice(begin, begin + 50_000)
        near = points[tree.query(points[block], k=neighbors, workers=-1)[1]]
        near = near - near.mean(axis=1, keepdims=True)
        values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))
        normals[block] = vectors[:, :, 0]
        bend[block] = values[:, 0] / np.maximum(values.sum(axis=1), 1e-300)
    return Shape(points, None, normals, bend)


def part(shape: Shape, count: int) -> Shape:
    """Return some of a cloud's points, drawn at random: the same scene, sampled less."""
    drawn = np.random.default_rng(0).choice(len(shape.points), count, replace=False)
    drawn.sort()
    return Shape(shape.points[drawn], None, shape.normals[drawn], shape.bend[drawn])


def example(side: int = 40) -> Shape:
    """Return a small wavy sheet: every peer's first call, which loads things, is made on it."""
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    points = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)
    corner = np.arange(side * side).reshape(side, side)
    rows = corner[:-1], corner[1:]
    a, b, c, d = (half.ravel() for row in rows for half in (row[:, :-1], row[:, 1:]))
    return mesh_shape(points, np.concatenate([np.c_[a, b, c], np.c_[b, d, c]]))
