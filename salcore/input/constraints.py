# SPDX-License-Identifier: GPL-3.0-or-later
"""Constraints on a simplification: protected and important points, and seams."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.check import as_array, indices, real_numbers
from ..arrays.edges import find_edges
from ..arrays.types import Floats, Ints, Mask
from ..errors import GeometryError
from .geometry import Geometry
from .layers import Layer, arrays_of, read_layers
from .wedges import Wedges, build_wedges

WANTED = {
    "protect": "one value a point",
    "importance": "one value a point",
    "point_values": "values of points as an array of shape (N, d)",
    "seams": "pairs of points as an array of integers of shape (rows, 2)",
}
"""What arguments should be, for messages."""
MAX_IMPORTANCE = 1e100
"""Largest importance: its products with all other weights stay far from the largest double."""


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints over the n vertices of a geometry.

    Attributes
    ----------
    protect : (n,) bool
    importance : (n,) float64
    seams : (s, 2) int32
        Ends of edges that stay as lines.
    protected_points : (N,) bool or None
        The same in input points.
    layers : list of Layer
        Values of corners.
    wedges : Wedges or None
    protected_copies : int
        Protected points that no face uses, beyond one for each vertex.
    border : (n,) bool or None
        Vertices on the border of the faces, if they are to stay as they are.
    keep_topology : bool
        Whether nothing may go that makes, joins or closes parts, holes and handles.
    values : (n, d) float64 or None
        Values of the vertices that the order looks at, as shares of their largest range.
    """

    protect: Mask
    importance: Floats
    seams: Ints
    protected_points: Mask | None = None
    layers: list[Layer] = field(default_factory=list)
    wedges: Wedges | None = None
    protected_copies: int = 0
    border: Mask | None = None
    keep_topology: bool = False
    values: Floats | None = None

    @classmethod
    def check(
        cls,
        geometry: Geometry,
        protect: ArrayLike | None,
        importance: ArrayLike | None,
        seams: ArrayLike | None,
        corner_values: ArrayLike | Sequence[ArrayLike] | None = None,
        corner_normals: ArrayLike | None = None,
        keep_seams: bool = True,
        keep_border: bool = False,
        keep_topology: bool = False,
        point_values: ArrayLike | None = None,
    ) -> Constraints:
        """Translate constraints on input points into ones on vertices.

        See `Analysis.simplify` for the parameters.

        Raises
        ------
        GeometryError
            If an array cannot be understood.
        """
        protected = _of_vertices(geometry, protect, "protect", 1.0).astype(bool)
        important = _of_vertices(geometry, importance, "importance", MAX_IMPORTANCE)
        points = None if protect is None else np.asarray(protect).astype(bool)
        copies = 0 if points is None else _protected_copies(geometry, points)
        layers = read_layers(geometry, corner_values, corner_normals, points)
        wedges = build_wedges(geometry, layers)
        lines = _edges(geometry, seams)
        if wedges is not None and keep_seams:
            lines = np.concatenate([lines, wedges.seams])
        border = border_vertices(geometry) if keep_border else None
        return cls(
            protected,
            important,
            lines,
            points,
            layers,
            wedges,
            copies,
            border,
            bool(keep_topology),
            _values(geometry, point_values),
        )

    @property
    def least_count(self) -> int:
        """Number of points that are protected; equal ones that faces use count once."""
        return int(self.protect.sum()) + self.protected_copies

    @property
    def notes(self) -> list[str]:
        """What is not kept that might be expected."""
        if self.wedges is None:
            return []
        crowded = [k for k in self.wedges.without_seams if self.layers[k].given]
        if not crowded:
            return []
        return [
            f"{len(crowded)} of {len(self.layers)} layers of corner values differ along most "
            "edges, as in flat shading: their seams are not kept as lines"
        ]

    @property
    def staying(self) -> Mask:
        """Vertices (n,) that never go: protected, or on a border that stays."""
        return self.protect if self.border is None else self.protect | self.border


def border_vertices(geometry: Geometry) -> Mask:
    """Return the vertices (n,) with an edge of a single face, off any plane of symmetry."""
    count = len(geometry.points)
    edges = find_edges(geometry.faces, count)
    single = edges.uses == 1
    if geometry.plane is not None:
        on_plane = geometry.plane.on_plane
        single &= ~(on_plane[edges.low] & on_plane[edges.high])
    border = np.zeros(count, dtype=bool)
    border[edges.low[single]] = border[edges.high[single]] = True
    return border


def _protected_copies(geometry: Geometry, points: Mask) -> int:
    """Return the number of protected points (N,) without faces, beyond one for each vertex."""
    vertices = geometry.vertex_of[points & geometry.loose]
    vertices = vertices[vertices >= 0]
    alone = geometry.loose[geometry.input_of[vertices]]
    return len(vertices) - len(np.unique(vertices[alone]))


def fingerprint(**given: ArrayLike | Sequence[ArrayLike] | bool | None) -> bytes:
    """Return a number of 16 bytes that tells arguments from others, in O(size)."""
    digest = hashlib.blake2b(digest_size=16)
    for name, value in given.items():
        digest.update(f"{name} {value is None}".encode())  # nothing known, or nothing there
        for part in arrays_of(value):
            array = np.ascontiguousarray(as_array(part, name, WANTED.get(name, "an array")))
            digest.update(f"{name} {array.dtype} {array.shape}".encode())
            digest.update(array.data if array.size else b"")
    return digest.digest()


def _of_vertices(geometry: Geometry, values: ArrayLike | None, name: str, largest: float) -> Floats:
    """Return the largest of one value a point over each vertex; zero for None."""
    result = np.zeros(len(geometry.points))
    if values is None:
        return result
    array = real_numbers(values, name, WANTED[name])
    if array.shape != (geometry.input_count,):
        raise GeometryError(
            f"{name} of shape {array.shape}: give one value for each of the "
            f"{geometry.input_count} points"
        )
    bad = ~((array >= 0.0) & (array <= largest))
    if name == "protect":
        bad |= (array != 0.0) & (array != 1.0)
    if bad.any():
        first = int(np.argmax(bad))
        kind = "True or False" if name == "protect" else f"numbers from 0 to {largest:g}"
        raise GeometryError(f"{name}: {array[first]:g} is the value of point {first}; give {kind}")
    valid = geometry.vertex_of >= 0
    np.maximum.at(result, geometry.vertex_of[valid], array[valid])
    return result


def _values(geometry: Geometry, values: ArrayLike | None) -> Floats | None:
    """Return values (n, d) of vertices as shares of the largest range of a column, or None."""
    if values is None:
        return None
    array = real_numbers(values, "point_values", WANTED["point_values"])
    if array.ndim not in (1, 2) or len(array) != geometry.input_count:
        raise GeometryError(
            f"point_values of shape {array.shape}: give a row for each of the "
            f"{geometry.input_count} points"
        )
    rows = array.reshape(len(array), -1)[geometry.input_of]
    rows = np.where(np.isfinite(rows), rows, 0.0)
    if not rows.size:
        return None
    # Halves first: the range of the largest doubles is infinite.
    rows = 0.5 * rows - 0.5 * rows.min(axis=0)
    largest = rows.max()
    return rows / largest if largest > 0.0 else None


def _edges(geometry: Geometry, seams: ArrayLike | None) -> Ints:
    """Return edges (s, 2) between vertices; those of dropped or equal points are left out."""
    array = indices(seams, "seams", "pairs of points", 2, geometry.input_count)
    ends = geometry.vertex_of[array.astype(np.intp)]
    good = (ends >= 0).all(axis=1) & (ends[:, 0] != ends[:, 1])
    edges: Ints = ends[good].astype(np.int32)
    return edges
