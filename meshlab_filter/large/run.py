# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages of scans in order."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import salcore
from salcore.progress import Progress
from salcore.tiles.plan import REACH

from ..errors import FileError, Warn, ignore
from . import stages
from .bins import ROW, Plan, count_file, make_plan, spill_file
from .errors import MAX_ERROR, fewest_within, measure_cut
from .job import Job
from .split import check_folder, is_published, write_tiles
from .workers import LEAST, Each, at_work
from .write import output_header, write_kept

POINT = 900
"""Bytes that a worker takes at most for a point of a tile or its halo."""


def simplify_tiles(
    job: Job,
    output: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    tiles: Path | None = None,
    resume: bool = False,
    force: bool = False,
    progress: salcore.progress.Callback | None = None,
    warn: Warn = ignore,
) -> dict[str, Any]:
    """Simplify LAS files tile by tile into one, and return the figures.

    Parameters
    ----------
    job : Job
    output : Path
        LAS or LAZ file.
    workers : int
        Number of processes; those of a cluster that runs already are as many as it has.
    scheduler : str, optional
        Address of a Dask scheduler, or ``local`` for a cluster on this machine. Its workers must
        see the same files. Left out, a pool of processes does the work.
    tiles : Path, optional
        Folder for the same points as one LAZ file a tile, with an index.
    resume : bool
        Whether to go on with the run in the job's work folder.
    force : bool
        Whether to replace an existing output.
    progress : callable, optional
    warn : callable

    Raises
    ------
    FileError
        If a file cannot be read or written, or the work folder belongs to another run.
    MemoryLimitError
        If a worker was killed.
    OSError
        If a disk is full.

    Notes
    -----
    The result does not depend on the number of workers, nor on who they are. The work folder is
    removed at the end, and stays where the run ends early.
    """
    work = Progress(progress)
    output_header(job, warn)
    if tiles is not None and not is_published(job, tiles):
        check_folder(tiles)
    with at_work(job, workers, scheduler, resume=resume) as (job, each):
        return _stages(job, output, tiles, each, force, work, warn)


def _stages(
    job: Job,
    output: Path,
    folder: Path | None,
    each: Each,
    force: bool,
    work: Progress,
    warn: Warn,
) -> dict[str, Any]:
    """Do the stages in their order, and return the figures."""
    files = range(len(job.sources))
    each(count_file, [(job, k) for k in files], work.part(0.0, 0.02, "Counting"))
    plan = make_plan(job)
    tiles = range(len(plan.boxes))
    warn(
        f"{job.points:,} points in {len(tiles)} tiles; if interrupted, go on with "
        f"--resume {job.folder}"
    )
    each(spill_file, [(job, plan, k) for k in files], work.part(0.02, 0.06, "Tiles"))
    largest = _largest_tile(job, plan, warn)
    part = work.part(0.06, 0.55, "Analysis")
    each(stages.analyse, [(job, plan, k) for k in tiles], part)
    whole = stages.gather(job, plan)
    part = work.part(0.55, 0.7 if job.target == MAX_ERROR else 0.95, "Elimination")
    each(stages.order, [(job, whole, k) for k in tiles], part)
    counts = stages.count_all(job, plan)
    if job.target == MAX_ERROR:
        count = fewest_within(job, plan, counts, each, work.part(0.7, 0.95))
    else:
        count = stages.wanted_count(job, counts)
    _check_halo(job, count, warn)
    cut = stages.cut_at(job, plan, counts, count)
    each(stages.keep, [(job, cut, k) for k in tiles], work.part(0.95, 0.96, "Cut"))
    errors = None
    if job.errors:
        errors = measure_cut(job, plan, counts, count, each, work.part(0.96, 0.97, "Errors"))
    if folder is not None and not is_published(job, folder):
        part = work.part(0.97, 0.98, "Output")
        write_tiles(job, len(tiles), output_header(job, ignore), folder, each, part)
    written = write_kept(job, len(tiles), output, force, work.part(0.98, 1.0, "Output"), warn)
    if written != count:
        raise FileError(f"{job.folder}: {written} points instead of {count}; begin anew")
    return {
        "input_points": job.points,
        "kept_points": count,
        "tiles": len(tiles),
        "largest_tile": largest,
        "halo": plan.halo,
        "files": len(files),
        "errors": None if errors is None else errors.as_dict(),
    }


def _check_halo(job: Job, count: int, warn: Warn) -> None:
    """Say if so few points are kept that the halos were narrow for them."""
    if count < 0.5 * job.ratio * job.points:
        spacings = REACH * math.sqrt(count / (job.ratio * job.points))
        warn(
            f"{count:,} points are kept: the halos of the tiles are as wide as {spacings:.1f} of "
            f"their spacings, not {REACH:g}; for closer agreement at borders give --count {count}"
        )


def _largest_tile(job: Job, plan: Plan, warn: Warn) -> int:
    """Return the points of the largest tile with its halo.

    Say if that is much more than planned: a cell of the plan is never cut.
    """
    sizes = [0] * len(plan.boxes)
    for number in range(len(job.sources)):
        for file in job.path(f"spill-{number}").iterdir():
            sizes[int(file.stem)] += file.stat().st_size // ROW.itemsize
    if max(sizes) > 4 * max(job.most, LEAST):
        warn(
            f"one tile has {max(sizes):,} points with its halo, for they lie close together; its "
            f"worker takes about {max(sizes) * POINT / 1e9:.1f} GB"
        )
    return max(sizes)
