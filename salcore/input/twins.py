# SPDX-License-Identifier: GPL-3.0-or-later
"""Twins: points and corners that lie opposite to each other across a plane of symmetry."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..arrays.blocks import worker_count
from ..arrays.check import indices
from ..arrays.edges import find_edges
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import dot
from ..errors import GeometryError, ParameterError
from ..parameters import shown
from .geometry import Geometry, Plane
from .layers import arrays_of

AXES = ("x", "y", "z")
TOLERANCE = 0.01
"""Distance, as a share of the mean edge, up to which points are twins, and one is on the plane: far
more than single precision rounds, far less than a feature."""


@dataclass(frozen=True, eq=False)
class Twins:
    """What lies opposite to what.

    Attributes
    ----------
    axis : int
        The plane is where this coordinate of the input is 0.
    half : Geometry
        The faces on the side where it is positive, their vertices, and all others on that side or
        on the plane; it still speaks of all input points and corners.
    vertices : (h,) intp
        Vertex of the whole that each one of the half is.
    vertex : (n,) intp
        Twin of each vertex of the whole; a vertex on the plane is its own.
    point : (N,) intp
        Twin of each input point; -1 for one that was dropped.
    corner : (3 F,) intp
        Twin of each corner of the half's faces; other corners of the input stand for themselves.
    corner_point : (3 F,) intp
        Input point at each corner of a valid face; -1 elsewhere.
    """

    axis: int
    half: Geometry
    vertices: Indices
    vertex: Indices
    point: Indices
    corner: Indices
    corner_point: Indices

    def on_both_sides(self, given: dict[str, Any]) -> dict[str, Any]:
        """Return constraints, as `Constraints.check` takes them, that look at both sides.

        What is given on one side counts on the other, too; values of either side are told apart.
        """
        result = dict(given)
        for name in ("protect", "importance"):
            values = given.get(name)
            if values is not None and np.shape(values) == self.point.shape:
                array = np.asarray(values)
                result[name] = np.maximum(array, np.where(self.point < 0, array, array[self.point]))
        if given.get("seams") is not None:
            lines = indices(given["seams"], "seams", "pairs of points", 2, len(self.point))
            others = self.point[lines.astype(np.intp)]
            result["seams"] = np.concatenate([lines, others[(others >= 0).all(axis=1)]])
        values = given.get("point_values")
        if values is not None and len(np.asarray(values)) == len(self.point):
            rows = np.asarray(values).reshape(len(self.point), -1)
            result["point_values"] = np.hstack([rows, rows[self.point]])
        layers = [np.asarray(layer) for layer in arrays_of(given.get("corner_values"))]
        if layers:
            result["corner_values"] = [*layers, *filter(np.size, map(self._opposite, layers))]
        return result

    def _opposite(self, layer: NDArray[Any]) -> NDArray[Any]:
        """Return what a layer (F, 3, d) has at the twins of corners; nothing if it has the same."""
        if 3 * len(layer) != len(self.corner) or layer.ndim != 3:
            return np.empty(0)  # refused further on
        other = layer.reshape(self.corner.shape[0], -1)[self.corner].reshape(layer.shape)
        return np.empty(0) if np.array_equal(other, layer) else other


def find_twins(geometry: Geometry, symmetry: str) -> Twins:
    """Return the twins of a mesh across the plane where one coordinate is 0.

    Parameters
    ----------
    geometry : Geometry
    symmetry : str
        "x", "y" or "z".

    Raises
    ------
    ParameterError
        If it is none of these.
    GeometryError
        If there are no faces, a point or face has no twin, or faces cross the plane or lie in it.

    Notes
    -----
    O(n log n). How the quads of a mesh are triangulated may differ between the sides.
    """
    if symmetry not in AXES:
        raise ParameterError(f"symmetry={shown(symmetry)}: choose one of {', '.join(AXES)}")
    if not len(geometry.faces):
        raise GeometryError(f"symmetry={symmetry!r}: there are no faces; turn it off for points")
    axis = AXES.index(symmetry)
    at = -float(geometry.centre[axis]) * geometry.to_unit
    vertex, side, alone = _match(geometry, axis, at)
    faces = side[geometry.faces]
    crossing = ((faces > 0).any(axis=1) & (faces < 0).any(axis=1)) | (faces == 0).all(axis=1)
    ours = (faces > 0).any(axis=1) & ~crossing
    corner = found = np.empty(0, dtype=np.intp)
    if not alone:
        theirs = (faces < 0).any(axis=1) & ~crossing
        corner, found = _match_corners(geometry.faces, vertex, ours, theirs)
        found = np.append(found, np.full(abs(int(ours.sum()) - int(theirs.sum())), -1))
    problems = [
        (alone, f"of {len(side):,} points have no twin there"),
        (int(crossing.sum()), "faces cross it or lie in it"),
        (int(np.count_nonzero(found < 0)), "corners of faces have no twin there"),
    ]
    said = [f"{number:,} {text}" for number, text in problems if number]
    if said:
        raise GeometryError(
            f"symmetry={symmetry!r}: the mesh is not the same on both sides of the plane where "
            f"{symmetry} is 0: {', '.join(said)}; symmetrize it, move its origin onto the plane, "
            "or turn symmetry off"
        )
    half, vertices = _half(geometry, side, ours, Plane(side == 0, axis, at))
    point = np.where(geometry.vertex_of < 0, -1, geometry.input_of[vertex[geometry.vertex_of]])
    point[geometry.input_of] = geometry.input_of[vertex]
    return Twins(axis, half, vertices, vertex, point, *_input_corners(geometry, corner, found))


def _match(geometry: Geometry, axis: int, at: float) -> tuple[Indices, Indices, int]:
    """Return the twin (n,) of each vertex, its side (n,), and how many have no twin."""
    points = geometry.points
    edges = find_edges(geometry.faces, len(points))
    along = points[edges.high] - points[edges.low]
    tolerance = TOLERANCE * float(np.sqrt(dot(along, along)).mean())
    height = points[:, axis] - at
    low, high = np.flatnonzero(height <= tolerance), np.flatnonzero(height >= -tolerance)
    side = np.where(height > 0.0, 1, -1)
    twin = np.arange(len(points))
    if not len(low) or not len(high):
        return twin, side, len(points)
    mirrored = points[low].copy()
    mirrored[:, axis] = 2.0 * at - mirrored[:, axis]
    _, nearest = cKDTree(points[high]).query(
        mirrored, distance_upper_bound=tolerance, workers=worker_count()
    )
    other = np.append(high, -1)[nearest]
    # What lies nearest to its own image is on the plane; of two close to it each has the other.
    side[low[other == low]] = 0
    pairs = (other >= 0) & (side[low] < 0)
    pairs[pairs] = side[other[pairs]] > 0
    low, other = low[pairs], other[pairs]
    once = np.bincount(other, minlength=len(points))[other] == 1
    low, other = low[once], other[once]
    twin[low], twin[other] = other, low
    return twin, side, int(np.count_nonzero((twin == np.arange(len(twin))) & (side != 0)))


def _match_corners(
    faces: Indices, twin: Indices, ours: Mask, theirs: Mask
) -> tuple[Indices, Indices]:
    """Return the corners (c,) of our faces, and the twin (c,) of each; -1 for none.

    Twins are at vertices that are twins, next to an edge whose other end is a twin, too: they need
    not be in faces that are, where quads are divided in other ways.
    """
    count = len(twin)
    corner, other = (
        (3 * np.flatnonzero(which)[:, None] + np.arange(3)).ravel() for which in (ours, theirs)
    )
    flat = faces.ravel()

    def turn(corners: Indices, by: int) -> Indices:
        return corners - corners % 3 + (corners + by) % 3

    found = np.full(len(corner), -1, dtype=np.intp)
    for forward, backward in ((1, 2), (2, 1)):
        key = flat[other] * count + flat[turn(other, backward)]
        order = np.argsort(key, kind="stable")
        wanted = twin[flat[corner]] * count + twin[flat[turn(corner, forward)]]
        place = np.minimum(np.searchsorted(key, wanted, sorter=order), max(len(key) - 1, 0))
        if len(key):
            match = order[place]
            there = (key[match] == wanted) & (found < 0)
            found[there] = other[match[there]]
    return corner, found


def _half(geometry: Geometry, side: Indices, ours: Mask, plane: Plane) -> tuple[Geometry, Indices]:
    """Return the part of a geometry on one side, and its vertices (h,) in the whole."""
    vertices = np.flatnonzero(side >= 0)
    number = np.full(len(side) + 1, -1, dtype=np.intp)  # the last is that of dropped points
    number[vertices] = np.arange(len(vertices))
    corner_points, normals = geometry.corner_points, geometry.normals
    half = dataclasses.replace(
        geometry,
        points=geometry.points[vertices],
        faces=number[geometry.faces[ours]],
        face_of=geometry.face_of[ours],
        normals=None if normals is None else normals[vertices],
        vertex_of=number[geometry.vertex_of],
        input_of=geometry.input_of[vertices],
        number=np.arange(len(vertices)),
        corner_points=None if corner_points is None else corner_points[ours],
        backs=None,
        plane=dataclasses.replace(plane, on_plane=plane.on_plane[vertices]),
    )
    return half, vertices


def _input_corners(geometry: Geometry, corner: Indices, found: Indices) -> tuple[Indices, Indices]:
    """Return the twin (3 F,) of each corner of the input, and the input point at each."""
    twin = np.arange(3 * geometry.given_faces)
    twin[geometry.input_corners(corner)] = geometry.input_corners(found)
    points = geometry.corner_points
    used = geometry.input_of[geometry.faces] if points is None else points
    point = np.full(len(twin), -1, dtype=np.intp)
    point[geometry.input_corners(np.arange(geometry.faces.size))] = used.ravel()
    return twin, point


def mirrored(positions: Floats, axis: int) -> Floats:
    """Return positions (m, 3) on the other side of the plane."""
    result = positions.copy()
    result[:, axis] = -result[:, axis]
    return result
