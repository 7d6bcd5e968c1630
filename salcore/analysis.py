# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of a geometry, and every simplification that can be made from it."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .costs import Weights
from .frames import Frames
from .geometry import Floats, Geometry, Indices
from .graph import Graph
from .interest import select
from .levels import cut_faces, living_ancestors, optimal_positions
from .parameters import Parameters
from .progress import Callback, Progress, Rests, run, staged
from .progressive import Elimination, eliminate
from .ranking import Ranking, input_ranking
from .regions import Regions
from .result import Simplification
from .saliency import Saliency
from .surface import GUESSED_BORDER, elimination_surface
from .targets import count_for, count_within, one_target
from .wishes import Wishes


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
    extremities : (n,) bool
        Interest points on the regions' boundaries; they do not depend on α.
    parameters : Parameters
    seconds : float
        Time the analysis took.
    """

    geometry: Geometry
    graph: Graph
    frames: Frames
    saliency_map: Saliency
    segmentation: Regions
    extremities: NDArray[np.bool_]
    parameters: Parameters
    seconds: float
    _order: _Order = field(init=False, default_factory=_Order, repr=False)

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
        `seams` change; every further count is a cut through it, in O(n).

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
        steps = self.simplify_steps(protect=protect, importance=importance, seams=seams, **target)
        return run(steps, progress)

    def simplify_steps(
        self,
        *,
        protect: ArrayLike | None = None,
        importance: ArrayLike | None = None,
        seams: ArrayLike | None = None,
        **target: float | None,
    ) -> Generator[Progress, None, Simplification]:
        """Yield progress and return what `simplify` returns; for hosts that work in slices."""
        name, value = one_target(target)
        begun = time.perf_counter()
        wishes = Wishes.check(self.geometry, protect, importance, seams)
        if name == "alpha":
            steps = self._by_threshold(value, wishes.protect, begun)
            result = yield from staged("Interest points", 0.0, 1.0, steps)
            yield Progress("Interest points", 1.0)
            return result
        elimination = yield from self._eliminate(wishes)
        available = int(np.count_nonzero(self.geometry.vertex_of >= 0))
        if name == "max_error":
            count = yield from self._within_error(elimination, value, int(wishes.protect.sum()))
        else:
            count = count_for(name, value, available, int(wishes.protect.sum()))
        return (yield from staged("Cut", 1.0, 1.0, self._cut(elimination, count, begun)))

    def ranking_steps(
        self,
        *,
        protect: ArrayLike | None = None,
        importance: ArrayLike | None = None,
        seams: ArrayLike | None = None,
    ) -> Generator[Progress, None, Ranking]:
        """Yield progress and return the order in which input points go, for any number kept.

        Examples
        --------
        >>> import numpy as np, salcore
        >>> analysis = salcore.analyze(np.random.default_rng(0).random((500, 3)))
        >>> ranking = salcore.run(analysis.ranking_steps())
        >>> kept = np.flatnonzero(ranking.rank < 50)
        >>> bool((kept == analysis.simplify(count=50).indices).all())
        True
        """
        wishes = Wishes.check(self.geometry, protect, importance, seams)
        elimination = yield from self._eliminate(wishes)
        yield Progress("Ranking", 1.0)
        return input_ranking(self.geometry, elimination)

    def _by_threshold(
        self, alpha: float, protect: NDArray[np.bool_], begun: float
    ) -> Rests[Simplification]:
        """Keep the paper's interest points."""
        interest, source = yield from select(
            self.geometry,
            self.graph,
            self.saliency_map.scaled,
            self.segmentation,
            self.extremities | protect,
            alpha,
            self.parameters,
        )
        kept = np.flatnonzero(interest.kept)
        return self._result(kept, source, begun, interest=interest)

    def _eliminate(self, wishes: Wishes) -> Generator[Progress, None, Elimination]:
        """Return the order of elimination, the last one if it was made for the same wishes."""
        if self._order.elimination is None or self._order.key != wishes.key:
            parameters = self.parameters
            steps = elimination_surface(self.geometry, self.graph, parameters)
            faces, links = yield from staged("Surface", 0.0, 0.1, steps)
            loose = np.ones(len(self.geometry.points), dtype=bool)
            loose[self.geometry.faces] = False
            factor = (1.0 + parameters.detail * self.saliency_map.scaled) * (
                1.0 + wishes.importance
            )
            weights = Weights(
                factor * (1.0 + parameters.interest_weight * self.extremities),
                parameters.evenness * loose,
                loose,
                wishes.protect,
                parameters.border_weight * (1.0 if len(self.geometry.faces) else GUESSED_BORDER),
            )
            order = eliminate(
                self.geometry.points, faces, links, weights, parameters.workers, wishes.seams
            )
            elimination = yield from staged("Elimination", 0.1, 0.9, order)
            self._order.key, self._order.elimination = wishes.key, elimination
        return self._order.elimination

    def _within_error(
        self, elimination: Elimination, bound: float, protected: int
    ) -> Generator[Progress, None, int]:
        """Return about the fewest vertices whose measured error is within the bound."""
        geometry = self.geometry
        unit = geometry.scale if self.parameters.error_unit == "length" else geometry.size
        bound *= unit
        order = np.empty_like(elimination.rank)
        order[elimination.rank] = np.arange(len(order))
        estimate = np.append(np.inf, elimination.error[order][:-1])

        def measure(count: int) -> Rests[float]:
            cut = yield from self._cut(elimination, count, 0.0)
            return (yield from cut.largest_error())

        steps = count_within(bound, estimate, measure, max(protected, 1))
        return (yield from staged("Error", 0.9, 1.0, steps))

    def _cut(self, elimination: Elimination, count: int, begun: float) -> Rests[Simplification]:
        """Return the simplification to the first `count` ranks, and then to duplicates."""
        geometry, workers = self.geometry, self.parameters.workers
        source = yield from living_ancestors(elimination, count)
        yield
        kept = np.flatnonzero(elimination.rank < count)
        faces = left = positions = None
        if len(geometry.faces):
            faces, left = yield from cut_faces(geometry.faces, source, workers)
        if faces is not None and self.parameters.placement == "optimal":
            weight = self.parameters.border_weight
            positions = yield from optimal_positions(
                geometry.points, geometry.faces, weight, source, faces, workers
            )
        yield
        return self._result(
            kept,
            source,
            begun,
            faces=faces,
            face_source=left,
            positions=positions,
            copies=count - len(kept),
        )

    def _result(
        self, kept: Indices, source: Indices, begun: float, *, copies: int = 0, **others: Any
    ) -> Simplification:
        """Bring kept vertices, and so many copies welded to them, into the input's numbers."""
        return Simplification.of_vertices(
            self.geometry,
            kept,
            source,
            copies=copies,
            normals=self.frames.normals,
            regions=self.segmentation.count,
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
