# SPDX-License-Identifier: GPL-3.0-or-later
"""Where all that a simplification has comes from: points, faces, corners, edges, normals."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays.check import corner_values, indices
from .arrays.types import Floats, Indices, Ints
from .decimation.attribute_transfer import (
    corner_sources,
    edge_sources,
    label_charts,
    place_sources,
)
from .decimation.normal_transfer import transfer_normals
from .errors import GeometryError
from .input.geometry import Geometry


@dataclass(frozen=True, eq=False)
class Context:
    """What a simplification needs of the analysis."""

    geometry: Geometry
    normals: Floats
    regions: int | None
    corner_origin: Indices | None
    corners: Indices | None
    workers: int
    seconds_analysis: float
    seams: Ints | None = None


@dataclass(frozen=True, eq=False)
class Origins:
    """What is kept, and what stands for the rest.

    Attributes
    ----------
    indices : (M,) int64
        Kept input points, ascending.
    faces : (K, 3) int64 or None
        Faces over positions in `indices`; None for a cloud and for a threshold α.
    face_source : (K,) int64 or None
        Input face that each face takes its values from.
    corner_origin : (K, 3) int64 or None
        Input corner that each corner comes from: its point went into that of the corner. Corner c
        of face f is ``3 f + c``. Three corners of one face, unless an edge was flipped.
    face_corners : (K, 3) int64 or None
        Input corner that each corner of `faces` takes its values from. One whose vertex stayed
        keeps its own; others take that of their own chart where their vertex went. Worked out when
        first asked for.
    source : (N,) int64
        Position in `indices` of the kept point that stands for each input point; -1 for points
        that were not finite.
    positions : (M, 3) float64 or None
        Where the kept points move to with ``placement="optimal"``, in the input's unit; None where
        they stay.
    """

    indices: NDArray[np.int64]
    faces: NDArray[np.int64] | None
    face_source: NDArray[np.int64] | None
    corner_origin: NDArray[np.int64] | None
    source: NDArray[np.int64]
    positions: Floats | None
    _context: Context = dataclasses.field(repr=False)

    @cached_property
    def face_corners(self) -> NDArray[np.int64] | None:
        if self.faces is None or self.face_source is None:
            return None
        geometry = self._context.geometry
        corners = self._context.corners
        if corners is None:
            origin = self._context.corner_origin
            assert origin is not None  # there are faces
            wanted = geometry.vertex_of[self.indices][self.faces]
            corners = corner_sources(geometry.faces, wanted, origin, None)
        return geometry.input_corners(corners)

    def corner_source(self, faces: ArrayLike, charts: ArrayLike | None = None) -> NDArray[np.int64]:
        """Return the input corner (K, 3) that each corner of `faces` takes its values from.

        For texture coordinates and all else that belongs to corners: a corner whose vertex stayed
        keeps its own; one whose vertex went into another takes the values of that other in the
        same chart.

        Parameters
        ----------
        faces : (F, 3) array_like of integers
            The faces that were analysed.
        charts : (F, 3, d) array_like of float, optional
            Texture coordinates of their corners, or other values that tell charts apart.

        Returns
        -------
        (K, 3) int64
            Corner c of face f is ``3 f + c``.

        Raises
        ------
        GeometryError
            If the simplification has no faces, or an array cannot be understood.

        Notes
        -----
        O(F + K log K).
        """
        if self.faces is None or self.corner_origin is None:
            raise _no_faces()
        vertex_of = self._context.geometry.vertex_of
        given = indices(faces, "faces", "triangles", 3, len(vertex_of))
        if int(self.corner_origin.max(initial=-1)) >= given.size:
            raise GeometryError(f"faces: {len(given)} of them; give all that were analysed")
        vertices = vertex_of[self.indices]
        wanted = vertices[self.faces]
        if (vertices[self.source[given.ravel()[self.corner_origin]]] != wanted).any():
            raise GeometryError("faces: they are not those that were analysed; give the same array")
        values = None if charts is None else corner_values(charts, "charts", given.shape)
        return corner_sources(vertex_of[given], wanted, self.corner_origin, values)

    def transfer_normals(self) -> NDArray[np.float64]:
        """Return the normals (K, 3, 3) of the original surface at the corners of `faces`.

        A light mesh with these is shaded like its original. On the two sides of a crease of more
        than 60 degrees or so they differ.

        Raises
        ------
        GeometryError
            If the simplification has no faces.

        Notes
        -----
        O(F log F) time; see `decimation.normal_transfer`.
        """
        if self.faces is None:
            raise _no_faces()
        geometry = self._context.geometry
        vertex = geometry.vertex_of[self.indices]
        moved = None
        if self.positions is not None:
            moved = geometry.points.copy()
            moved[vertex] = (self.positions - geometry.centre) * geometry.to_unit
        return transfer_normals(geometry.points, geometry.faces, vertex[self.faces], moved)

    def place_source(self) -> tuple[NDArray[np.int64], Floats]:
        """Return the input face that each kept point lies on, and its place in it.

        For colours and all else that belongs to points, where these have moved: what the face's
        corners have, times the weights, is what the original has there.

        Returns
        -------
        face : (M,) int64
            Input face; -1 for a point that no face uses.
        weights : (M, 3) float64
            Of the face's corners; they are at least 0, and their sum is 1.

        Raises
        ------
        GeometryError
            If the simplification has no faces.

        Notes
        -----
        O(F) time. The face is sought from where the point was.

        Examples
        --------
        >>> import numpy as np, salcore
        >>> x, y = np.meshgrid(np.arange(9.0), np.arange(9.0))
        >>> points = np.stack([x.ravel(), y.ravel(), (x * y / 9).ravel()], axis=1)
        >>> corner = (9 * np.arange(8)[:, None] + np.arange(8)).ravel()
        >>> sides = [[0, 1, 10], [0, 10, 9]]
        >>> faces = np.concatenate([corner[:, None] + side for side in sides])
        >>> light = salcore.simplify(
        ...     points, faces, ratio=0.3, parameters=salcore.Parameters(placement="optimal")
        ... )
        >>> face, weights = light.place_source()
        >>> red = np.linspace(0, 1, 81)
        >>> (weights * red[faces[face]]).sum(axis=1).shape == light.indices.shape
        True
        """
        if self.faces is None:
            raise _no_faces()
        geometry = self._context.geometry
        vertex = geometry.vertex_of[self.indices]
        places = geometry.points[vertex]
        if self.positions is not None:
            places = (self.positions - geometry.centre) * geometry.to_unit
        face, weights = place_sources(geometry.points, geometry.faces, vertex, places)
        return np.where(face >= 0, geometry.face_of[face], -1).astype(np.int64), weights

    def corner_places(self) -> tuple[NDArray[np.int64], Floats]:
        """Return the input face that each corner takes its values from, and its place in it.

        Values of a layer (F, 3, d) at the corners of the result are
        ``(weights[..., None] * layer[face]).sum(axis=2)``: those of `face_corners`, but where
        points have moved within their charts, what the layer has at the new place.

        Returns
        -------
        face : (K, 3) int64
        weights : (K, 3, 3) float64
            Of the face's corners.

        Raises
        ------
        GeometryError
            If the simplification has no faces.

        Notes
        -----
        O(F log F) time.
        """
        if self.faces is None or self.face_corners is None:
            raise _no_faces()
        face, corner = np.divmod(self.face_corners, 3)
        weights = np.eye(3)[corner]
        if self.positions is None:
            return face, weights
        context = self._context
        chart = np.full(context.geometry.given_faces + 1, -1)  # the last is that of no face
        chart[context.geometry.face_of] = label_charts(context.geometry.faces, context.seams)
        place, share = self.place_source()
        place, share = place[self.faces], share[self.faces]
        moved = (chart[place] == chart[face]) & (chart[face] >= 0)
        return np.where(moved, place, face), np.where(moved[:, :, None], share, weights)

    def edge_source(self, edges: ArrayLike, new_edges: ArrayLike) -> NDArray[np.int64]:
        """Return the input edge (e,) that each edge of the result takes its values from.

        For creases, seams and all else that belongs to edges: one whose ends went into the ends of
        the new one; of several the one that lies closest along it.

        Parameters
        ----------
        edges : (E, 2) array_like of integers
            Edges between input points.
        new_edges : (e, 2) array_like of integers
            Edges between positions in `indices`.

        Returns
        -------
        (e,) int64
            -1 where there is none.

        Notes
        -----
        O(E log e).
        """
        geometry = self._context.geometry
        old = indices(edges, "edges", "pairs of points", 2, geometry.input_count)
        new = indices(new_edges, "new_edges", "pairs of positions", 2, len(self.indices))
        return edge_sources(
            geometry.points[geometry.vertex_of],
            old.astype(np.intp),
            self.source[old],
            self.indices,
            new.astype(np.intp),
        )


def _no_faces() -> GeometryError:
    """Return the error of what only a mesh has."""
    return GeometryError("faces: this simplification has none; simplify a mesh by count")
