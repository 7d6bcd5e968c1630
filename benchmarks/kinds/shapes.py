# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshes, made by formulas: points (N, 3), triangles (F, 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Mesh(NamedTuple):
    """A mesh."""

    points: np.ndarray
    faces: np.ndarray


def lattice(columns: int, rows: int) -> Mesh:
    """Return a flat sheet over the unit square, of so many points each way."""
    x, y = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = np.arange(x.size).reshape(rows, columns)
    a, b = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel()
    c, d = corner[1:, :-1].ravel(), corner[1:, 1:].ravel()
    return Mesh(points, np.concatenate([np.c_[a, b, d], np.c_[a, d, c]]))


def joined(*meshes: Mesh) -> Mesh:
    """Return several meshes as one, unconnected."""
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, first[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.points for mesh in meshes]), np.concatenate(faces))


def trunk(around: int = 64, up: int = 124) -> Mesh:
    """Return a bumpy tube of height 10, open at both ends."""
    sheet = lattice(around + 1, up)
    angle, height = 2 * np.pi * sheet.points[:, 0], 10 * sheet.points[:, 1]
    radius = 0.5 + 0.05 * np.sin(7 * angle) * np.sin(3 * height)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    column = np.arange(len(points)) % (around + 1)
    closed = np.where(column == around, np.arange(len(points)) - around, np.arange(len(points)))
    used, faces = np.unique(closed[sheet.faces], return_inverse=True)
    return Mesh(points[used], faces.reshape(-1, 3))


def leaves(count: int = 3000, side: float = 0.2) -> Mesh:
    """Return square cards of two triangles in all directions, round the top of the trunk."""
    rng = np.random.default_rng(0)
    centre = rng.normal(size=(count, 3)) * [1.5, 1.5, 1.5] + [0, 0, 11]
    across, up, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0].transpose(1, 0, 2)
    corners = [centre + 0.5 * side * (s * across + t * up) for s in (-1, 1) for t in (-1, 1)]
    points = np.stack(corners, axis=1).reshape(-1, 3)
    card = np.array([[0, 1, 3], [0, 3, 2]])
    faces = (4 * np.arange(count)[:, None, None] + card).reshape(-1, 3)
    return Mesh(points, faces)


def tree() -> Mesh:
    """Return a trunk with leaves."""
    return joined(trunk(), leaves())


def plate() -> Mesh:
    """Return a flat sheet with a round hole."""
    sheet = lattice(152, 152)
    middle = sheet.points[sheet.faces].mean(axis=1)
    left = np.hypot(middle[:, 0] - 0.5, middle[:, 1] - 0.5) > 0.16
    used, faces = np.unique(sheet.faces[left], return_inverse=True)
    return Mesh(sheet.points[used], faces.reshape(-1, 3))


def box(steps: int) -> Mesh:
    """Return a closed box of six square lattices, turned so that no side lies along an axis."""
    sheet = lattice(steps + 1, steps + 1)
    u, v = sheet.points[:, 0], sheet.points[:, 1]
    sides = []
    for axis in range(3):
        for end in (0.0, 1.0):
            points = np.insert(np.stack([u, v], axis=1), axis, end, axis=1)
            outward = (end == 1.0) == (axis != 1)
            sides.append(Mesh(points, sheet.faces if outward else sheet.faces[:, ::-1]))
    points, faces = joined(*sides)
    key = np.rint(points * steps).astype(np.int64)
    first, place = np.unique(key, axis=0, return_index=True, return_inverse=True)[1:]
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return Mesh(points[first] @ turn, place.ravel()[faces])


def checker(mesh: Mesh, fields: int = 8) -> np.ndarray:
    """Return a colour a point, (N, 3) in 0 to 255: black and white fields over x and y."""
    field = np.floor(mesh.points[:, :2] * fields * 0.9999).sum(axis=1)
    return np.repeat(255.0 * (field % 2), 3).reshape(-1, 3)


def charts(mesh: Mesh, boxes: int) -> np.ndarray:
    """Return texture coordinates of corners, (F, 3, 2): a chart for each of so many boxes a side.

    Faces are drawn into their box's chart as seen along z; neighbouring boxes lie apart in the
    texture, so that their borders are seams.
    """
    flat = mesh.points[:, :2] - mesh.points[:, :2].min(axis=0)
    flat = flat / flat.max()
    corner = flat[mesh.faces]
    box = np.floor(corner.mean(axis=1) * boxes * 0.9999)
    return corner + box[:, None, :]
