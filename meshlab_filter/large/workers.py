# SPDX-License-Identifier: GPL-3.0-or-later
"""Who does the work on tiles: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import importlib
import logging
import multiprocessing
import os
import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, TypeVar

import salcore
from salcore.progress import Progress

from ..errors import FileError
from .job import Job, planned_size, work_folder

PROCESS = 200_000_000
"""Bytes that a process takes besides its tile."""
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
J = TypeVar("J", bound=Job)


def share_memory(memory: float, workers: int, point: float, halo: float) -> tuple[int, int]:
    """Return how many workers, and points of a tile, so much memory is enough for.

    Parameters
    ----------
    memory : float
        Bytes.
    workers : int
        At most so many.
    point : float
        Bytes that a worker takes for a point of a tile or its halo.
    halo : float
        Width of a tile's halo in spacings.

    Raises
    ------
    ParameterError
        If it is not enough for one worker.
    """
    for count in range(workers, 0, -1):
        share = (memory - (count + 1) * PROCESS) / count
        side = max(share / point, 0.0) ** 0.5 - 2.0 * halo  # in points, of a tile of a surface
        if side > 0 and side**2 >= LEAST:
            return count, min(MOST, int(side**2))
    least = point * (LEAST**0.5 + 2.0 * halo) ** 2 + 2 * PROCESS
    raise salcore.ParameterError(
        f"memory={memory / 1e9:.2g} GB: too little for one tile; give at least {least / 1e9:.2g} GB"
    )


@contextmanager
def at_work(
    job: J, workers: int, scheduler: str | None, *, resume: bool
) -> Iterator[tuple[J, Each]]:
    """Open a job's work folder, and those who do the work; yield the job as planned, and these.

    The folder is removed at the end, and stays where the run ends early.
    """
    backend = dask_cluster(scheduler, workers) if scheduler else worker_pool(job, workers)
    with backend as each, work_folder(job, resume=resume):
        try:
            yield replace(job, most=planned_size(job)), each
        except OSError as error:
            raise OSError(
                f"{error.filename or job.folder}: {error.strerror or error}; the work done is "
                f"kept: make room and go on with --resume {job.folder}"
            ) from error
    shutil.rmtree(job.folder, ignore_errors=True)


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
