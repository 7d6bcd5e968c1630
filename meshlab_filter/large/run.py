# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages in order, by processes of this machine or by the workers of a Dask cluster."""

from __future__ import annotations

import importlib
import logging
import math
import multiprocessing
import os
import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import salcore
from salcore.progress import Progress
from salcore.tiles.plan import REACH, halo_width

from ..errors import FileError, Warn, ignore
from . import stages
from .bins import ROW, Plan, count_file, make_plan, spill_file
from .errors import MAX_ERROR, fewest_within, measure_cut
from .job import Job, planned_size, work_folder
from .split import check_folder, is_published, write_tiles
from .write import output_header, write_kept

POINT = 900
"""Bytes that a worker takes at most for a point of a tile or its halo."""
PROCESS = 200_000_000
"""Bytes that a process takes besides."""
MOST, LEAST = 1_000_000, 20_000
"""Points of a tile: as many as pay off, and as few as its halo allows."""
LOCAL = "local"
"""Name of a Dask cluster on this machine."""
PATIENCE = 10
"""Seconds in which a scheduler must answer."""
PATIENCE_WITH_WORKERS = 60
"""Seconds in which a first worker must have joined it."""
Each = Callable[[Callable[..., None], Sequence[tuple[Any, ...]], Progress], None]
"""Calls a function with each of several arguments, in any order."""


def share_memory(memory: float, workers: int, ratio: float) -> tuple[int, int]:
    """Return how many workers, and points of a tile, so much memory is enough for.

    Parameters
    ----------
    memory : float
        Bytes.
    workers : int
        At most so many.
    ratio : float
        Share of the points to keep, on which the width of the halos depends.

    Raises
    ------
    ParameterError
        If it is not enough for one worker.
    """
    halo = halo_width(1.0, ratio)
    for count in range(workers, 0, -1):
        share = (memory - (count + 1) * PROCESS) / count
        side = max(share / POINT, 0.0) ** 0.5 - 2.0 * halo  # in points, of a tile of a surface
        if side**2 >= LEAST and side > 0:
            return count, min(MOST, int(side**2))
    least = POINT * (LEAST**0.5 + 2.0 * halo) ** 2 + 2 * PROCESS
    raise salcore.ParameterError(
        f"memory={memory / 1e9:.2g} GB: too little for one tile; give at least {least / 1e9:.2g} GB"
    )


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
    backend = dask_cluster(scheduler, workers) if scheduler else worker_pool(job, workers)
    with backend as each, work_folder(job, resume=resume):
        job = replace(job, most=planned_size(job))
        try:
            figures = _stages(job, output, tiles, each, force, work, warn)
        except OSError as error:
            raise OSError(
                f"{error.filename or job.folder}: {error.strerror or error}; the work done is "
                f"kept: make room and go on with --resume {job.folder}"
            ) from error
    shutil.rmtree(job.folder, ignore_errors=True)
    return figures


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


@contextmanager
def worker_pool(job: Job, workers: int) -> Iterator[Each]:
    """Give the work to a pool of processes."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, _end_with_parent) as pool:

        def each(
            function: Callable[..., None], calls: Sequence[tuple[Any, ...]], progress: Progress
        ) -> None:
            futures = [pool.submit(function, *call) for call in calls]
            for done, future in enumerate(as_completed(futures), 1):
                future.result()
                progress(done / len(calls))

        try:
            yield each
        except BrokenProcessPool as error:
            raise salcore.MemoryLimitError(
                "a worker was killed, most likely for want of memory; the work done is kept: go "
                f"on with --resume {job.folder}, perhaps with fewer --workers"
            ) from error
        finally:
            pool.shutdown(cancel_futures=True)


def _end_with_parent() -> None:
    """End this worker when the process that started it ends."""
    parent = multiprocessing.parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def dask_cluster(scheduler: str, workers: int) -> Iterator[Each]:
    """Give the work to a Dask cluster, which repeats what a lost worker did not finish."""
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError as error:
        raise FileError(
            f"scheduler={scheduler!r}: needs Dask; install it with pip install "
            "'salient-simplify[scale]'"
        ) from error
    # What matters is said in one sentence.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    options: dict[str, Any] = {"address": scheduler, "timeout": PATIENCE}
    cluster = None
    if scheduler == LOCAL:
        cluster = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=None,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        )
        options["address"] = cluster
    try:
        try:
            client = distributed.Client(**options)
        except (OSError, ValueError) as error:
            raise FileError(
                f"scheduler={scheduler!r}: no Dask scheduler answers there; start one with "
                "dask scheduler, and workers with dask worker"
            ) from error
        with client:
            _wait_for_workers(client, scheduler)

            def each(
                function: Callable[..., None], calls: Sequence[tuple[Any, ...]], progress: Progress
            ) -> None:
                futures = [client.submit(function, *call, pure=False) for call in calls]
                try:
                    for done, future in enumerate(distributed.as_completed(futures), 1):
                        future.result()
                        progress(done / len(calls))
                except (distributed.CancelledError, distributed.comm.CommClosedError) as error:
                    raise FileError(
                        f"scheduler={scheduler!r}: was lost; the work done is kept: start it "
                        "again, and go on with --resume"
                    ) from error

            yield each
    except distributed.KilledWorker as error:
        raise salcore.MemoryLimitError(
            "workers were killed again and again at one tile, most likely for want of memory; the "
            "work done is kept: go on with --resume, with smaller workers"
        ) from error
    finally:
        if cluster is not None:
            cluster.close()


def _wait_for_workers(client: Any, scheduler: str) -> None:
    """Wait until a cluster has a worker, but not for ever."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE_WITH_WORKERS)
    except TimeoutError as error:
        raise FileError(
            f"scheduler={scheduler!r}: has no workers; start some with dask worker"
        ) from error
