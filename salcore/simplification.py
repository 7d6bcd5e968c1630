# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simplification returns: what is kept, what stands for the rest, and the figures."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .arrays.blocks import set_workers
from .arrays.types import Floats, Indices, Mask
from .decimation.kept_points import keep_corner_points, keep_points
from .decimation.put_backs import put_backs
from .input.geometry import Geometry
from .measure.distances import Surface, distances
from .measure.errors import Errors, measure
from .measure.topology import count_parts
from .method.interest import Interest
from .origins import Context, Origins
from .progress import SILENT, Callback, Progress
from .report import Report


@dataclass(frozen=True, eq=False)
class Simplification(Origins):
    """What is kept, and what stands for the rest; see `Origins` as well.

    Attributes
    ----------
    interest : Interest or None
        For a threshold α, why each vertex stays.
    notes : tuple of str
        What had to be given up, or is not as asked for; a sentence each.
    seconds : float
        Time the selection took.
    """

    interest: Interest | None
    notes: tuple[str, ...]
    seconds: float

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
            _context=Context(geometry, corner_origin=corner_origin, corners=corners, **context),
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
