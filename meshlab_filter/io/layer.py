# SPDX-License-Identifier: GPL-3.0-or-later
"""A cloud or a mesh with all that its file says of points, faces and corners."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import salcore

from .mtl import Material

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]

XYZ = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
RGB = ("red", "green", "blue")
SELECTED = 0x20
"""The bit of MeshLab's property ``flags`` that tells selected points."""


@dataclass(frozen=True, eq=False)
class Layer:
    """A cloud or a mesh, whose values of every kind stay in the file's own types.

    Attributes
    ----------
    label : str
    points : (N, 3) float64
        Coordinates, with the pose of a scan applied.
    columns : dict of (N,) arrays
        All values of the points, coordinates included, in the file's order. Names are those of PLY
        files: x y z, nx ny nz, red green blue alpha, intensity, and whatever else there is.
    faces : (F, 3) int64 or None
        None for a cloud.
    face_columns : dict of (F,) arrays
        All values of the faces.
    corners : dict of (F, 3, d) arrays
        All values of the corners, such as texture coordinates.
    origin : object
        What the module that read the file needs to write one of its kind.
    textures : tuple of str
        Names of image files, relative to the file.
    rows : (N,) int64 or None
        Number of each point among those of `origin`; None where `origin` holds no points.
    materials : tuple of Material
        What the numbers in the column `material` of the faces stand for.
    images : dict of bytes
        Those of `textures` that are inside of the file, as they are.
    """

    label: str
    points: Floats
    columns: Columns
    faces: NDArray[np.int64] | None = None
    face_columns: Columns = field(default_factory=dict)
    corners: Columns = field(default_factory=dict)
    origin: Any = None
    textures: tuple[str, ...] = ()
    rows: NDArray[np.int64] | None = None
    materials: tuple[Material, ...] = ()
    images: dict[str, bytes] = field(default_factory=dict)

    @property
    def normals(self) -> Floats | None:
        """Normals (N, 3) of a cloud; None where there are none, and for a mesh."""
        if self.faces is not None or not set(NORMAL) <= self.columns.keys():
            return None
        return np.column_stack([self.columns[name] for name in NORMAL]).astype(np.float64)

    @property
    def selected(self) -> NDArray[np.bool_]:
        """Which points are selected, as MeshLab notes it."""
        flags = self.columns.get("flags")
        if flags is None or not np.issubdtype(flags.dtype, np.integer):
            return np.zeros(len(self.points), dtype=bool)
        return np.asarray(flags & SELECTED != 0)

    def without_faces(self, normals: Floats) -> Layer:
        """Return the points alone, with these normals (N, 3) if they have none."""
        columns = dict(self.columns)
        if not set(NORMAL) <= columns.keys():
            columns |= {name: normals[:, axis] for axis, name in enumerate(NORMAL)}
        bare: dict[str, Any] = {"faces": None, "face_columns": {}, "corners": {}}
        return dataclasses.replace(self, columns=columns, textures=(), materials=(), **bare)

    def simplified(self, result: salcore.Simplification) -> Layer:
        """Return what a simplification keeps: every value of the kept points, bit for bit."""
        kept = result.indices
        columns = self._points(result)
        points = self.points[kept]
        if result.positions is not None:
            points = result.positions
            columns |= {name: points[:, axis] for axis, name in enumerate(XYZ)}
        rows = None if self.rows is None else self.rows[kept]
        light = dataclasses.replace(self, points=points, columns=columns, rows=rows)
        if self.faces is None:
            return light
        of = result.face_source
        return dataclasses.replace(
            light,
            faces=result.faces,
            face_columns={name: values[of] for name, values in self.face_columns.items()},
            corners=self._corners(result),
        )

    def with_corner_normals(self, normals: Floats) -> Layer:
        """Return the mesh with these normals (F, 3, 3) at its corners in place of its own."""
        columns = {name: v for name, v in self.columns.items() if name not in NORMAL}
        return dataclasses.replace(
            self, columns=columns, corners=self.corners | {"normal": normals}
        )

    def _corners(self, result: salcore.Simplification) -> Columns:
        """Return the values at the corners of the kept faces."""
        if not self.corners:
            return {}
        return {name: salcore.carry_corners(result, v) for name, v in self.corners.items()}

    def _points(self, result: salcore.Simplification) -> Columns:
        """Return the values of the kept points; those of moved ones are interpolated."""
        if self.faces is None:
            return {name: values[result.indices] for name, values in self.columns.items()}
        return {
            name: salcore.carry_points(result, values, self.faces)
            for name, values in self.columns.items()
        }

    def mapped(self, values: NDArray[Any], colors: Floats) -> Layer:
        """Return the layer with values as MeshLab's quality, and with colours in [0, 1]."""
        paint = np.round(255.0 * colors).astype(np.uint8)
        columns = {k: v for k, v in self.columns.items() if k not in RGB and k != "alpha"}
        columns |= {name: paint[:, axis] for axis, name in enumerate(RGB)}
        columns["quality"] = np.asarray(values, dtype=np.float64)
        return dataclasses.replace(self, columns=columns)


def byte_colors(columns: Columns) -> Columns:
    """Return columns in which colours from 0 to 1 are bytes, as readers of meshes want them."""
    names = [name for name in (*RGB, "alpha") if name in columns]
    if not names or any(columns[name].dtype.kind != "f" for name in names):
        return columns
    top = max(float(np.nan_to_num(columns[name]).max(initial=0.0)) for name in names)
    scale = 255.0 if top <= 1.0 else 1.0
    bytes_ = {
        name: np.clip(np.round(scale * np.nan_to_num(columns[name])), 0, 255).astype(np.uint8)
        for name in names
    }
    return {name: bytes_.get(name, values) for name, values in columns.items()}


def are_split(points: Floats) -> bool:
    """Return whether several points lie at one place, as where files split vertices."""
    order = np.lexsort(points.T)
    return bool((points[order[1:]] == points[order[:-1]]).all(axis=1).any())


def is_opaque(name: str, values: NDArray[Any]) -> bool:
    """Return whether a column says of all points or faces that they are opaque."""
    return name == "alpha" and values.dtype == np.uint8 and bool((values == 255).all())
