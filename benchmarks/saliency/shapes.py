# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes made by formulas, on which it is known what stands out: a word, fillets, pockets."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

STROKES = {
    "A": [[(0, 0), (1, 3), (2, 0)], [(0.4, 1.2), (1.6, 1.2)]],
    "E": [[(2, 0), (0, 0), (0, 3), (2, 3)], [(0, 1.5), (1.6, 1.5)]],
    "I": [[(1, 0), (1, 3)]],
    "L": [[(0, 3), (0, 0), (2, 0)]],
    "N": [[(0, 0), (0, 3), (2, 0), (2, 3)]],
    "S": [[(0, 0), (2, 0), (2, 1.5), (0, 1.5), (0, 3), (2, 3)]],
    "T": [[(1, 0), (1, 3)], [(0, 3), (2, 3)]],
}
"""Letters as lines on a field of 2 by 3."""
RADII = (0.0025, 0.005, 0.01, 0.02)
"""Radii of the fillets, as shares of the diagonal."""
CLEAR = 0.02
"""Distance from all features, as a share of the diagonal, from which a point is clearly off."""


class Known(NamedTuple):
    """A mesh with what is known of it: its features, and what is clearly none.

    `part` numbers the features: letters, fillets or pockets; -1 elsewhere.
    """

    points: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    feature: np.ndarray
    off: np.ndarray
    part: np.ndarray

    @property
    def diagonal(self) -> float:
        """Return the diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def engraved_sphere(count: int, word: str = "SALIENT") -> Known:
    """Return a sphere of radius 1 with a word engraved along its equator.

    The strokes are 0.015 deep and 0.06 wide; their walls, 0.03 wide, are the features.
    """
    i = np.arange(count) + 0.5
    polar, around = np.arccos(1 - 2 * i / count), (np.pi * (1 + 5**0.5) * i) % (2 * np.pi)
    x, y = around - np.pi, np.pi / 2 - polar
    distance, part = np.full(count, np.inf), np.full(count, -1)
    for k, letter in enumerate(word):
        corner = np.array([(k - len(word) / 2) * 0.6 + 0.1, -0.3])
        for line in STROKES[letter]:
            line = np.array(line, dtype=float) * 0.2 + corner
            for a, b in pairwise(line):
                near = _to_segment(np.column_stack([x, y]), a, b)
                part = np.where(near < np.minimum(distance, 0.06), k, part)
                distance = np.minimum(distance, near)
    depth = 0.015 * _ramp((0.06 - distance) / 0.03)
    direction = np.column_stack(
        [np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)]
    )
    points, faces = direction * (1.0 - depth[:, None]), ConvexHull(direction).simplices
    faces = _outward(direction, faces)
    diagonal = 12**0.5
    feature = (distance > 0.025) & (distance < 0.065)
    off = distance > 0.06 + CLEAR * diagonal
    return Known(points, faces, _normals(points, faces), feature, off, np.where(feature, part, -1))


def fillets(count: int) -> Known:
    """Return a folded sheet whose four bends of 30 degrees have radii from 0.25 to 2 %."""
    diagonal, bend, flat = 1.0, np.pi / 6, 0.22
    lengths, curvature, labels = [flat], [0.0], [-1]
    for k, radius in enumerate(RADII):
        lengths += [radius * diagonal * bend, flat]
        curvature += [(-1) ** k / (radius * diagonal), 0.0]
        labels += [k, -1]
    ends = np.cumsum(lengths)
    rng = np.random.default_rng(1)
    rows = int(np.sqrt(count * 0.5 / ends[-1]))
    s, v = _scattered(ends[-1], 0.5, count, rng, rows)
    fine = np.linspace(0.0, ends[-1], 20001)
    angle = np.append(0.0, np.cumsum(_at(fine[:-1], ends, curvature) * np.diff(fine))) - bend / 2
    step = np.diff(fine)
    across = np.append(0.0, np.cumsum(np.cos(angle[:-1]) * step))
    up = np.append(0.0, np.cumsum(np.sin(angle[:-1]) * step))
    points = np.column_stack([np.interp(s, fine, across), v, np.interp(s, fine, up)])
    faces = Delaunay(np.column_stack([s, v])).simplices
    size = np.linalg.norm(np.ptp(points, axis=0))
    part = _at(s, ends, labels).astype(int)
    starts = np.append(0.0, ends[:-1])
    away = np.min(
        [np.maximum(np.maximum(starts[k] - s, s - ends[k]), 0.0) for k in range(1, 9, 2)], axis=0
    )
    feature = part >= 0
    return Known(points, faces, _normals(points, faces), feature, away > CLEAR * size, part)


def pockets(count: int) -> Known:
    """Return a plate with nine round pockets of several sizes and depths; rims are the features."""
    rng = np.random.default_rng(2)
    x, y = _scattered(1.0, 1.0, count, rng, int(np.sqrt(count)))
    height, part = np.zeros(count), np.full(count, -1)
    away = np.full(count, np.inf)
    for k in range(9):
        radius, depth = 0.02 * 1.25**k, (0.003, 0.006, 0.012)[k % 3]
        centre = np.array([1 + 2 * (k % 3), 1 + 2 * (k // 3)]) / 6
        distance = np.hypot(x - centre[0], y - centre[1]) - radius
        height -= depth * np.clip(0.5 - distance / depth, 0.0, 1.0)
        rim = np.abs(np.abs(distance) - 0.5 * depth)
        part = np.where(rim < 0.006, k, part)
        away = np.minimum(away, rim)
    points = np.column_stack([x, y, height])
    faces = Delaunay(points[:, :2]).simplices
    off = away > CLEAR * np.linalg.norm(np.ptp(points, axis=0))
    return Known(points, faces, _normals(points, faces), part >= 0, off, part)


SHAPES = {"engraved sphere": engraved_sphere, "fillets": fillets, "pockets": pockets}


def with_noise(shape: Known, share: float, half: bool = False, seed: int = 0) -> np.ndarray:
    """Return the points with Gaussian noise along the normals, a share of the diagonal.

    With `half`, only the half of the points with the larger second coordinate.
    """
    noise = np.random.default_rng(seed).normal(size=len(shape.points)) * share * shape.diagonal
    if half:
        noise[shape.points[:, 1] < np.median(shape.points[:, 1])] = 0.0
    return shape.points + noise[:, None] * shape.normals


def _ramp(t: np.ndarray) -> np.ndarray:
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - along[:, None] * (b - a), axis=1)


def _at(s: np.ndarray, ends: np.ndarray, values: list) -> np.ndarray:
    """Return the value of the stretch that each place lies in."""
    return np.array(values)[np.minimum(np.searchsorted(ends, s), len(ends) - 1)]


def _scattered(
    width: float, height: float, count: int, rng: np.random.Generator, rows: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return points on a lattice, each moved at random within its cell; borders stay straight."""
    columns = -(-count // rows)
    i = np.arange(count)
    column, row = i // rows, i % rows
    jitter = 0.5 * (rng.random((2, count)) - 0.5)
    jitter[0, (column == 0) | (column == columns - 1)] = 0.0
    jitter[1, (row == 0) | (row == rows - 1)] = 0.0
    return (
        width * (column + jitter[0]) / (columns - 1),
        height * (row + jitter[1]) / (rows - 1),
    )


def _outward(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = points[faces.T]
    inward = np.einsum("mc,mc->m", np.cross(b - a, c - a), a) < 0
    return np.where(inward[:, None], faces[:, ::-1], faces)


def _normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals, weighted by area."""
    a, b, c = points[faces.T]
    across, corner = np.tile(np.cross(b - a, c - a), (3, 1)), faces.T.ravel()
    normals = np.stack([np.bincount(corner, across[:, k], len(points)) for k in range(3)], axis=1)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
