# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages in order: `analyze` a geometry once, then `simplify` it as often as you like."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ParameterError
from .frames import Frames, build_frames
from .geometry import Floats, Geometry, Indices, clean
from .graph import Graph, build_graph
from .interest import Interest, boundary_extremities, select
from .metrics import Errors, Surface, compare
from .parameters import TARGETS, Parameters
from .progress import Callback, Progress, run, staged
from .regions import Regions, build_regions
from .saliency import Saliency, build_saliency


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

    def interest(self, alpha: float) -> NDArray[np.bool_]:
        """Return (N,) bool: the input points that `simplify(alpha=alpha)` keeps."""
        mask = np.zeros(self.geometry.input_count, dtype=bool)
        mask[self.simplify(alpha=alpha).indices] = True
        return mask

    def simplify(
        self, *, alpha: float | None = None, progress: Callback | None = None
    ) -> Simplification:
        """Return the simplification for exactly one target.

        Parameters
        ----------
        alpha : float
            Threshold α of (4.7), in per cent, at least 0: more keeps fewer points.
        progress : callable, optional
            Called with stage and fraction; returning False cancels.

        Raises
        ------
        ParameterError
            If no target is given, or one is out of bounds.
        Cancelled
            If `progress` returned False.
        """
        return run(self.simplify_steps(alpha=alpha), progress)

    def simplify_steps(
        self, *, alpha: float | None = None
    ) -> Generator[Progress, None, Simplification]:
        """Yield progress and return what `simplify` returns; for hosts that work in slices."""
        (target,) = TARGETS
        if alpha is None:
            raise ParameterError("no target given: give alpha")
        alpha = target.check(alpha)
        begun = time.perf_counter()
        yield Progress("Interest points", 0.0)
        interest, source = select(
            self.geometry,
            self.graph,
            self.saliency_map.scaled,
            self.segmentation,
            self.extremities,
            alpha,
            self.parameters,
        )
        kept = np.flatnonzero(interest.kept)
        return Simplification(
            analysis=self,
            interest=interest,
            indices=self.geometry.input_of[kept].astype(np.int64),
            faces=None,
            source=self._sources(kept, source),
            seconds=time.perf_counter() - begun,
        )

    def _sources(self, kept: Indices, source: Indices) -> NDArray[np.int64]:
        """Return the position among the kept for every input point, from sources of vertices."""
        position = np.full(len(source) + 1, -1, dtype=np.int64)
        position[kept] = np.arange(len(kept))
        return self._of_input(position[source], -1)

    def _of_input(self, values: NDArray[Any], missing: float) -> NDArray[Any]:
        """Spread values of vertices over the input points."""
        vertex = self.geometry.vertex_of
        if not len(values):
            return np.full((len(vertex), *values.shape[1:]), missing, dtype=values.dtype)
        result = values[vertex]
        result[vertex < 0] = missing
        return result


@dataclass(frozen=True)
class Report:
    """Figures of one simplification.

    Attributes
    ----------
    points_before, points_after : int
        Input points, and kept ones.
    rate : float
        Share of the input points that went.
    dropped, welded : int
        Input points that were not finite, and that equalled another.
    regions : int
        Regions of like saliency.
    extremities, salient, fillers, guards : int
        Kept points by reason: on a boundary, salient, by the gap rule, by the coverage guard. A
        point may have several.
    errors : Errors
        Between all clean input points and the kept ones, in the input's unit. The surface is that
        of the tangent planes at the kept points.
    seconds_analysis, seconds_selection : float
    """

    points_before: int
    points_after: int
    rate: float
    dropped: int
    welded: int
    regions: int
    extremities: int
    salient: int
    fillers: int
    guards: int
    errors: Errors
    seconds_analysis: float
    seconds_selection: float

    def as_dict(self) -> dict[str, Any]:
        """Return nested dicts, ready for JSON."""
        return dataclasses.asdict(self)


@dataclass(frozen=True, eq=False)
class Simplification:
    """What is kept, and what stands for the rest.

    Attributes
    ----------
    analysis : Analysis
    interest : Interest
        Why each vertex stays.
    indices : (M,) int64
        Kept input points, ascending.
    faces : (K, 3) int64 or None
        Faces over positions in `indices`; None for a cloud.
    source : (N,) int64
        Position in `indices` of the kept point that stands for each input point; -1 for dropped
        points.
    seconds : float
        Time the selection took.
    """

    analysis: Analysis
    interest: Interest
    indices: NDArray[np.int64]
    faces: NDArray[np.int64] | None
    source: NDArray[np.int64]
    seconds: float

    @cached_property
    def report(self) -> Report:
        """Figures, measured when first asked for."""
        geometry, interest = self.analysis.geometry, self.interest
        finite = int(np.count_nonzero(geometry.vertex_of >= 0))
        before, after = geometry.input_count, len(self.indices)
        return Report(
            points_before=before,
            points_after=after,
            rate=1.0 - after / before if before else 0.0,
            dropped=before - finite,
            welded=finite - len(geometry.points),
            regions=self.analysis.segmentation.count,
            extremities=int(interest.extremities.sum()),
            salient=int(interest.salient.sum()),
            fillers=int(interest.fillers.sum()),
            guards=int(interest.guards.sum()),
            errors=self._errors(),
            seconds_analysis=self.analysis.seconds,
            seconds_selection=self.seconds,
        )

    def _errors(self) -> Errors:
        """Measure in the clean vertices' frame and return lengths in the input's unit."""
        geometry, kept = self.analysis.geometry, self.interest.kept
        points, normals = geometry.points / geometry.scale, self.analysis.frames.normals
        none = np.empty((0, 3), dtype=np.intp)
        return compare(
            Surface(points, none, normals),
            Surface(points[kept], none, normals[kept]),
            workers=self.analysis.parameters.workers,
        )


def analyze(
    points: ArrayLike,
    faces: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
    *,
    progress: Callback | None = None,
) -> Analysis:
    """Analyse a point cloud or a triangle mesh: graph, saliency, regions.

    Parameters
    ----------
    points : (N, 3) array_like of real numbers
        In any unit; results do not change under translation, rotation and uniform scale, up to
        rounding. NaN and infinite points are dropped or refused (`Parameters.invalid`).
    faces : (F, 3) array_like of integers, optional
        Triangles. Points that no face uses are points too, with neighbours among themselves.
    normals : (N, 3) array_like of real numbers, optional
    parameters : Parameters, optional
        ``Parameters()`` if left out.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.

    Raises
    ------
    GeometryError
        If an array cannot be understood.
    Cancelled
        If `progress` returned False.

    Notes
    -----
    O(n log n) time, in some 600 bytes a point at the peak for the default parameters.

    Examples
    --------
    >>> import numpy as np, salcore
    >>> grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0)), axis=-1).reshape(-1, 2)
    >>> roof = np.column_stack([grid, np.abs(grid[:, 0] - 4.0)])
    >>> analysis = salcore.analyze(roof)
    >>> bool(analysis.saliency[grid[:, 0] == 4].min() > analysis.saliency[grid[:, 0] == 1].max())
    True
    """
    return run(analysis_steps(points, faces, normals, parameters), progress)


def analysis_steps(
    points: ArrayLike,
    faces: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
) -> Generator[Progress, None, Analysis]:
    """Yield progress and return what `analyze` returns; for hosts that work in slices."""
    parameters = parameters or Parameters()
    begun = time.perf_counter()
    yield Progress("Input", 0.0)
    geometry = clean(points, faces, normals, parameters)
    graph = yield from staged("Graph", 0.05, 0.6, build_graph(geometry, parameters))
    frames = yield from staged("Normals", 0.6, 0.75, build_frames(geometry, graph, parameters))
    saliency = yield from staged(
        "Saliency", 0.75, 0.9, build_saliency(geometry, graph, frames, parameters)
    )
    yield Progress("Regions", 0.9)
    regions = build_regions(geometry, graph, saliency.scaled, parameters.tolerance)
    extremities = boundary_extremities(geometry.points, regions, parameters.collinear_angle)
    yield Progress("Regions", 1.0)
    seconds = time.perf_counter() - begun
    return Analysis(geometry, graph, frames, saliency, regions, extremities, parameters, seconds)


def simplify(
    points: ArrayLike,
    faces: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
    *,
    alpha: float | None = None,
    progress: Callback | None = None,
) -> Simplification:
    """Analyse and simplify in one call; see `analyze` and `Analysis.simplify`."""
    analysis = analyze(points, faces, normals, parameters, progress=progress)
    return analysis.simplify(alpha=alpha, progress=progress)
