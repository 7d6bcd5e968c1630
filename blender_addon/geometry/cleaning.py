# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that lie on another, and loose ones, are found, joined and left out. Arrays only.

Files without shared vertices give each polygon its own: a surface in pieces, all of it border.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..salcore.input.geometry import weld_points
from .topology import MeshArrays

Ints = NDArray[np.integer[Any]]
Mask = NDArray[np.bool_]


class Cleaned(NamedTuple):
    """Geometry without some of its points.

    Attributes
    ----------
    points : (m, 3) float64
    mesh : MeshArrays or None
    used : (m,) intp or None
        The points that are left; None where these are all.
    point : (N,) intp or None
        Which of those left each of all points is; -1 for none.
    notes : list of str
        What was done, a sentence each.
    """

    points: NDArray[np.float64]
    mesh: MeshArrays | None
    used: NDArray[np.int64] | None
    point: NDArray[np.int64] | None
    notes: list[str]

    def take(self, values: Any) -> Any:
        """Return the values (m, ...) of the points that are left, or None of None."""
        return values if values is None or self.used is None else values[self.used]

    def largest(self, values: Any) -> Any:
        """Return the largest value of the points (m,) that were joined, or None of None."""
        if values is None or self.used is None or self.point is None:
            return values
        result = values[self.used]
        left = self.point >= 0
        np.maximum.at(result, self.point[left], values[left])
        return result


def clean(
    points: NDArray[np.float64], mesh: MeshArrays | None, *, weld: bool, remove_loose: bool
) -> Cleaned:
    """Join points that lie on one another, and leave out loose ones, as far as is wanted.

    Parameters
    ----------
    points : (N, 3) float64
    mesh : MeshArrays or None
    weld : bool
        Join points of equal coordinates.
    remove_loose : bool
        Leave out the points that no polygon and no edge uses, of a mesh with polygons.
    """
    first = np.arange(len(points))
    notes = []
    if weld:
        vertex, of_vertex = weld_points(points)
        first = of_vertex[vertex]
    joined = first != np.arange(len(points))
    gone = joined.copy()
    if joined.any():
        notes.append(f"{np.count_nonzero(joined):,} points that lay on another were joined to it")
    if mesh is not None and joined.any():
        mesh = _renumbered(mesh, first)
    if remove_loose and mesh is not None and len(mesh.first):
        loose = find_loose(len(points), mesh.vertices, mesh.loose_edges) & ~joined
        if loose.any():
            notes.append(f"{np.count_nonzero(loose):,} loose points were removed")
        gone |= loose
    if not gone.any():
        return Cleaned(points, mesh, None, None, notes)
    used = np.flatnonzero(~gone)
    number = np.full(len(points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    if mesh is not None:
        mesh = _renumbered(mesh, number)
        mesh = mesh._replace(point_colors=[colors[used] for colors in mesh.point_colors])
    return Cleaned(points[used], mesh, used, number[first], notes)


def find_loose(count: int, vertices: Ints, edges: Ints) -> Mask:
    """Return which points (count,) are among no vertices of corners and no ends of edges."""
    loose = np.ones(count, dtype=bool)
    loose[vertices] = False
    loose[edges] = False
    return loose


def count_doubles(points: NDArray[np.float32]) -> int:
    """Return how many points (n, 3) lie on another, by a number of 64 bits for each place."""
    bits = np.ascontiguousarray(points + np.float32(0.0)).view(np.uint32).astype(np.uint64)
    key = np.zeros(len(points), dtype=np.uint64)
    for column, factor in zip(bits.T, FACTORS, strict=True):
        key = (key ^ column) * np.uint64(factor)
        key ^= key >> np.uint64(29)
    return len(key) - len(np.unique(key))


FACTORS = (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB)
"""Odd numbers that mix bits, as in Steele, Lea and Flood, Fast splittable pseudorandom number
generators, 2014."""


def _renumbered(mesh: MeshArrays, number: Ints) -> MeshArrays:
    """Return a mesh whose points have other numbers."""

    def ends(edges: Any) -> Any:
        if edges is None:
            return None
        found = number[edges].astype(np.int32)
        found[(found < 0).any(axis=1)] = 0  # edges keep their numbers; one without length is none
        return found

    return mesh._replace(
        vertices=number[mesh.vertices].astype(np.int32),
        loose_edges=ends(mesh.loose_edges),
        edges=ends(mesh.edges),
        marked_seams=ends(mesh.marked_seams),
        sharp=ends(mesh.sharp),
    )
