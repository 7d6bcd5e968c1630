# SPDX-License-Identifier: GPL-3.0-or-later
"""What hypothesis may put into the core: point sets, meshes, their storage, parameters, targets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st
from shapes import cube_cloud, grid, hull_mesh, sphere_cloud, torus, turned

import salcore

MOST = 90
"""Points of a drawn shape, about."""


def _lattice(rng, count, axes):
    side = max(round(count ** (1 / axes)), 1)
    steps = np.stack(np.meshgrid(*[np.arange(float(side))] * axes), axis=-1).reshape(-1, axes)
    return np.column_stack([steps, np.zeros((len(steps), 3 - axes))])


def _circle(rng, count):
    angle = 2 * np.pi * np.arange(count) / max(count, 1)
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])


CLOUDS = {
    "random": lambda rng, n: rng.random((n, 3)),
    "line of lattice": lambda rng, n: _lattice(rng, n, 1),
    "lattice": lambda rng, n: _lattice(rng, n, 2),
    "lattice in space": lambda rng, n: _lattice(rng, n, 3),
    "cube": lambda rng, n: cube_cloud(1 + n // 25)[0],
    "circle": _circle,
    "sphere": lambda rng, n: sphere_cloud(n) if n else np.empty((0, 3)),
    "few distinct": lambda rng, n: np.round(rng.random((n, 3)) * rng.integers(1, 5)),
    "one point": lambda rng, n: np.tile(rng.normal(size=3), (n, 1)),
    "line": lambda rng, n: np.outer(rng.random(n), rng.normal(size=3)),
    "plane": lambda rng, n: rng.random((n, 2)) @ rng.normal(size=(2, 3)),
    "two clusters": lambda rng, n: np.concatenate(
        [rng.random((n // 2, 3)), 1e-4 * rng.random((n - n // 2, 3)) + [9, 0, 0]]
    ),
    "dense spot": lambda rng, n: rng.normal(size=(n, 3)) * 10.0 ** -rng.integers(0, 9, (n, 1)),
    "twins": lambda rng, n: (
        np.repeat(rng.random(((n + 1) // 2, 3)), 2, axis=0)
        + 1e-14 * rng.integers(0, 2, (2 * ((n + 1) // 2), 3))
    ),
    "two sheets": lambda rng, n: np.column_stack(
        [rng.random((n, 2)), 1e-9 * rng.integers(0, 2, n)]
    ),
    "axes": lambda rng, n: np.eye(3)[rng.integers(0, 3, n)] * rng.integers(-9, 9, (n, 1)),
}


def _fan(rng, n):
    count = 3 + n % 12
    around = 2 * np.pi * np.arange(count) / count
    tips = np.column_stack([np.cos(around), np.sin(around), rng.random(count)])
    faces = np.column_stack([np.zeros(count), np.ones(count), 2 + np.arange(count)])
    return np.concatenate([[[0, 0, 0], [0, 0, 1.0]], tips]), faces.astype(int)


def _moebius(rng, n):
    count = 4 + n // 3
    around, across = np.meshgrid(np.arange(count), [-1, 0, 1], indexing="ij")
    u, w = 2 * np.pi * around / count, 0.3 * across
    radius = 1 + w * np.cos(u / 2)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), w * np.sin(u / 2)], -1)
    number = np.arange(3 * count).reshape(count, 3)
    following = np.concatenate([number[1:], number[:1, ::-1]])
    quads = [(number[:, k], following[:, k], following[:, k + 1], number[:, k + 1]) for k in (0, 1)]
    faces = [np.column_stack(c) for a, b, c_, d in quads for c in ((a, b, c_), (a, c_, d))]
    return points.reshape(-1, 3), np.concatenate(faces)


def _soup(rng, n):
    points = CLOUDS[sorted(CLOUDS)[rng.integers(len(CLOUDS))]](rng, n + 1)
    return points, rng.integers(0, len(points), (1 + n, 3))


def _slivers(rng, n):
    points, faces = grid(3 + n // 20, 5)
    points[:, 1] *= 1e-12
    points[:: max(rng.integers(2, 9), 2)] = points[0]  # faces without an area
    return points, faces


MESHES = {
    "torus": lambda rng, n: torus(3 + n // 8, 3 + n % 5),
    "grid": lambda rng, n: grid(2 + n // 8, 2 + n % 8),
    "hull": lambda rng, n: hull_mesh(sphere_cloud(n + 6)),
    "one face": lambda rng, n: (rng.random((3 + n % 3, 3)), np.array([[0, 1, 2]])),
    "fan": _fan,
    "moebius": _moebius,
    "soup": _soup,
    "slivers": _slivers,
    "two at a point": lambda rng, n: (rng.random((5, 3)), np.array([[0, 1, 2], [0, 3, 4]])),
    "flat faces": lambda rng, n: (np.outer(np.arange(6.0), [1, 2, 3]), np.array([[0, 2, 5]])),
}


def _no_defect(rng, points, faces):
    return points, faces


def _flip_some(rng, points, faces):
    flip = rng.random(len(faces)) < 0.5
    return points, np.where(flip[:, None], faces[:, ::-1], faces)


def _double_some(rng, points, faces):
    return points, np.concatenate([faces, faces[: len(faces) // 2]])


def _leave_some(rng, points, faces):
    return points, faces[rng.random(len(faces)) < 0.6]


def _add_loose(rng, points, faces):
    return np.concatenate([rng.random((7, 3)), points]), faces + 7


def _part_all(rng, points, faces):
    """Give every face corners of its own, at equal places."""
    return points[faces.ravel()], np.arange(faces.size).reshape(-1, 3)


def _repeat_corner(rng, points, faces):
    faces = faces.copy()
    faces[::3, 1] = faces[::3, 0]
    return points, faces


DEFECTS = [
    _no_defect, _flip_some, _double_some, _leave_some, _add_loose, _part_all, _repeat_corner,
]  # fmt: skip

STORAGE = {
    "float64": lambda a: a,
    "float32": lambda a: a.astype(np.float32),
    "integers": lambda a: np.round(np.nan_to_num(a, posinf=0, neginf=0).clip(-1e9, 1e9)).astype(
        int
    ),
    "every second": lambda a: np.repeat(a, 2, axis=0)[::2],
    "backwards": lambda a: a[::-1].copy()[::-1],
    "columns": np.asfortranarray,
    "big endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "list": lambda a: a.tolist() if len(a) else a,
}


@dataclass
class Shape:
    """Input of an analysis, as drawn; it shows itself as the words it was drawn by."""

    words: tuple[Any, ...]
    points: Any
    faces: Any = None
    normals: Any = None

    def __repr__(self) -> str:
        return " ".join(map(str, self.words))


def _normals(rng, kind, count):
    normals = rng.normal(size=(count, 3)) * 10.0 ** rng.integers(-9, 9, (count, 1))
    if kind == "defective":
        normals[rng.random(count) < 0.3] = 0.0
        normals[rng.random(count) < 0.2, rng.integers(3)] = np.nan
    elif kind == "alike":
        normals[:] = [0.0, 0.0, 2.0]
    return normals


@st.composite
def shapes(draw, mesh=None, most=MOST):
    """Draw a cloud or a mesh with all its defects."""
    mesh = draw(st.booleans()) if mesh is None else mesh
    kind = draw(st.sampled_from(sorted(MESHES if mesh else CLOUDS)))
    count = draw(st.one_of(st.integers(0, 5), st.integers(6, most)))
    seed = draw(st.integers(0, 2**16))
    rng = np.random.default_rng(seed)
    words = [kind, count, seed]
    points, faces = MESHES[kind](rng, count) if mesh else (CLOUDS[kind](rng, count), None)
    points = np.array(points, dtype=float).reshape(-1, 3)
    if mesh:
        defect = draw(st.sampled_from(DEFECTS))
        words.append(defect.__name__)
        points, faces = defect(rng, points, np.array(faces, dtype=np.int64))
    if draw(st.booleans()):
        words.append("turned")
        points = turned(points, seed) if len(points) else points
    exponent = draw(st.sampled_from([0, 0, 0, -12, -3, 5, 12]))
    offset = draw(st.sampled_from([0.0, 0.0, 1e7]))
    points = (points + offset) * 10.0**exponent
    if not mesh and draw(st.integers(0, 3)) == 0:
        points = np.concatenate([points, points[rng.integers(0, len(points), len(points))]])
        words.append("doubled")
    spoilt = draw(st.sampled_from([0.0, 0.0, 0.1, 1.0]))
    bad = rng.random(len(points)) < spoilt
    points[bad, rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf])
    normals = draw(st.sampled_from([None, None, "random", "defective", "alike"]))
    storage = draw(st.sampled_from(sorted(STORAGE)))
    words += [f"1e{exponent}", f"+{offset:g}", f"spoilt {spoilt}", f"normals {normals}", storage]
    given_points = STORAGE[storage](points)
    given_faces = faces
    if mesh:
        given_faces = faces.astype(draw(st.sampled_from([np.int64, np.int32, np.uint16])))
    given_normals = None if normals is None else _normals(rng, normals, len(points))
    for array in (given_points, given_faces, given_normals):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return Shape(tuple(words), given_points, given_faces, given_normals)


def values_of(row):
    """Return a strategy of values of one parameter; big numbers only where they cost nothing."""
    if row.type is str:
        return st.sampled_from(row.choices)
    if row.type is bool:
        return st.booleans()
    if row.name == "max_gap":
        return st.sampled_from([0, 1, 2, 64])
    if row.type is int:
        return st.integers(int(row.minimum), int(min(row.maximum, row.minimum + 3)))
    return st.floats(row.minimum, row.maximum).map(lambda value: round(value, 6))


any_parameters = st.builds(
    salcore.Parameters, **{row.name: values_of(row) for row in salcore.TABLE}
)
parameters = st.one_of(
    st.sampled_from(salcore.PRESETS).map(salcore.Parameters.preset), any_parameters
)
targets = st.one_of(
    st.tuples(st.just("alpha"), st.one_of(st.floats(0, 100), st.floats(0, 1000))),
    st.tuples(st.just("ratio"), st.floats(1e-9, 1)),
    st.tuples(st.just("max_error"), st.one_of(st.floats(0, 0.1), st.floats(0, 1e300))),
)
