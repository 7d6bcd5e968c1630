# SPDX-License-Identifier: GPL-3.0-or-later
"""Constraints on a simplification: protected and important points, and seams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.check import indices, real_numbers
from ..arrays.types import Floats, Ints, Mask
from ..errors import GeometryError
from .geometry import Geometry

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
        Ends of edges.
    """

    protect: Mask
    importance: Floats
    seams: Ints

    @classmethod
    def check(
        cls,
        geometry: Geometry,
        protect: ArrayLike | None,
        importance: ArrayLike | None,
        seams: ArrayLike | None,
    ) -> Constraints:
        """Translate constraints on input points into ones on vertices.

        Raises
        ------
        GeometryError
            If an array cannot be understood.
        """
        return cls(
            _of_vertices(geometry, protect, "protect", 1.0).astype(bool),
            _of_vertices(geometry, importance, "importance", MAX_IMPORTANCE),
            _edges(geometry, seams),
        )

    @property
    def key(self) -> tuple[bytes, ...]:
        """Bytes that tell these constraints from others."""
        return self.protect.tobytes(), self.importance.tobytes(), self.seams.tobytes()


def _of_vertices(geometry: Geometry, values: ArrayLike | None, name: str, largest: float) -> Floats:
    """Return the largest of one value a point over each vertex; zero for None."""
    result = np.zeros(len(geometry.points))
    if values is None:
        return result
    array = real_numbers(values, name, "one value a point")
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


def _edges(geometry: Geometry, seams: ArrayLike | None) -> Ints:
    """Return edges (s, 2) between vertices; those of dropped or equal points are left out."""
    array = indices(seams, "seams", "pairs of points", 2, geometry.input_count)
    ends = geometry.vertex_of[array.astype(np.intp)]
    good = (ends >= 0).all(axis=1) & (ends[:, 0] != ends[:, 1])
    edges: Ints = ends[good].astype(np.int32)
    return edges
