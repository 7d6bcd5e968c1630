# SPDX-License-Identifier: GPL-3.0-or-later
"""From an order of elimination to simplifications: how many points a target comes to, and the cut.

Whatever a cut had to give up, or could not do as asked, is said in notes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .arrays.types import Floats, Indices
from .decimation.cut import (
    corners_of_cut,
    cut_faces,
    living_ancestors,
    optimal_positions,
    wedges_of_cut,
)
from .decimation.fitting import fit_positions
from .decimation.flips import FlipMesh
from .decimation.order import Elimination
from .decimation.refine import fixed_edges, refine_faces
from .decimation.samples import Samples
from .decimation.targets import count_for, count_for_faces, count_within
from .errors import ParameterError
from .input.constraints import Constraints
from .input.geometry import Geometry
from .measure.topology import label_parts, measure_topology, topology_given_up
from .parameters import Parameters
from .progress import SILENT, Progress
from .simplification import Simplification


@dataclass(frozen=True, eq=False)
class Cuts:
    """All cuts through one order of elimination.

    Attributes
    ----------
    geometry : Geometry
    elimination : Elimination
    constraints : Constraints
    parameters : Parameters
    samples : Samples
        Of the mesh's surface.
    result : callable
        Makes a `Simplification` of kept vertices, of their sources and of what belongs to them.
    """

    geometry: Geometry
    elimination: Elimination
    constraints: Constraints
    parameters: Parameters
    samples: Samples
    result: Callable[..., Simplification]

    @cached_property
    def least(self) -> int:
        """Fewest points that keep what is to be kept."""
        least = int(self.constraints.staying.sum())
        if self.constraints.keep_topology:
            least = max(least, self.elimination.topology_count)
        return max(least, 1) + self.constraints.protected_copies

    def find_count(self, name: str, value: float, work: Progress) -> tuple[int, list[str]]:
        """Return the number of points for a target, and notes where it is not what was asked for.

        Raises
        ------
        ParameterError
            If there are not so many points or faces, or more are protected.
        """
        if name == "max_error":
            return self._count_within(value, work), []
        if name == "faces":
            return self._count_for_faces(int(value), work)
        geometry = self.geometry
        available = geometry.available
        if name == "count" and value <= np.count_nonzero(geometry.vertex_of >= 0):
            value = min(value, available)  # copies that faces use come of themselves
        count = count_for(name, value, available, self.constraints.least_count)
        least = min(self.least, available)
        notes = self._notes_of_least(f"{name}={value:g}", count, least)
        count = max(count, least)
        ranks = count - self.constraints.protected_copies
        short = ranks - int(np.count_nonzero(self.elimination.rank < ranks))
        if short > 0 and ranks <= len(self.elimination.rank):
            notes.append(f"{name}={value:g}: {count - short} points are kept; parts go whole")
        return count, notes

    def _notes_of_least(self, asked: str, count: int, least: int) -> list[str]:
        """Return a note where a count is raised to the least one that keeps what is to be kept."""
        if count >= least:
            return []
        border = self.constraints.border is not None and least == int(
            self.constraints.staying.sum()
        )
        what = "keep_border" if border else "keep_topology"
        return [f"{asked}: that is {count} points, but {what} keeps {least}"]

    def _count_for_faces(self, wanted: int, work: Progress) -> tuple[int, list[str]]:
        """Return the largest count with at most so many faces."""
        geometry, copies = self.geometry, self.constraints.protected_copies
        if not len(geometry.faces):
            raise ParameterError(f"faces={wanted}: there are no faces; give count or ratio")
        if wanted > geometry.face_count:
            raise ParameterError(
                f"faces={wanted}: there are {geometry.face_count} valid faces; give at most so many"
            )
        part = work.part(0.0, 1.0, "Faces")
        total = len(geometry.points)
        count = count_for_faces(wanted, self.count_faces, total, part)
        least = max(self.least - copies, 1)
        if count < self.constraints.protect.sum():
            protected = int(self.constraints.protect.sum())
            raise ParameterError(
                f"faces={wanted}: {protected} protected points make {self.count_faces(protected)}; "
                "give more or protect fewer"
            )
        notes = self._notes_of_least(f"faces={wanted}", count, least)
        count = max(count, least)
        left = self.count_faces(count)
        if left < wanted:
            more = self.count_faces(count + 1)
            notes.append(f"faces={wanted}: {left} faces are kept; the next step makes {more}")
        return count + copies, notes

    def count_faces(self, ranks: int) -> int:
        """Return the number of faces that are left with so many vertices."""
        source = living_ancestors(self.elimination, ranks)
        left = cut_faces(self.geometry.faces, source)[1]
        backs = self.geometry.backs
        return len(left) + (0 if backs is None else int(np.isin(left, backs.front).sum()))

    def _count_within(self, bound: float, work: Progress) -> int:
        """Return about the fewest points whose measured error is within the bound."""
        geometry = self.geometry
        in_length = self.parameters.error_unit == "length"
        bound *= geometry.to_unit if in_length else geometry.unit_diagonal
        order = np.argsort(self.elimination.rank)
        estimate = np.append(np.inf, self.elimination.error[order][:-1])
        part = work.part(0.0, 1.0, "Error")

        def measure(count: int) -> float:
            return self.simplify(count, 0.0).largest_error()

        start = int(np.count_nonzero(estimate > bound))
        return count_within(bound, start, len(order), measure, self.least, part)

    def simplify(
        self,
        count: int,
        begun: float,
        notes: list[str] | tuple[()] = (),
        progress: Progress = SILENT,
    ) -> Simplification:
        """Return the simplification to the first `count` ranks, and then to duplicates."""
        geometry, elimination, constraints = self.geometry, self.elimination, self.constraints
        # Protected duplicates stay besides; what is left of a cloud's count, others take.
        ranks = count - constraints.protected_copies
        source = living_ancestors(elimination, ranks)
        kept = np.flatnonzero(elimination.rank < ranks)
        faces = left = positions = origin = corners = heir = None
        if len(geometry.faces):
            faces, left = cut_faces(geometry.faces, source)
            origin = 3 * left[:, None] + np.arange(3)
            if self.parameters.placement == "optimal":
                positions = self._optimal_positions(source, faces)
            if self.parameters.refine:
                wedges = wedges_of_cut(elimination, constraints, ranks, origin)
                fixed = fixed_edges(faces, source, constraints.seams, constraints.staying, wedges)
                plane = geometry.plane
                apart = None if plane is None else plane.on_plane
                mesh = FlipMesh.of(faces, origin, len(source), fixed, apart)
                positions = self._refine(mesh, source, positions, progress)
                faces, origin = mesh.faces, mesh.corners
            corners, heir = corners_of_cut(geometry, elimination, constraints, ranks, origin)
            if begun:
                notes = [*notes, *self._losses(ranks, faces), *constraints.notes]
        progress(1.0)
        return self.result(
            kept,
            source,
            begun,
            faces=faces,
            face_source=left,
            positions=positions,
            corner_origin=origin,
            corners=corners,
            heir=heir,
            protected=constraints.protected_points,
            copies=ranks - len(elimination.rank),
            notes=tuple(notes),
            seams=None if constraints.wedges is None else constraints.wedges.seams,
        ).with_backs()

    def _optimal_positions(self, source: Indices, faces: Indices) -> Floats:
        """Return positions at the minima of quadrics, but of vertices that stay where they are."""
        points, constraints = self.geometry.points, self.constraints
        weight = self.parameters.border_weight
        positions = optimal_positions(
            points, self.geometry.faces, weight, source, faces, constraints.border
        )
        plane = self.geometry.plane
        if plane is not None:
            positions[plane.on_plane, plane.axis] = plane.at
        positions[constraints.staying] = points[constraints.staying]
        return positions

    def _refine(
        self, mesh: FlipMesh, source: Indices, positions: Floats | None, progress: Progress
    ) -> Floats | None:
        """Flip edges; return positions that are fitted, where there are some."""
        if positions is None:
            refine_faces(mesh, self.geometry.points, self.samples, source, progress)
            return None
        held, geometry = self.constraints.staying, self.geometry
        original = geometry.points, geometry.faces
        plane = geometry.plane
        if plane is not None:
            held = np.repeat(held[:, None], 3, axis=1)
            held[plane.on_plane, plane.axis] = True
        return fit_positions(mesh, positions, self.samples, source, held, original, progress)

    def _losses(self, ranks: int, faces: Indices) -> list[str]:
        """Return notes on the parts and the topology that the faces of a cut have lost."""
        elimination = self.elimination
        gone = int(np.count_nonzero(elimination.part_ranks >= ranks))
        if not gone and ranks >= elimination.topology_count:
            return []
        part = label_parts(self.geometry.faces, len(self.geometry.points))
        parts = int(part.max()) + 1
        notes = []
        if gone:
            notes.append(f"{gone} of {parts} parts went whole, those that matter least")
        if ranks < elimination.topology_count:
            before, after = (
                measure_topology(every, part, parts) for every in (self.geometry.faces, faces)
            )
            lost = topology_given_up(before, after)
            apart = int(np.count_nonzero((before.faces > 0) & (after.faces == 0))) - gone
            if apart > 0:
                lost.insert(0, f"{apart} part{'s'[: apart > 1]} without faces")
            if lost:
                notes.append(f"Topology: {', '.join(lost)}; keep_topology stops before that")
        return notes
