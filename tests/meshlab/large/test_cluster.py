# SPDX-License-Identifier: GPL-3.0-or-later
"""A Dask scheduler that has no workers, or is lost in the middle."""

import os
import socket
import subprocess
import sys
import threading
import time

import pytest
from scan_jobs import make_job

import salcore
from meshlab_filter.large.run import simplify_tiles

MODULES = "distributed.cli.dask_scheduler", "distributed.cli.dask_worker"


def start(module, *arguments):
    """Start a process of Dask."""
    command = [sys.executable, "-m", module, *arguments, "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture
def scheduler():
    """Start a scheduler, and return its process and address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with start(MODULES[0], "--host", "127.0.0.1", "--port", str(port)) as process:
        for _ in range(600):
            with socket.socket() as there:
                if there.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        yield process, f"tcp://127.0.0.1:{port}"
        process.kill()


def test_a_scheduler_without_workers_is_said(scans, scheduler, tmp_path, monkeypatch):
    monkeypatch.setattr("meshlab_filter.large.workers.PATIENCE_WITH_WORKERS", 1)
    job = make_job(tmp_path / "work", scans)
    with pytest.raises(salcore.SalcoreError, match="has no workers; start some with dask worker"):
        simplify_tiles(job, tmp_path / "light.laz", workers=1, scheduler=scheduler[1])
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
def test_a_scheduler_that_is_lost_is_said_and_the_run_goes_on(scans, scheduler, tmp_path):
    process, address = scheduler
    job, output = make_job(tmp_path / "work", scans), tmp_path / "light.laz"

    def lose():
        while not (tmp_path / "work" / "spill-1").exists():
            time.sleep(0.02)
        process.kill()

    killer = threading.Thread(target=lose)
    with start(MODULES[1], address, "--nthreads", "1", "--no-nanny") as worker:
        killer.start()
        with pytest.raises(salcore.SalcoreError, match=r"was lost; the work done is kept.*--resum"):
            simplify_tiles(job, output, workers=1, scheduler=address)
        killer.join()
        worker.kill()
    assert not output.exists()
    assert simplify_tiles(job, output, workers=1, resume=True)["tiles"] == 4
