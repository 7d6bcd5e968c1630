# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of a geometry, and every simplification that can be made from it."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays.blocks import set_workers
from .arrays.types import Indices, Ints
from .cuts import Cuts
from .decimation.cut import Ranking, input_ranking
from .decimation.order import Elimination, eliminate
from .decimation.samples import Samples
from .decimation.surface import elimination_surface
from .decimation.targets import one_target
from .decimation.weights import weigh_removals
from .errors import ParameterError
from .halves import find_half_count, find_whole_seams, half_analysis, join_halves
from .input.constraints import Constraints, fingerprint
from .input.geometry import Geometry
from .input.twins import Twins, find_twins
from .maps import Maps
from .method.interest import select
from .progress import Callback, Progress
from .simplification import Simplification


@dataclass(eq=False)
class _Order:
    """The last constraints, by their fingerprint, and the order of elimination under them."""

    key: bytes = b""
    constraints: Constraints | None = None
    elimination: Elimination | None = None
    halves: dict[str, tuple[Twins, Analysis]] = field(default_factory=dict)
    """By the names of axes, what `Analysis.simplify` works on where it keeps a symmetry."""
    whole_seams: Ints | None = None
    """Of a half, the seams of the whole under the last constraints."""


@dataclass(frozen=True, eq=False)
class Analysis(Maps):
    """All that is known of a geometry before anyone says how much of it to keep: see `Maps`."""

    _order: _Order = field(init=False, default_factory=_Order, repr=False)

    @cached_property
    def _samples(self) -> Samples:
        """The mesh's vertices and the middles of its faces, by their area and saliency."""
        factor = 1.0 + self.parameters.detail * self.saliency_map.scaled
        return Samples.of_surface(self.geometry.points, self.geometry.faces, factor)

    def draft(self) -> Analysis:
        """Return the same analysis, whose cuts are neither refined nor moved, for previews.

        Both share the order of elimination; cuts of a draft come in a small part of the time.
        """
        parameters = dataclasses.replace(self.parameters, refine=False, placement="original")
        result = dataclasses.replace(self, parameters=parameters)
        object.__setattr__(result, "_order", self._order)
        return result

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
        corner_values: ArrayLike | Sequence[ArrayLike] | None = None,
        corner_normals: ArrayLike | None = None,
        keep_seams: bool = True,
        keep_border: bool = False,
        keep_topology: bool = False,
        point_values: ArrayLike | None = None,
        symmetry: str | None = None,
        progress: Callback | None = None,
        **target: float | None,
    ) -> Simplification:
        """Return the simplification for exactly one target.

        Parameters
        ----------
        ratio : float
            Share of the valid input points to keep, exact to the point. On a mesh equal points
            count once: one place may need several, for its corners' values.
        count : int
            Number of points to keep, exact, counted likewise.
        faces : int
            Number of faces of a mesh to keep, or the nearest below that points make.
        max_error : float
            Largest distance from an input point to the simplified surface, as the report measures
            it: a share of the diagonal, or a length with ``error_unit="length"``.
        alpha : float
            Threshold α of (4.7), in per cent, at least 0: more keeps fewer points.
        protect : (N,) array_like of bool, optional
            Points that are never removed; one that equals another counts for itself.
        importance : (N,) array_like of float, optional
            At least 0; a point's removal costs 1 + importance times as much.
        seams : (S, 2) array_like of int, optional
            Further edges of a mesh that stay as lines; a threshold α does not look at them.
        corner_values : (F, 3, d) array_like, or a list of such arrays, optional
            Values of the corners of all faces, one array a layer: texture coordinates, colours,
            a material's number. Edges on whose two sides a layer differs are seams, which stay as
            lines; no value goes over from one chart to another (`Simplification.face_corners`).
            Without, equal points are told apart: files split them along seams. An empty list
            says that there are no values: equal points are one.
        corner_normals : (F, 3, 3) array_like, optional
            One more layer: normals of the corners, which differ from 10 degrees on.
        keep_seams : bool
            False lets the seams of values go like other edges, but not those of `seams`; values
            still keep to their charts where they can.
        keep_border : bool
            Points on the border of a mesh, where edges have one face, neither move nor go: tiles
            that meet there still meet. A target of fewer points stops at these.
        keep_topology : bool
            No part of a mesh goes or falls apart, no hole or handle closes. A target of fewer
            points stops at the fewest with which that is so.
        point_values : (N, d) array_like of float, optional
            Values of points, such as colours, whose differences count beside distances, by
            `Parameters.attribute_weight`; the largest range among the columns is 1.
        symmetry : str, optional
            "x", "y" or "z": a mesh that is the same on both sides of the plane where this
            coordinate is 0 stays so. One half is simplified and mirrored; points go in twins, so
            that a target may be missed by one. What is protected or important on one side is so on
            the other; the plane ends no border.
        progress : callable, optional
            Called with stage and fraction; returning False cancels.

        Raises
        ------
        ParameterError
            If not exactly one target is given, or it is out of bounds.
        GeometryError
            If `protect` or `importance` is not one value a point, `seams` are no edges, values
            of corners are not for all corners, or a mesh is not symmetrical.
        Cancelled
            If `progress` returned False.

        Notes
        -----
        The order of elimination is worked out once and kept, unless what is given besides the
        target changes; every further count is a cut through it, in O(n),
        which on a mesh is refined (`Parameters.refine`).

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
        given: dict[str, Any] = {
            "protect": protect,
            "importance": importance,
            "seams": seams,
            "corner_values": corner_values,
            "corner_normals": corner_normals,
            "keep_seams": keep_seams,
            "keep_border": keep_border,
            "keep_topology": keep_topology,
            "point_values": point_values,
        }
        work = Progress(progress)
        with set_workers(self.parameters.workers):
            if symmetry is not None:
                return self._simplify_half(symmetry, name, value, given, begun, work)
            constraints = self._constrain(**given)
            if name == "alpha":
                return self._by_threshold(value, constraints, begun, work)
            cuts = self._cuts(constraints, work.part(0.0, 0.9))
            count, notes = cuts.find_count(name, value, work.part(0.9, 0.98))
            return cuts.simplify(count, begun, notes, work.part(0.98, 1.0, "Cut"))

    def _simplify_half(
        self,
        symmetry: str,
        name: str,
        value: float,
        given: dict[str, Any],
        begun: float,
        work: Progress,
    ) -> Simplification:
        """Simplify the half on one side of a plane, and mirror it."""
        if name == "alpha":
            raise ParameterError(
                "symmetry: a threshold α gives points and no faces; choose another target"
            )
        if symmetry not in self._order.halves:
            twins = find_twins(self.geometry, symmetry)
            part = work.part(0.0, 0.1, "Half")
            self._order.halves[symmetry] = twins, half_analysis(self, twins, part)
        twins, half = self._order.halves[symmetry]
        if half.parameters is not self.parameters:  # of a draft
            order = half._order
            half = dataclasses.replace(half, parameters=self.parameters)
            object.__setattr__(half, "_order", order)
        constraints = half._constrain(twins, self.geometry, **given)
        cuts = half._cuts(constraints, work.part(0.1, 0.9))
        part = work.part(0.9, 0.98)
        count, notes = find_half_count(self.geometry, cuts, name, value, part)
        result = cuts.simplify(count, begun, notes, work.part(0.98, 1.0, "Cut"))
        seams = half._order.whole_seams
        return join_halves(self.geometry, self.frames.normals, twins, result, seams)

    def _cuts(self, constraints: Constraints, work: Progress) -> Cuts:
        """Return the cuts through the order under the last constraints."""
        elimination = self._eliminate(constraints, work)
        given = self.geometry, elimination, constraints, self.parameters, self._samples
        return Cuts(*given, self._result)

    def ranking(
        self,
        *,
        protect: ArrayLike | None = None,
        importance: ArrayLike | None = None,
        seams: ArrayLike | None = None,
        corner_values: ArrayLike | Sequence[ArrayLike] | None = None,
        corner_normals: ArrayLike | None = None,
        keep_seams: bool = True,
        keep_border: bool = False,
        keep_topology: bool = False,
        point_values: ArrayLike | None = None,
        progress: Callback | None = None,
    ) -> Ranking:
        """Return the order in which input points go, for any number kept.

        Parameters
        ----------
        protect, importance, seams, corner_values, corner_normals, keep_seams, progress
            As in `simplify`.
        point_values
            As in `simplify`.
        keep_border, keep_topology
            As in `simplify`; the host keeps to `Ranking.least`.

        Examples
        --------
        >>> import numpy as np, salcore
        >>> analysis = salcore.analyze(np.random.default_rng(0).random((500, 3)))
        >>> kept = np.flatnonzero(analysis.ranking().rank < 50)
        >>> bool((kept == analysis.simplify(count=50).indices).all())
        True
        """
        constraints = self._constrain(
            protect=protect,
            importance=importance,
            seams=seams,
            corner_values=corner_values,
            corner_normals=corner_normals,
            keep_seams=keep_seams,
            keep_border=keep_border,
            keep_topology=keep_topology,
            point_values=point_values,
        )
        work = Progress(progress)
        with set_workers(self.parameters.workers):
            elimination = self._eliminate(constraints, work.part(0.0, 0.9))
        work.part(1.0, 1.0, "Ranking")
        return input_ranking(self.geometry, elimination, constraints)

    def _constrain(
        self, twins: Twins | None = None, whole: Geometry | None = None, **given: Any
    ) -> Constraints:
        """Return the constraints that are given, the last ones if these were given alike.

        Those of a half are made from what is given for the whole.
        """
        key = fingerprint(**given)
        if self._order.constraints is None or self._order.key != key:
            if twins is not None and whole is not None:
                self._order.whole_seams = find_whole_seams(whole, given)
                given = twins.on_both_sides(given)
            self._order.constraints = Constraints.check(self.geometry, **given)
            self._order.key, self._order.elimination = key, None
        return self._order.constraints

    def _by_threshold(
        self, alpha: float, constraints: Constraints, begun: float, work: Progress
    ) -> Simplification:
        """Keep the paper's interest points."""
        work.part(0.0, 0.5, "Regions")
        keep = self.extremities | constraints.staying
        part = work.part(0.5, 1.0, "Interest points")
        interest, source = select(
            self.geometry,
            self.graph,
            self.saliency_map.scaled,
            self.components,
            keep,
            alpha,
            self.parameters,
            part,
        )
        part(1.0)
        kept = np.flatnonzero(interest.kept)
        return self._result(
            kept,
            source,
            begun,
            protected=constraints.protected_points,
            interest=interest,
            regions=self.components.count,
        )

    def _eliminate(self, constraints: Constraints, work: Progress) -> Elimination:
        """Return the order of elimination under the last constraints."""
        if self._order.elimination is None:
            part = work.part(0.0, 0.1, "Surface")
            faces, links = elimination_surface(self.geometry, self.graph, self.parameters, part)
            part = work.part(0.1, 0.2)
            weights = weigh_removals(
                self.geometry,
                self.frames,
                self.saliency_map.scaled,
                constraints,
                self.parameters,
                extremities=self.extremities if self.parameters.interest_weight else None,
                interest=self._interest_cost(part),
            )
            lines = np.concatenate([constraints.seams, self._region_lines(faces, part)])
            part, plane = work.part(0.2, 1.0, "Elimination"), self.geometry.plane
            self._order.elimination = eliminate(
                self.geometry.points,
                faces,
                links,
                weights,
                lines,
                progress=part,
                priority=self.geometry.priority,
                wedges=constraints.wedges,
                keep_topology=constraints.keep_topology and len(self.geometry.faces) > 0,
                on_plane=None if plane is None else plane.on_plane,
            )
        return self._order.elimination

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
