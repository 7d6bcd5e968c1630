# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of a geometry, and every simplification that can be made from it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays.blocks import set_workers
from .arrays.types import Floats, Indices, Mask
from .decimation.costs import Weights
from .decimation.cut import Ranking, cut_faces, input_ranking, living_ancestors, optimal_positions
from .decimation.fitting import fit_positions
from .decimation.flips import FlipMesh
from .decimation.order import Elimination, eliminate
from .decimation.refine import fixed_edges, refine_faces
from .decimation.samples import Samples
from .decimation.surface import GUESSED_BORDER, elimination_surface
from .decimation.targets import count_for, count_within, one_target
from .input.constraints import Constraints
from .input.geometry import Geometry
from .method.frames import Frames
from .method.graph import Graph
from .method.interest import boundary_extremities, select
from .method.regions import Regions, build_regions
from .method.saliency import Saliency
from .parameters import Parameters
from .progress import SILENT, Callback, Progress
from .simplification import Simplification


@dataclass(eq=False)
class _Order:
    """The last order of elimination, and what it was made for."""

    key: tuple[bytes, ...] = ()
    elimination: Elimination | None = None


@dataclass(frozen=True, eq=False)
class Analysis:
    """All that is known of a geometry before anyone says how much of it to keep.

    Attributes
    ----------
    geometry : Geometry
        The cleaned input. The attributes below speak of its n vertices.
    graph : Graph
    frames : Frames
    saliency_map : Saliency
    segmentation : Regions
        Worked out when first asked for.
    extremities : (n,) bool
        Interest points on the regions' boundaries; they do not depend on α. Worked out when first
        asked for.
    parameters : Parameters
    seconds : float
        Time the analysis took.
    """

    geometry: Geometry
    graph: Graph
    frames: Frames
    saliency_map: Saliency
    parameters: Parameters
    seconds: float
    _order: _Order = field(init=False, default_factory=_Order, repr=False)

    @cached_property
    def segmentation(self) -> Regions:
        with set_workers(self.parameters.workers):
            return build_regions(
                self.geometry, self.graph, self.saliency_map.scaled, self.parameters.tolerance
            )

    @cached_property
    def extremities(self) -> Mask:
        angle = self.parameters.collinear_angle
        return boundary_extremities(self.geometry.points, self.segmentation, angle)

    @property
    def saliency(self) -> Floats:
        """(N,) float64 in [0, 1] over all input points, high = salient; 0 for dropped points."""
        return self._of_input(self.saliency_map.scaled, 0.0)

    @property
    def regions(self) -> NDArray[np.int64]:
        """(N,) int64 region of every input point, numbered from 0; -1 for dropped points."""
        return self._of_input(self.segmentation.labels, -1).astype(np.int64)

    @property
    def normals(self) -> Floats:
        """(N, 3) float64 unit normals of all input points; zero where there is none."""
        return self._of_input(self.frames.normals, 0.0)

    @property
    def rounds(self) -> tuple[tuple[int, int, float], ...]:
        """Living vertices, collapses and largest cost of each round of the last elimination."""
        return () if self._order.elimination is None else self._order.elimination.rounds

    def simplify(
        self,
        *,
        protect: ArrayLike | None = None,
        importance: ArrayLike | None = None,
        seams: ArrayLike | None = None,
        progress: Callback | None = None,
        **target: float | None,
    ) -> Simplification:
        """Return the simplification for exactly one target.

        Parameters
        ----------
        ratio : float
            Share of the valid input points to keep, exact to the point.
        count : int
            Number of points to keep, exact.
        max_error : float
            Largest distance from an input point to the simplified surface, as the report measures
            it: a share of the diagonal, or a length with ``error_unit="length"``.
        alpha : float
            Threshold α of (4.7), in per cent, at least 0: more keeps fewer points.
        protect : (N,) array_like of bool, optional
            Points that are never removed.
        importance : (N,) array_like of float, optional
            At least 0; a point's removal costs 1 + importance times as much.
        seams : (S, 2) array_like of int, optional
            Edges of a mesh that stay as lines, such as `find_seams` finds in texture coordinates;
            a threshold α does not look at them.
        progress : callable, optional
            Called with stage and fraction; returning False cancels.

        Raises
        ------
        ParameterError
            If not exactly one target is given, or it is out of bounds.
        GeometryError
            If `protect` or `importance` is not one value a point, or `seams` are no edges.
        Cancelled
            If `progress` returned False.

        Notes
        -----
        The order of elimination is worked out once and kept, unless `protect`, `importance` or
        `seams` change; every further count is a cut through it, in O(n), which then is refined.

        Results depend on nothing but the input. The order of its points decides ties: which points
        a coverage guard adds (`Parameters.max_gap`), and a lattice's diagonals.

        Examples
        --------
        See `salcore.simplify` for both steps in one.

        >>> import numpy as np, salcore
        >>> analysis = salcore.analyze(np.random.default_rng(0).random((500, 3)))
        >>> light, lighter = analysis.simplify(ratio=0.2), analysis.simplify(count=20)
        >>> len(light.indices), set(lighter.indices) <= set(light.indices)
        (100, True)
        """
        name, value = one_target(target)
        begun = time.perf_counter()
        constraints = Constraints.check(self.geometry, protect, importance, seams)
        work = Progress(progress)
        with set_workers(self.parameters.workers):
            if name == "alpha":
                return self._by_threshold(value, constraints.protect, begun, work)
            elimination = self._eliminate(constraints, work.part(0.0, 0.9))
            available = int(np.count_nonzero(self.geometry.vertex_of >= 0))
            protected = int(constraints.protect.sum())
            if name == "max_error":
                count = self._within_error(elimination, constraints, value, work.part(0.9, 0.98))
            else:
                count = count_for(name, value, available, protected)
            part = work.part(0.98, 1.0, "Cut")
            return self._cut(elimination, constraints, count, begun, part)

    def ranking(
        self,
        *,
        protect: ArrayLike | None = None,
        importance: ArrayLike | None = None,
        seams: ArrayLike | None = None,
        progress: Callback | None = None,
    ) -> Ranking:
        """Return the order in which input points go, for any number kept.

        Parameters
        ----------
        protect, importance, seams, progress
            As in `simplify`.

        Examples
        --------
        >>> import numpy as np, salcore
        >>> analysis = salcore.analyze(np.random.default_rng(0).random((500, 3)))
        >>> kept = np.flatnonzero(analysis.ranking().rank < 50)
        >>> bool((kept == analysis.simplify(count=50).indices).all())
        True
        """
        constraints = Constraints.check(self.geometry, protect, importance, seams)
        work = Progress(progress)
        with set_workers(self.parameters.workers):
            elimination = self._eliminate(constraints, work.part(0.0, 0.9))
        work.part(1.0, 1.0, "Ranking")
        return input_ranking(self.geometry, elimination)

    def _by_threshold(
        self, alpha: float, protect: Mask, begun: float, work: Progress
    ) -> Simplification:
        """Keep the paper's interest points."""
        work.part(0.0, 0.5, "Regions")
        keep = self.extremities | protect
        part = work.part(0.5, 1.0, "Interest points")
        interest, source = select(
            self.geometry,
            self.graph,
            self.saliency_map.scaled,
            self.segmentation,
            keep,
            alpha,
            self.parameters,
            part,
        )
        part(1.0)
        kept = np.flatnonzero(interest.kept)
        regions = self.segmentation.count
        return self._result(kept, source, begun, interest=interest, regions=regions)

    def _eliminate(self, constraints: Constraints, work: Progress) -> Elimination:
        """Return the order of elimination, the last one if it had the same constraints."""
        if self._order.elimination is None or self._order.key != constraints.key:
            part = work.part(0.0, 0.1, "Surface")
            faces, links = elimination_surface(self.geometry, self.graph, self.parameters, part)
            weights = self._weights(constraints)
            part = work.part(0.1, 1.0, "Elimination")
            elimination = eliminate(
                self.geometry.points,
                faces,
                links,
                weights,
                constraints.seams,
                progress=part,
                priority=self.geometry.priority,
            )
            self._order.key, self._order.elimination = constraints.key, elimination
        return self._order.elimination

    def _weights(self, constraints: Constraints) -> Weights:
        """Return what each removal costs beside its quadric error."""
        parameters, faces = self.parameters, self.geometry.faces
        loose = np.ones(len(self.geometry.points), dtype=bool)
        loose[faces] = False
        factor = 1.0 + parameters.detail * self.saliency_map.scaled
        factor *= 1.0 + constraints.importance
        if parameters.interest_weight:
            factor *= 1.0 + parameters.interest_weight * self.extremities
        return Weights(
            factor,
            evenness=parameters.evenness * loose,
            guessed_surface=loose,
            protected=constraints.protect,
            border=parameters.border_weight * (1.0 if len(faces) else GUESSED_BORDER),
        )

    def _within_error(
        self, elimination: Elimination, constraints: Constraints, bound: float, work: Progress
    ) -> int:
        """Return about the fewest vertices whose measured error is within the bound."""
        geometry = self.geometry
        in_length = self.parameters.error_unit == "length"
        bound *= geometry.to_unit if in_length else geometry.unit_diagonal
        order = np.empty_like(elimination.rank)
        order[elimination.rank] = np.arange(len(order))
        estimate = np.append(np.inf, elimination.error[order][:-1])
        least = max(int(constraints.protect.sum()), 1)
        part = work.part(0.0, 1.0, "Error")

        def measure(count: int) -> float:
            return self._cut(elimination, constraints, count, 0.0).largest_error()

        return count_within(bound, estimate, measure, least, part)

    @cached_property
    def _samples(self) -> Samples:
        """The mesh's vertices and the middles of its faces, by their area and saliency."""
        factor = 1.0 + self.parameters.detail * self.saliency_map.scaled
        return Samples.of_surface(self.geometry.points, self.geometry.faces, factor)

    def _cut(
        self,
        elimination: Elimination,
        constraints: Constraints,
        count: int,
        begun: float,
        progress: Progress = SILENT,
    ) -> Simplification:
        """Return the simplification to the first `count` ranks, and then to duplicates."""
        source = living_ancestors(elimination, count)
        kept = np.flatnonzero(elimination.rank < count)
        mesh: dict[str, Any] = {}
        if len(self.geometry.faces):
            mesh = self._cut_mesh(source, constraints, progress)
        progress(1.0)
        return self._result(kept, source, begun, copies=count - len(kept), **mesh)

    def _cut_mesh(
        self, source: Indices, constraints: Constraints, progress: Progress
    ) -> dict[str, Any]:
        """Return faces, where they come from, and positions, all of them refined."""
        geometry, parameters = self.geometry, self.parameters
        faces, left = cut_faces(geometry.faces, source)
        corners = 3 * left[:, None] + np.arange(3)
        positions = None
        if parameters.placement == "optimal":
            weight = parameters.border_weight
            positions = optimal_positions(geometry.points, geometry.faces, weight, source, faces)
            positions[constraints.protect] = geometry.points[constraints.protect]
        if parameters.refine:
            fixed = fixed_edges(faces, source, constraints.seams, constraints.protect)
            mesh = FlipMesh.of(faces, corners, len(source), fixed)
            if positions is None:
                refine_faces(mesh, geometry.points, self._samples, source, progress)
            else:
                positions = fit_positions(
                    mesh, positions, self._samples, source, constraints.protect, progress
                )
            faces, corners = mesh.faces, mesh.corners
        return {
            "faces": faces,
            "face_source": left,
            "corner_origin": corners,
            "positions": positions,
        }

    def _result(
        self,
        kept: Indices,
        source: Indices,
        begun: float,
        *,
        regions: int | None = None,
        **others: Any,
    ) -> Simplification:
        """Translate a selection of vertices into a result over input points."""
        return Simplification.of_vertices(
            self.geometry,
            kept,
            source,
            normals=self.frames.normals,
            regions=regions,
            workers=self.parameters.workers,
            seconds_analysis=self.seconds,
            seconds=time.perf_counter() - begun,
            **others,
        )

    def _of_input(self, values: NDArray[Any], missing: float) -> NDArray[Any]:
        """Spread values of vertices over the input points."""
        vertex = self.geometry.vertex_of
        if not len(values):
            return np.full((len(vertex), *values.shape[1:]), missing, dtype=values.dtype)
        result = values[vertex]
        result[vertex < 0] = missing
        return result
