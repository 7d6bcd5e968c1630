# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact errors of a cut over all tiles, and the fewest points within an error.

As in memory: the distance of every point to the tangent plane at the nearest of all kept points,
whichever tile these lie in.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from salcore.decimation.targets import count_within
from salcore.input.geometry import box_frame
from salcore.measure.errors import Errors
from salcore.progress import Progress
from salcore.tiles.errors import (
    boxes_near,
    distances_to_kept,
    merge_errors,
    sum_up,
    unit_boxes,
)
from salcore.tiles.merge import Cut, count_of_error, kept_points

from . import stages
from .bins import Plan, load, save
from .job import Job

Floats = NDArray[np.float64]
MAX_ERROR = "max_error"


def keep_surface(job: Job, cut: Cut, count: int, tile: int) -> None:
    """Write the points of a tile that a cut keeps, with their normals."""
    path = job.path(f"surface-{count}-{tile}.npz")
    if path.exists():
        return
    kept = kept_points(cut, *stages.load_order(job, tile))
    points, normals = _surface(job, str(tile))
    save(path, points=points[kept], normals=normals[kept])


def measure(job: Job, plan: Plan, count: int, tile: int) -> None:
    """Measure how far the points of a tile's core are from what all tiles keep."""
    path = job.path(f"error-{count}-{tile}.npz")
    if path.exists():
        return
    points, _ = _surface(job, str(tile))
    boxes, margin = unit_boxes(plan.boxes, plan.low, plan.high), plan.halo * _to_unit(plan)
    near = boxes_near(boxes, tile, margin)
    point, surface = distances_to_kept(points, *_kept(job, count, near))
    if len(points) and point.max() > margin:  # a nearer one may lie in a tile further off
        near = boxes_near(boxes, tile, float(point.max()))
        point, surface = distances_to_kept(points, *_kept(job, count, near))
    save(path, point=sum_up(point), surface=sum_up(surface))


def _surface(job: Job, name: str) -> tuple[Floats, Floats]:
    """Return points and normals from a file."""
    found = load(job.path(f"surface-{name}.npz"))
    return found["points"], found["normals"]


def _kept(job: Job, count: int, tiles: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return the kept points of some tiles and their normals."""
    points, normals = zip(*(_surface(job, f"{count}-{tile}") for tile in tiles), strict=True)
    return np.concatenate(points), np.concatenate(normals)


def _to_unit(plan: Plan) -> float:
    """Return the factor to the unit of the clean points."""
    return float(np.ldexp(1.0, -_exponent(plan)))


def _exponent(plan: Plan) -> int:
    """Return the power of two that the unit of the clean points is."""
    if (plan.low == plan.high).all():
        return 0
    first, _, second = box_frame(plan.low, plan.high)
    return first + second


def measure_cut(
    job: Job,
    plan: Plan,
    counts: NDArray[np.int64],
    count: int,
    each: Callable[..., None],
    progress: Progress,
) -> Errors:
    """Return the errors of keeping so many points, in the unit of the files."""
    cut, tiles = stages.cut_at(job, plan, counts, count), range(len(plan.boxes))
    each(keep_surface, [(job, cut, count, k) for k in tiles], progress.part(0.0, 0.1))
    each(measure, [(job, plan, count, k) for k in tiles], progress.part(0.1, 1.0))
    point, surface = [], []
    for tile in tiles:
        found = load(job.path(f"error-{count}-{tile}.npz"))
        point.append(found["point"])
        surface.append(found["surface"])
        job.path(f"surface-{count}-{tile}.npz").unlink(missing_ok=True)
    diagonal = float(np.linalg.norm(plan.high - plan.low))
    errors = merge_errors(point, surface, diagonal * _to_unit(plan))
    return errors.scaled(_exponent(plan))


def fewest_within(
    job: Job,
    plan: Plan,
    counts: NDArray[np.int64],
    each: Callable[..., None],
    progress: Progress,
) -> int:
    """Return about the fewest points with which the largest error is within the job's."""
    bound = job.value
    if job.parameters["error_unit"] != "length":
        bound *= float(np.linalg.norm(plan.high - plan.low))
    worst = stages.worst_of(job, plan)
    start = count_of_error(counts, worst, bound * _to_unit(plan))
    trials = 0

    def largest(count: int) -> float:
        nonlocal trials
        part = progress.part(1.0 - 0.8**trials, 1.0 - 0.8 ** (trials + 1), "Error")
        trials += 1
        return measure_cut(job, plan, counts, count, each, part).surface.max

    return count_within(bound, start, int(counts.sum()), largest, 1)
