# SPDX-License-Identifier: GPL-3.0-or-later
"""What is worked out for one tile: each stage reads files of the work folder and writes one.

A stage whose file is there already returns at once: that is how a run is resumed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import salcore
from salcore.tiles.merge import (
    Cut,
    Statistics,
    Whole,
    count_steps,
    find_cut,
    find_step,
    kept_points,
    merge_statistics,
    worst_by_step,
)
from salcore.tiles.plan import within
from salcore.tiles.tile import Tile, analyse_tile, order_tile

from .bins import Plan, load, read_tile, save
from .job import Job, write_whole

EMPTY = np.empty(0, dtype=np.int64)


def analyse(job: Job, plan: Plan, tile: int) -> None:
    """Analyse a tile, and write it with its statistics."""
    path = job.path(f"statistics-{tile}.npz")
    if path.exists():
        return
    points, numbers = read_tile(job, tile)
    core = within(points, plan.boxes[tile])
    if not core.any():  # rounding moved its few points to a neighbour
        none, nothing = Statistics.of_core(np.empty(0), np.empty(0)), np.empty((0, 3))
        save(job.path(f"surface-{tile}.npz"), points=nothing, normals=nothing)
        _save_order(job, tile, EMPTY.astype(np.int32), np.empty(0), EMPTY, np.empty(0))
        _save_statistics(path, none)
        return
    result = analyse_tile(points, core, (plan.low, plan.high), _parameters(job))
    del points
    numbers = numbers[result.input_of]
    if job.errors or job.target == "max_error":
        assert result.normals is not None
        core = result.core
        points, normals = result.points[core], result.normals[core]
        save(job.path(f"surface-{tile}.npz"), points=points, normals=normals)
    arrays: dict[str, Any] = result.arrays() | {"numbers": numbers}
    save(job.path(f"tile-{tile}.npz"), **arrays)
    _save_statistics(path, result.statistics())


def _save_statistics(path: Path, found: Statistics) -> None:
    arrays: dict[str, Any] = {key: getattr(found, key) for key in ("saliency", "faces", "areas")}
    save(path, small=True, points=found.points, **arrays)


def gather(job: Job, plan: Plan) -> Whole:
    """Return what the tiles must know of the whole, once all are analysed."""
    total: Statistics | None = None
    for tile in range(len(plan.boxes)):  # one at a time: those of a thousand take gigabytes
        found: dict[str, Any] = load(job.path(f"statistics-{tile}.npz"))
        part = Statistics(int(found["points"]), found["saliency"], found["faces"], found["areas"])
        total = part if total is None else _add(total, part)
    assert total is not None
    return merge_statistics([total])


def _add(one: Statistics, other: Statistics) -> Statistics:
    return Statistics(
        one.points + other.points,
        one.saliency + other.saliency,
        one.faces + other.faces,
        one.areas + other.areas,
    )


def order(job: Job, whole: Whole, tile: int) -> None:
    """Put the points of a tile's core in the order in which they go."""
    path = job.path(f"order-{tile}.npz")
    if not path.exists():
        arrays: dict[str, Any] = load(job.path(f"tile-{tile}.npz"))
        numbers = arrays.pop("numbers")
        result = Tile(**arrays)
        core = result.core
        done = order_tile(result, whole, _parameters(job))
        _save_order(job, tile, *(v[core] for v in (done.step, done.cost, numbers, done.error)))
    job.path(f"tile-{tile}.npz").unlink(missing_ok=True)


def _save_order(job: Job, tile: int, step: Any, cost: Any, number: Any, error: Any) -> None:
    worst = worst_by_step(step, error)
    save(job.path(f"order-{tile}.npz"), step=step, cost=cost, number=number, worst=worst)


def count_all(job: Job, plan: Plan) -> NDArray[np.int64]:
    """Return how many points of all tiles go at each step."""
    counts = count_steps(EMPTY.astype(np.int32))
    for tile in range(len(plan.boxes)):
        counts += count_steps(_load(job, tile, "step"))
    return counts


def worst_of(job: Job, plan: Plan) -> Any:
    """Return the largest estimated error at each step over all tiles."""
    worst = _load(job, 0, "worst")
    for tile in range(1, len(plan.boxes)):
        np.maximum(worst, _load(job, tile, "worst"), out=worst)
    return worst


def wanted_count(job: Job, counts: NDArray[np.int64]) -> int:
    """Return the number of points that a count or a ratio comes to.

    A ratio is of all points, as in memory; equal ones are kept once.
    """
    if job.target == "count":
        return int(job.value)
    return min(max(round(job.value * job.points), 1), int(counts.sum()))


def cut_at(job: Job, plan: Plan, counts: NDArray[np.int64], count: int) -> Cut:
    """Return the cut that keeps so many points of all tiles.

    Raises
    ------
    salcore.ParameterError
        If there are not so many distinct points.
    """
    step, keep = find_step(counts, count)
    costs, numbers = [], []
    for tile in range(len(plan.boxes)):
        here = np.flatnonzero(_load(job, tile, "step") == step)
        if len(here):
            costs.append(_load(job, tile, "cost")[here])
            numbers.append(_load(job, tile, "number")[here])
    return find_cut(step, keep, costs, numbers)


def keep(job: Job, cut: Cut, tile: int) -> None:
    """Write the numbers of the points of a tile that the cut keeps, ascending."""
    path = job.path(f"kept-{tile}.npy")
    if path.exists():
        return
    step, cost, number = load_order(job, tile)
    kept = np.sort(number[kept_points(cut, step, cost, number)])

    def write(spare: Path) -> None:
        with spare.open("wb") as file:
            np.save(file, kept)

    write_whole(path, write)


def _parameters(job: Job) -> salcore.Parameters:
    return salcore.Parameters(**(job.parameters | {"workers": 1}))


def load_order(job: Job, tile: int) -> tuple[Any, Any, Any]:
    """Return steps, costs and numbers of a tile's core."""
    names = ("step", "cost", "number")
    found = load(job.path(f"order-{tile}.npz"), *names)
    return tuple(found[name] for name in names)  # type: ignore[return-value]


def _load(job: Job, tile: int, name: str) -> Any:
    """Return one array of a tile's order."""
    return load(job.path(f"order-{tile}.npz"), name)[name]
