# SPDX-License-Identifier: GPL-3.0-or-later
"""Subjects for pictures, made by formula: a stone head, a façade, a flange, a barrel."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import Delaunay

Floats = NDArray[np.float64]
Faces = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """A mesh with colours of its points, and a number for the material of each face."""

    points: Floats
    faces: Faces
    colors: Floats
    materials: NDArray[np.int64]


def grid_faces(rows: int, columns: int, *, closed: bool) -> Faces:
    """Return the faces (m, 3) of a grid of points whose columns may meet."""
    across = columns if closed else columns - 1
    row, column = (x.ravel() for x in np.mgrid[: rows - 1, :across])
    right = (column + 1) % columns
    a, b = row * columns + column, row * columns + right
    c, d = a + columns, b + columns
    return np.concatenate([np.column_stack([a, b, d]), np.column_stack([a, d, c])])


def joined(*meshes: Mesh) -> Mesh:
    """Return meshes as one."""
    begins = np.cumsum([0, *(len(mesh.points) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.faces + k for mesh, k in zip(meshes, begins, strict=True)]),
        np.concatenate([mesh.colors for mesh in meshes]),
        np.concatenate([mesh.materials for mesh in meshes]),
    )


def bump(x: Floats, y: Floats, place: Any, size: Any, power: float = 2.0) -> Floats:
    """Return a bump of height one at a place of the face; a high power has steep sides."""
    (a, b), (c, d) = place, size
    distance = ((x - a) / c) ** 2 + ((y - b) / d) ** 2
    return np.asarray(np.exp(-(distance ** (0.5 * power))))


def step(x: Floats) -> Floats:
    """Return a smooth step from zero to one."""
    return np.asarray(0.5 + 0.5 * np.tanh(x))


def head(rows: int = 170, columns: int = 250, rough: float = 0.0025) -> Mesh:
    """Return a stone head with combed hair, seen from the front along -z."""
    down, around = np.meshgrid(
        np.linspace(0.02, np.pi - 0.02, rows),
        np.linspace(-np.pi, np.pi, columns, endpoint=False),
        indexing="ij",
    )
    x, y, z = np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)
    side, front = np.abs(x), step(5.0 * z)
    nose = np.clip((0.3 - y) / 0.5, 0.0, 1.0)
    face = (
        -0.10 * bump(side, y, (0.30, 0.20), (0.17, 0.10))
        + 0.080 * bump(side, y, (0.30, 0.17), (0.13, 0.075), 4.0)
        - 0.022 * bump(side, y, (0.30, 0.16), (0.12, 0.010))
        + 0.08 * bump(side, y, (0.27, 0.35), (0.24, 0.045))
        + (0.05 + 0.22 * nose) * np.exp(-((x / (0.05 + 0.09 * nose)) ** 2))
        * step(28.0 * (y + 0.21)) * step(12.0 * (0.34 - y))
        + 0.06 * bump(side, y, (0.125, -0.16), (0.045, 0.05))
        + 0.075 * bump(x, y, (0.0, -0.40), (0.20, 0.040))
        + 0.070 * bump(x, y, (0.0, -0.505), (0.16, 0.045))
        - 0.055 * bump(x, y, (0.0, -0.452), (0.22, 0.012))
        + 0.09 * bump(x, y, (0.0, -0.74), (0.20, 0.10))
        + 0.05 * bump(side, y, (0.42, -0.10), (0.18, 0.16))
    )  # fmt: skip
    ear = 0.20 * bump(z, y, (-0.02, 0.06), (0.07, 0.20), 4.0)
    ear -= 0.10 * bump(z, y, (0.0, 0.06), (0.035, 0.12), 4.0)
    hair = step(16.0 * (y - 0.64 + 0.9 * np.clip(0.7 - z, 0.0, 1.4)))
    comb = np.abs(np.sin(17.0 * x + 3.0 * np.sin(5.0 * y) + 2.0 * np.sin(4.0 * z)))
    noise = np.random.default_rng(0).normal(size=x.shape)
    height = face * front + ear * step(12.0 * (side - 0.8)) + hair * (0.05 + 0.05 * comb)
    height += rough * gaussian_filter(noise, 1.0, mode="wrap") / 0.28
    jaw = 1.0 - 0.22 * np.clip(-y, 0.0, 1.0) ** 1.5
    scale = np.array([0.78, 1.08, 0.92])
    points = (1.0 + height)[..., None] * np.stack([x * jaw, y, z * jaw], axis=-1) * scale
    skin, lips = np.array([0.80, 0.62, 0.50]), np.array([0.72, 0.32, 0.30])
    colors = np.broadcast_to(skin, (*x.shape, 3)).copy()
    white = bump(side, y, (0.30, 0.17), (0.11, 0.06), 8.0) * front
    iris = bump(side, y, (0.30, 0.17), (0.048, 0.052), 8.0) * front
    mouth = bump(x, y, (0.0, -0.455), (0.20, 0.085), 4.0) * front
    brow = bump(side, y, (0.28, 0.37), (0.19, 0.03), 4.0) * front
    for share, paint in (
        (mouth, lips),
        (white, [0.95, 0.94, 0.9]),
        (iris, [0.15, 0.3, 0.25]),
        (np.maximum(brow, hair), [0.30, 0.18, 0.10]),
    ):
        colors += share[..., None] * (np.asarray(paint) - colors)
    faces = grid_faces(rows, columns, closed=True)[:, ::-1]
    return _flat(points, faces, colors)


def _flat(points: Floats, faces: Faces, colors: Floats, material: int = 0) -> Mesh:
    """Return a mesh of points in a grid."""
    faces = np.ascontiguousarray(faces)
    return Mesh(points.reshape(-1, 3), faces, colors.reshape(-1, 3), np.full(len(faces), material))


def revolved(profile: Any, turns: int, color: Any, material: int = 0, waves: Any = None) -> Mesh:
    """Return the surface that a profile (radius, height) sweeps round the y axis."""
    radius, height = np.asarray(profile, dtype=float).T
    around = np.linspace(0.0, 2.0 * np.pi, turns, endpoint=False)
    radius = np.repeat(radius[:, None], turns, axis=1)
    if waves is not None:
        radius = radius * waves(around)
    tall = np.broadcast_to(height[:, None], radius.shape)
    points = np.stack([radius * np.sin(around), tall, radius * np.cos(around)], axis=-1)
    faces = grid_faces(len(height), turns, closed=True)
    return _flat(points, faces, np.broadcast_to(color, points.shape), material)


def rounded(corners: Any, step_length: float) -> Floats:
    """Return a polyline with points at most a step apart."""
    corners = np.asarray(corners, dtype=float)
    pieces = [
        np.linspace(a, b, max(int(np.ceil(np.linalg.norm(b - a) / step_length)), 1), endpoint=False)
        for a, b in pairwise(corners)
    ]
    return np.concatenate([*pieces, corners[-1:]])


def barrel(turns: int = 168) -> Mesh:
    """Return a barrel of staves with iron hoops and rivets: 28 parts, two materials."""
    wood, iron = np.array([0.62, 0.42, 0.24]), np.array([0.33, 0.35, 0.38])
    tall = np.linspace(-1.0, 1.0, 45)
    side = np.column_stack([0.86 - 0.18 * tall**2, 1.05 * tall])
    rim = [[0.68, 1.05], [0.62, 1.05], [0.62, 0.97], [0.3, 0.97], [0.0, 0.97]]
    lid = np.array(rim)
    profile = np.concatenate([lid[::-1] * [1, -1], side[1:-1], lid])

    def staves(around: Floats) -> Floats:
        return 1.0 - 0.03 * np.exp(-((np.sin(9.0 * around) / 0.12) ** 2))

    parts = [revolved(profile, turns, wood, waves=staves)]
    stave = np.floor(np.arange(turns) * 18 / turns + 0.5) % 18
    tint = 0.82 + 0.3 * np.random.default_rng(3).random(18)[stave.astype(int)]
    tinted = parts[0].colors.reshape(-1, turns, 3) * tint[None, :, None]
    parts[0] = Mesh(parts[0].points, parts[0].faces, tinted.reshape(-1, 3), parts[0].materials)
    for height in (-0.72, -0.38, 0.38, 0.72):
        out = 0.86 - 0.18 * height**2 / 1.05**2
        band = np.array([[0.0, -0.07], [0.035, -0.06], [0.035, 0.06], [0.0, 0.07], [0.0, -0.07]])
        hoop = rounded(band + np.array((out, height)), 0.03)
        parts.append(revolved(hoop, turns, iron, 1))
        angles = np.arange(6) * np.pi / 3 + 0.2
        parts += [rivet(out + 0.035, height, angle, 0.6 * iron) for angle in angles]
    return joined(*parts)


def rivet(radius: float, height: float, angle: float, color: Any) -> Mesh:
    """Return a small ball on a barrel."""
    bend = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    ball = revolved(0.05 * np.column_stack([np.cos(bend), np.sin(bend)]), 14, color, 1)
    place = np.array([radius * np.sin(angle), height, radius * np.cos(angle)])
    return Mesh(ball.points + place, ball.faces, ball.colors, ball.materials)


def circle(radius: float, count: int, centre: Any = (0.0, 0.0)) -> Floats:
    """Return points (n, 2) of a circle."""
    around = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return radius * np.column_stack([np.cos(around), np.sin(around)]) + centre


def flange() -> Mesh:
    """Return a plate with rounded edges, four holes and a boss with a bore: all as CAD writes it.

    Flat sides have no points but at their borders; round ones have many.
    """
    corner = np.linspace(0.0, 0.5 * np.pi, 25)
    quarters = [corner + k * 0.5 * np.pi for k in range(4)]
    way = np.concatenate([np.column_stack([np.cos(q), np.sin(q)]) for q in quarters])
    middle = np.repeat([[1.5, 0.9], [-1.5, 0.9], [-1.5, -0.9], [1.5, -0.9]], 25, axis=0)
    bend = np.linspace(0.0, 0.5 * np.pi, 13)
    edge = [(0.5 - 0.12 * (1 - np.cos(t)), 0.28 + 0.12 * np.sin(t)) for t in bend]
    levels = [(0.5, 0.0), *edge]
    outer = np.stack([np.column_stack([middle + r * way, np.full(100, z)]) for r, z in levels])
    hollow = [(0.72 + 0.16 * (1 - np.sin(t)), 0.40 + 0.16 * (1 - np.cos(t))) for t in bend]
    boss = [*hollow, (0.72, 1.1), (0.66, 1.16), (0.48, 1.16), (0.42, 1.10), (0.42, 0.0)]
    boss_loops = np.stack([np.column_stack([circle(r, 96), np.full(96, z)]) for r, z in boss])
    holes = [circle(0.2, 64, (sx * 1.45, sy * 0.85)) for sx in (-1, 1) for sy in (-1, 1)]
    walls = [np.stack([np.c_[hole, np.full(64, z)] for z in (0.4, 0.0)]) for hole in holes]
    loops = [outer, boss_loops, *walls]
    top = [outer[-1, :, :2], boss_loops[0, :, :2], *holes]
    bottom = [outer[0, :, :2], boss_loops[-1, :, :2], *holes]
    parts = [stack(loop) for loop in loops]
    return welded(joined(*parts, cap(top, 0.4), cap(bottom, 0.0)))


def stack(loops: Floats) -> Mesh:
    """Return the surface through loops (rows, columns, 3) of as many points."""
    grey = np.broadcast_to([0.62, 0.68, 0.75], loops.shape)
    return _flat(loops, grid_faces(*loops.shape[:2], closed=True), grey)


def cap(loops: list[Floats], height: float) -> Mesh:
    """Return the flat surface inside the first loop and outside the others."""
    points = np.concatenate(loops)
    faces = Delaunay(points).simplices
    loop = np.repeat(np.arange(len(loops)), [len(each) for each in loops])
    # A triangle lies in a hole if all its corners are of that one loop.
    same = (loop[faces] == loop[faces][:, :1]).all(axis=1) & (loop[faces[:, 0]] > 0)
    faces = faces[~same]
    high = np.column_stack([points, np.full(len(points), height)])
    return _flat(high, faces, np.broadcast_to([0.62, 0.68, 0.75], high.shape))


def welded(mesh: Mesh) -> Mesh:
    """Return a mesh whose equal points are one."""
    _, first, number = np.unique(
        mesh.points.round(9), axis=0, return_index=True, return_inverse=True
    )
    return Mesh(mesh.points[first], number.ravel()[mesh.faces], mesh.colors[first], mesh.materials)


def facade(spacing: float = 0.02, noise: float = 0.001) -> Mesh:
    """Return the scan of a façade as a mesh, in metres: windows, a door, ashlar and a cornice."""
    x, y = np.meshgrid(np.arange(0.0, 5.2, spacing), np.arange(0.0, 4.0, spacing))

    def panel(left: float, right: float, bottom: float, top: float) -> Floats:
        across = np.minimum(x - left, right - x)
        up = np.minimum(y - bottom, top - y)
        return np.clip(np.minimum(across, up) / spacing, 0.0, 1.0)

    depth = np.zeros_like(x)
    for middle in (0.9, 2.6, 4.3):
        opening = panel(middle - 0.45, middle + 0.45, 2.1, 3.4)
        if middle == 2.6:
            opening = np.maximum(opening, panel(middle - 0.5, middle + 0.5, 0.0, 1.6))
        else:
            opening = np.maximum(opening, panel(middle - 0.45, middle + 0.45, 0.7, 1.6))
        frame = panel(middle - 0.55, middle + 0.55, 2.0, 3.5) * 0.05
        bars = np.maximum(
            panel(middle - 0.04, middle + 0.04, 0.0, 3.6), panel(0.0, 5.2, 2.85, 2.93)
        )
        depth += frame * (opening < 0.5) - opening * (0.18 - 0.06 * bars)
    joints = np.maximum(np.abs(np.sin(np.pi * y / 0.3)) < 0.1, 0) * (y < 1.75)
    row = np.floor(y / 0.3)
    joints = np.maximum(joints, (np.abs(np.sin(np.pi * (x / 0.7 + 0.5 * row))) < 0.05) & (y < 1.75))
    depth = np.where((depth == 0.0) & (joints > 0), -0.025, depth)
    depth += 0.06 * panel(-1.0, 6.2, 1.78, 1.9) + 0.22 * np.clip((y - 3.65) / 0.2, 0.0, 1.0)
    points = np.stack([x, y, depth], axis=-1)
    points += np.random.default_rng(0).normal(0.0, noise, points.shape)
    faces = grid_faces(*x.shape, closed=False)
    return _flat(points, faces, np.broadcast_to([0.75, 0.72, 0.66], points.shape))
