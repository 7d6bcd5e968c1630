# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages in order: `analyze` a geometry once, then `simplify` it as often as you like."""

from __future__ import annotations

import time
from collections.abc import Generator

from numpy.typing import ArrayLike

from .analysis import Analysis
from .frames import build_frames
from .geometry import clean_steps
from .graph import build_graph
from .interest import segment_steps
from .memory import check_memory
from .parameters import Parameters, checked
from .progress import Callback, Progress, part, run, staged
from .result import Simplification
from .saliency import build_saliency
from .targets import one_target

ANALYSIS_SHARE = 0.4  # of the time that an analysis and an elimination take


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
    ParameterError
        If `parameters` are none.
    MemoryLimitError
        If it would take more memory than is free (`Parameters.memory_check`).
    Cancelled
        If `progress` returned False.

    Notes
    -----
    O(n log n) time; for memory see `estimated_memory`.

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
    parameters = checked(parameters)
    check_memory(points, faces, parameters)
    begun = time.perf_counter()
    door = clean_steps(points, faces, normals, parameters)
    geometry = yield from staged("Input", 0.0, 0.05, door)
    graph = yield from staged("Graph", 0.05, 0.6, build_graph(geometry, parameters))
    frames = yield from staged("Normals", 0.6, 0.75, build_frames(geometry, graph, parameters))
    saliency = yield from staged(
        "Saliency", 0.75, 0.9, build_saliency(geometry, graph, frames, parameters)
    )
    parts = segment_steps(geometry, graph, saliency.scaled, parameters)
    regions, extremities = yield from staged("Regions", 0.9, 1.0, parts)
    yield Progress("Regions", 1.0)
    seconds = time.perf_counter() - begun
    return Analysis(geometry, graph, frames, saliency, regions, extremities, parameters, seconds)


def simplify(
    points: ArrayLike,
    faces: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
    *,
    protect: ArrayLike | None = None,
    importance: ArrayLike | None = None,
    seams: ArrayLike | None = None,
    progress: Callback | None = None,
    **target: float | None,
) -> Simplification:
    """Analyse and simplify in one call; see `analyze` and `Analysis.simplify`.

    Examples
    --------
    >>> import numpy as np, salcore
    >>> cloud = np.random.default_rng(0).random((1000, 3))
    >>> len(salcore.simplify(cloud, ratio=0.25).indices)
    250
    """
    one_target(target)  # before the long part

    def steps() -> Generator[Progress, None, Simplification]:
        analysis = yield from part(
            0.0, ANALYSIS_SHARE, analysis_steps(points, faces, normals, parameters)
        )
        rest = analysis.simplify_steps(
            protect=protect, importance=importance, seams=seams, **target
        )
        return (yield from part(ANALYSIS_SHARE, 1.0, rest))

    return run(steps(), progress)
