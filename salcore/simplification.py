# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simplification returns: what is kept, what stands for the rest, and the figures."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays.blocks import set_workers
from .arrays.check import corner_values, indices
from .arrays.types import Floats, Indices, Ints, Mask
from .decimation.attribute_transfer import (
    corner_sources,
    edge_sources,
    label_charts,
    place_sources,
)
from .decimation.kept_points import keep_corner_points, keep_points
from .decimation.normal_transfer import transfer_normals
from .decimation.put_backs import put_backs
from .errors import GeometryError
from .input.geometry import Geometry
from .measure.distances import Surface, distances
from .measure.errors import Errors, measure
from .measure.topology import count_parts
from .method.interest import Interest
from .progress import SILENT, Callback, Progress
from .report import Report


@dataclass(frozen=True, eq=False)
class Simplification:
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
    interest : Interest or None
        For a threshold α, why each vertex stays.
    notes : tuple of str
        What had to be given up, or is not as asked for; a sentence each.
    seconds : float
        Time the selection took.
    """

    indices: NDArray[np.int64]
    faces: NDArray[np.int64] | None
    face_source: NDArray[np.int64] | None
    corner_origin: NDArray[np.int64] | None
    source: NDArray[np.int64]
    positions: Floats | None
    interest: Interest | None
    notes: tuple[str, ...]
    seconds: float
    _context: _Context = dataclasses.field(repr=False)

    @classmethod
    def of_vertices(
        cls,
        geometry: Geometry,
        kept: Indices,
        source: Indices,
        *,
        copies: int = 0,
        protected: Mask | None = None,
        faces: Indices | None = None,
        face_source: Indices | None = None,
        corner_origin: Indices | None = None,
        corners: Indices | None = None,
        heir: Indices | None = None,
        positions: Floats | None = None,
        interest: Interest | None = None,
        notes: tuple[str, ...] = (),
        seconds: float = 0.0,
        **context: Any,
    ) -> Simplification:
        """Make a result in the input's numbers from vertices.

        Parameters
        ----------
        geometry : Geometry
        kept : (M,) intp
            Kept vertices, ascending.
        source : (n,) intp
            Kept vertex that stands for each; -1 for none.
        copies : int
            Input points, welded to others, that stay as well.
        protected : (N,) bool, optional
            Input points that stay.
        faces : (K, 3) intp, optional
            Faces over vertices.
        face_source : (K,) intp, optional
            Clean face that each face takes its values from.
        corner_origin : (K, 3) intp, optional
            Corner of the clean faces that each corner comes from.
        corners : (K, 3) intp, optional
            Corner of the clean faces that each corner takes its values from; without, the first
            one at its vertex.
        heir : (N,) intp, optional
            With `corners`, the input point that would stand for each; -1 where none is known.
        positions : (n, 3) float64, optional
            New positions of the vertices.
        notes : tuple of str
            What had to be given up.
        **context
            What the report needs besides.
        """
        points = None
        if corners is not None and heir is not None and geometry.corner_points is not None:
            points = geometry.corner_points.ravel()[corners]
            selection = keep_corner_points(geometry, kept, source, protected, copies, points, heir)
        else:
            selection = keep_points(geometry, kept, source, protected, copies)
        indices = selection.indices
        if faces is not None:
            faces = selection.position[selection.first[faces] if points is None else points]
        moved = None
        if positions is not None:
            vertex = geometry.vertex_of[indices]
            # What has not moved is not rounded either.
            moved = (positions[vertex] - geometry.points[vertex]) / geometry.to_unit
            moved += geometry.coordinates[indices]
        return cls(
            indices=indices.astype(np.int64),
            faces=faces,
            face_source=(
                None if face_source is None else geometry.face_of[face_source].astype(np.int64)
            ),
            corner_origin=None if corner_origin is None else geometry.input_corners(corner_origin),
            source=selection.source,
            positions=moved,
            interest=interest,
            notes=notes,
            seconds=seconds,
            _context=_Context(geometry, corner_origin=corner_origin, corners=corners, **context),
        )

    def with_backs(self) -> Simplification:
        """Return the same with the backs of faces that were given on both sides."""
        geometry, corners = self._context.geometry, self.corner_origin
        if geometry.backs is None or corners is None or self.face_corners is None:
            return self
        assert self.faces is not None  # there are corners
        assert self.face_source is not None
        both = put_backs(
            geometry, self.indices, self.faces, self.face_source, corners, self.face_corners
        )
        if both is None:
            return self
        source = np.where(self.source < 0, -1, both.place[self.source])
        source[both.indices] = np.arange(len(both.indices))
        moved = None
        if self.positions is not None:
            # A back's own points are where those of the front are.
            shift = np.zeros((len(geometry.points), 3))
            vertex = geometry.vertex_of[self.indices]
            shift[vertex] = self.positions - geometry.coordinates[self.indices]
            moved = geometry.coordinates[both.indices] + shift[geometry.vertex_of[both.indices]]
        result = dataclasses.replace(
            self,
            indices=both.indices,
            faces=both.faces,
            face_source=both.face_source,
            corner_origin=both.corner_origin,
            source=source,
            positions=moved,
        )
        result.__dict__["face_corners"] = both.face_corners
        return result

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
            raise GeometryError("faces: this simplification has none; simplify a mesh by count")
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
            raise GeometryError("faces: this simplification has none; simplify a mesh by count")
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
            raise GeometryError("faces: this simplification has none; simplify a mesh by count")
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
            raise GeometryError("faces: this simplification has none; simplify a mesh by count")
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

    @cached_property
    def report(self) -> Report:
        """Figures, measured when first asked for."""
        return self.make_report()

    def make_report(self, errors: bool = True) -> Report:
        """Return the figures; without `errors` no distances are measured, which takes longest."""
        context, interest = self._context, self.interest
        geometry = context.geometry
        finite = int(np.count_nonzero(geometry.vertex_of >= 0))
        before, after = geometry.input_count, len(self.indices)
        reasons = {
            name: None if interest is None else int(getattr(interest, name).sum())
            for name in ("extremities", "salient", "fillers", "guards")
        }
        parts_after = None
        if self.faces is not None:
            place = geometry.vertex_of[self.indices]
            parts_after = count_parts(place[self.faces], len(geometry.points))
        return Report(
            points_before=before,
            points_after=after,
            faces_before=geometry.face_count,
            faces_after=0 if self.faces is None else len(self.faces),
            parts_before=count_parts(geometry.faces, len(geometry.points)),
            parts_after=parts_after,
            rate=1.0 - after / before if before else 0.0,
            dropped=before - finite,
            welded=finite - len(geometry.points),
            regions=context.regions,
            errors=self.errors if errors else None,
            notes=self.notes,
            seconds_analysis=context.seconds_analysis,
            seconds_selection=self.seconds,
            seconds_errors=self.__dict__["_seconds_errors"] if errors else None,
            **reasons,
        )

    @cached_property
    def errors(self) -> Errors:
        """Errors between the input's points and the kept ones, measured when first asked for."""
        return self._measure(SILENT)

    def measure(self, progress: Callback | None = None) -> Errors:
        """Measure `errors`, which then are known, with progress.

        Parameters
        ----------
        progress : callable, optional
            Called with stage and fraction; returning False cancels.

        Raises
        ------
        Cancelled
            If `progress` returned False.

        Notes
        -----
        O(n log n) time.
        """
        if "errors" not in self.__dict__:
            self.__dict__["errors"] = self._measure(Progress(progress, "Errors"))
        return self.errors

    def _measure(self, progress: Progress) -> Errors:
        begun = time.perf_counter()
        original, simplified = self._surfaces()
        with set_workers(self._context.workers):
            subset = self.positions is None
            errors = measure(original, simplified, subset=subset, progress=progress)
        self.__dict__["_seconds_errors"] = time.perf_counter() - begun
        return errors.scaled(1 - int(np.frexp(self._context.geometry.to_unit)[1]))

    def largest_error(self, progress: Progress = SILENT) -> float:
        """Measure only ``errors.surface.max``, in the unit of the clean geometry."""
        original, simplified = self._surfaces()
        _, to_surface = distances(original.points, simplified, progress)
        return float(to_surface.max(initial=0.0))

    def _surfaces(self) -> tuple[Surface, Surface]:
        """Return what errors lie between, in the unit of the clean geometry."""
        context, geometry = self._context, self._context.geometry
        vertex = geometry.vertex_of[self.indices]
        points, normals = geometry.points, context.normals
        kept = points[vertex]
        none = np.empty((0, 3), dtype=np.intp)
        if self.positions is not None:
            kept = (self.positions - geometry.centre) * geometry.to_unit
        if self.faces is None:
            return Surface(points, none, normals), Surface(kept, none, normals[vertex])
        return Surface(points, geometry.faces), Surface(kept, self.faces)


@dataclass(frozen=True, eq=False)
class _Context:
    """What the report needs of the analysis."""

    geometry: Geometry
    normals: Floats
    regions: int | None
    corner_origin: Indices | None
    corners: Indices | None
    workers: int
    seconds_analysis: float
    seams: Ints | None = None
