# SPDX-License-Identifier: GPL-3.0-or-later
"""What differs between a cloud in tiles and the whole, near borders of tiles and elsewhere."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from numpy.typing import NDArray

import salcore
from meshlab_filter.large.bins import Plan, count_file, make_plan
from meshlab_filter.large.job import Job, look_at


def agreement(
    given: list[Path], whole: Path, tiled: Path, most: int, ratio: float
) -> dict[str, float]:
    """Return how far two results agree: kept sets, and density within two halos of borders.

    Parameters
    ----------
    given : list of Path
        Files of the input.
    whole, tiled : Path
        Results in memory and by tiles of at most `most` points.
    most : int
    ratio : float
    """
    plan = make_tiles(given, most, ratio)
    one, other = read_points(whole), read_points(tiled)
    one_near, other_near = (near_borders(points, plan) for points in (one, other))
    near, far = (other_near.sum() / one_near.sum(), (~other_near).sum() / (~one_near).sum())
    return {
        "halo": plan.halo,
        "jaccard": overlap(one, other),
        "jaccard_near": overlap(one[one_near], other[other_near]),
        "share_near": float(one_near.mean()),
        "density": float(near / far),
    }


def make_tiles(given: list[Path], most: int, ratio: float) -> Plan:
    """Return the tiles that a run makes."""
    with tempfile.TemporaryDirectory() as folder:
        values: dict[str, Any] = salcore.Parameters().as_dict()
        job = Job(folder, look_at(given), values, "ratio", ratio, most)
        for number in range(len(given)):
            count_file(job, number)
        return make_plan(job)


def read_points(path: Path) -> NDArray[np.float64]:
    """Return the distinct points (n, 3) of a file."""
    scan = laspy.read(path)
    return np.unique(np.round(np.column_stack([scan.x, scan.y, scan.z]), 3), axis=0)


def near_borders(points: NDArray[np.float64], plan: Plan) -> NDArray[np.bool_]:
    """Return which points (n,) lie within two halos of a border between two tiles."""
    near = np.zeros(len(points), dtype=bool)
    reach = 2.0 * plan.halo
    for low, high in plan.boxes:
        mine = np.flatnonzero(((points >= low) & (points < high)).all(axis=1))
        inner = ((points[mine] >= low + reach) & (points[mine] < high - reach)).all(axis=1)
        near[mine[~inner]] = True
    return near


def overlap(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the Jaccard index of two sets of distinct points."""
    both = len(np.unique(np.concatenate([one, other]), axis=0))
    return (len(one) + len(other) - both) / both
