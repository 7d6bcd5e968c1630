# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages in order: `analyze` a geometry once, then `simplify` it as often as you like."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .analysis import Analysis
from .arrays.blocks import set_workers
from .decimation.targets import one_target
from .input.geometry import clean
from .input.memory import check_memory
from .method.frames import build_frames
from .method.graph import build_graph
from .method.saliency import build_saliency
from .parameters import Parameters, checked
from .progress import Callback, Progress
from .simplification import Simplification

ANALYSIS_SHARE = 0.4  # of the time that an analysis and an elimination take


def analyze(
    points: ArrayLike,
    faces: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
    *,
    progress: Callback | None = None,
) -> Analysis:
    """Analyse a point cloud or a triangle mesh: graph, normals, saliency.

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
        If `parameters` is not a `Parameters`.
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
    parameters = checked(parameters)
    check_memory(points, faces, parameters)
    begun = time.perf_counter()
    work = Progress(progress)
    with set_workers(parameters.workers):
        work.part(0.0, 0.05, "Input")
        geometry = clean(points, faces, normals, parameters)
        part = work.part(0.05, 0.65, "Graph")
        graph = build_graph(geometry, parameters, part)
        part = work.part(0.65, 0.8, "Normals")
        frames = build_frames(geometry, graph, parameters, part)
        part = work.part(0.8, 1.0, "Saliency")
        saliency = build_saliency(geometry.points, graph, frames, parameters, part)
        part(1.0)
    return Analysis(geometry, graph, frames, saliency, parameters, time.perf_counter() - begun)


def simplify(
    points: ArrayLike,
    triangles: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
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
    **target: Any,
) -> Simplification:
    """Analyse and simplify in one call; see `analyze` and `Analysis.simplify`.

    Parameters
    ----------
    points, triangles
        As the first two arguments of `analyze`. Triangles may be given as ``faces=`` as well; a
        number there is the target.
    normals, parameters
        As in `analyze`.
    **target
        One target, such as ``ratio=0.1``.

    Examples
    --------
    >>> import numpy as np, salcore
    >>> cloud = np.random.default_rng(0).random((1000, 3))
    >>> len(salcore.simplify(cloud, ratio=0.25).indices)
    250
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]]
    >>> fan = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    >>> len(salcore.simplify(square, fan, faces=2).faces)
    2
    """
    if triangles is None and np.ndim(target.get("faces", 0)) > 0:
        triangles = target.pop("faces")
    one_target(target)  # before the long part
    work = Progress(progress)
    first, second = work.portion(0.0, ANALYSIS_SHARE), work.portion(ANALYSIS_SHARE, 1.0)
    analysis = analyze(points, triangles, normals, parameters, progress=first)
    return analysis.simplify(
        protect=protect,
        importance=importance,
        seams=seams,
        corner_values=corner_values,
        corner_normals=corner_normals,
        keep_seams=keep_seams,
        keep_border=keep_border,
        keep_topology=keep_topology,
        point_values=point_values,
        symmetry=symmetry,
        progress=second,
        **target,
    )
