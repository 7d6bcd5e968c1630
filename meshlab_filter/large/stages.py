# SPDX-License-Identifier: GPL-3.0-or-later
"""What is worked out for one tile: each stage reads files of the work folder and writes one.

A stage whose file is there already returns at once: that is how a run is resumed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

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
)
from salcore.tiles.plan import within
from salcore.tiles.tile import Tile, analyse_tile, order_tile

from .bins import Plan, read_tile, save
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
        none = Statistics.of_core(np.empty(0), np.empty(0))
        save(job.path(f"order-{tile}.npz"), step=EMPTY, cost=np.empty(0), number=EMPTY)
        _save_statistics(path, none)
        return
    result = analyse_tile(points, core, (plan.low, plan.high), _parameters(job))
    del points
    numbers = numbers[result.input_of]
    save(job.path(f"tile-{tile}.npz"), numbers=numbers, **result.arrays())
    _save_statistics(path, result.statistics())


def _save_statistics(path: Path, found: Statistics) -> None:
    arrays = {"saliency": found.saliency, "faces": found.faces, "areas": found.areas}
    save(path, small=True, points=found.points, **arrays)


def gather(job: Job, plan: Plan) -> Whole:
    """Return what the tiles must know of the whole, once all are analysed."""
    total: Statistics | None = None
    for tile in range(len(plan.boxes)):  # one at a time: those of a thousand take gigabytes
        with np.load(job.path(f"statistics-{tile}.npz")) as found:
            part = Statistics(
                int(found["points"]), found["saliency"], found["faces"], found["areas"]
            )
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
        with np.load(job.path(f"tile-{tile}.npz")) as found:
            arrays = {name: found[name] for name in found.files}
        numbers = arrays.pop("numbers")
        result = Tile(**arrays)
        core = result.core
        done = order_tile(result, whole, _parameters(job))
        save(path, step=done.step[core], cost=done.cost[core], number=numbers[core])
    job.path(f"tile-{tile}.npz").unlink(missing_ok=True)


def choose(job: Job, plan: Plan) -> tuple[Cut, int]:
    """Return the cut that meets the target over all tiles, and how many points it keeps.

    Raises
    ------
    salcore.ParameterError
        If there are not so many distinct points.
    """
    tiles = range(len(plan.boxes))
    counts = count_steps(EMPTY.astype(np.int32))
    for tile in tiles:
        counts += count_steps(_load(job, tile)[0])
    distinct = int(counts.sum())
    wanted = int(job.value)
    if job.target == "ratio":  # of all points, as in memory; equal ones are kept once
        wanted = min(max(round(job.value * job.points), 1), distinct)
    step, keep = find_step(counts, wanted)
    costs, numbers = [], []
    for tile in tiles:
        steps, cost, number = _load(job, tile)
        costs.append(cost[steps == step])
        numbers.append(number[steps == step])
    return find_cut(step, keep, costs, numbers), wanted


def keep(job: Job, cut: Cut, tile: int) -> None:
    """Write the numbers of the points of a tile that the cut keeps, ascending."""
    path = job.path(f"kept-{tile}.npy")
    if path.exists():
        return
    step, cost, number = _load(job, tile)
    kept = np.sort(number[kept_points(cut, step, cost, number)])

    def write(spare: Path) -> None:
        with spare.open("wb") as file:
            np.save(file, kept)

    write_whole(path, write)


def _parameters(job: Job) -> salcore.Parameters:
    return salcore.Parameters(**(job.parameters | {"workers": 1}))


def _load(job: Job, tile: int) -> tuple[Any, Any, Any]:
    """Return steps, costs and numbers of a tile's core."""
    with np.load(job.path(f"order-{tile}.npz")) as found:
        return found["step"], found["cost"], found["number"]
