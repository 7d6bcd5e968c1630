# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans in tiles: by processes and by a Dask cluster, killed, resumed, damaged, mixed."""

import json
import os
import signal
import threading
import time

import laspy
import numpy as np
import psutil
import pytest
from scan_files import make_las
from scan_jobs import RATIO, make_job, write_scan

import salcore
from meshlab_filter.cli.command import main
from meshlab_filter.large.bins import read_tile, typical_spacing
from meshlab_filter.large.job import work_folder
from meshlab_filter.large.mesh_run import HALO
from meshlab_filter.large.mesh_run import POINT as MESH_POINT
from meshlab_filter.large.run import POINT, simplify_tiles
from meshlab_filter.large.workers import share_memory
from meshlab_filter.large.write import output_header
from salcore.tiles.plan import count_cells, halo_width


@pytest.fixture(scope="module")
def expected(scans, tmp_path_factory):
    """Return the bytes that a pool of two processes writes, undisturbed."""
    folder = tmp_path_factory.mktemp("pool")
    figures = simplify_tiles(make_job(folder / "work", scans), folder / "light.laz", workers=2)
    assert figures["tiles"] == 4
    assert not (folder / "work").exists()
    return (folder / "light.laz").read_bytes()


def kill_a_worker(folder):
    """Kill a process that works for this one as soon as the analysis is under way."""

    def kill():
        while not (folder / "spill-1").exists():
            time.sleep(0.02)
        time.sleep(0.5)
        busy = psutil.Process().children(recursive=True)
        workers = [p for p in busy if "spawn_main" in " ".join(p.cmdline())]
        os.kill(max(workers, key=lambda p: p.memory_info().rss).pid, signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    return thread


def test_tiles_keep_what_the_whole_keeps(scans, expected, tmp_path):
    (tmp_path / "light.laz").write_bytes(expected)
    light, parts = laspy.read(tmp_path / "light.laz"), [laspy.read(path) for path in scans]
    points = np.concatenate([np.column_stack([p.x, p.y, p.z]) for p in parts])
    whole = salcore.simplify(points, ratio=RATIO).indices
    assert len(light) == len(whole)
    # Intensity and red number the points of each file, which tells which are kept.
    number = np.asarray(light.intensity, dtype=int) + 65536 * np.asarray(light.red, dtype=int)
    second = np.flatnonzero(np.diff(number) < 0) + 1  # in the order of the input
    assert len(second) == 1
    number[second[0] :] += len(parts[0])
    np.testing.assert_array_equal(np.column_stack([light.x, light.y, light.z]), points[number])
    common = len(np.intersect1d(number, whole))
    assert common / (2 * len(whole) - common) > 0.97


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
def test_dask_writes_the_same_bytes_though_a_worker_is_killed(scans, expected, tmp_path):
    killer = kill_a_worker(tmp_path / "work")
    job = make_job(tmp_path / "work", scans)
    simplify_tiles(job, tmp_path / "light.laz", workers=2, scheduler="local")
    killer.join()
    assert (tmp_path / "light.laz").read_bytes() == expected


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
def test_a_pool_whose_worker_is_killed_says_so_and_goes_on_where_it_was(scans, expected, tmp_path):
    output, job = tmp_path / "light.laz", make_job(tmp_path / "work", scans)
    killer = kill_a_worker(tmp_path / "work")
    with pytest.raises(salcore.MemoryLimitError, match=r"a worker was killed.*--resume"):
        simplify_tiles(job, output, workers=2)
    killer.join()
    assert not output.exists()
    with pytest.raises(salcore.SalcoreError, match=r"belongs to another run.*value differ"):
        simplify_tiles(
            make_job(tmp_path / "work", scans, value=0.2), output, workers=1, resume=True
        )
    with (
        work_folder(job, resume=True),
        pytest.raises(salcore.SalcoreError, match="another run is at work in this folder"),
    ):
        simplify_tiles(job, output, workers=1, resume=True)
    with pytest.raises(salcore.SalcoreError, match="exists already; go on with it by --resume"):
        simplify_tiles(job, output, workers=1)
    done, seen = set((tmp_path / "work").iterdir()), []
    assert tmp_path / "work" / "spill-1" in done
    simplify_tiles(
        job, output, workers=2, resume=True, progress=lambda stage, _: seen.append(stage) or True
    )
    assert output.read_bytes() == expected
    assert list(dict.fromkeys(seen)) == [
        "Counting", "Tiles", "Analysis", "Elimination", "Cut", "Output"
    ]  # fmt: skip


def test_files_of_other_scales_that_overlap_and_one_without_points(tmp_path):
    rng = np.random.default_rng(0)
    points = np.round(np.column_stack([rng.random((9000, 2)) * [40, 10], rng.random(9000)]), 2)
    points = np.unique(points, axis=0)
    rng.shuffle(points)
    low, high = points[points[:, 0] < 22], points[points[:, 0] > 18]
    fine = write_scan(tmp_path / "fine.las", high, scale=0.001, offset=np.array([5.0, 0, 0]))
    paths = [write_scan(tmp_path / "coarse.laz", low), tmp_path / "none.las", fine]
    laspy.LasData(laspy.LasHeader(version="1.2", point_format=2)).write(str(paths[1]))
    job = make_job(tmp_path / "work", paths, "count", 2000, 4000)
    figures = simplify_tiles(job, tmp_path / "light.las", workers=1)
    assert figures["tiles"] > 1
    light = laspy.read(tmp_path / "light.las")
    kept = np.round(np.column_stack([light.x, light.y, light.z]), 3)
    assert len(kept) == len(np.unique(kept, axis=0)) == 2000  # equal points stay once at most
    assert (light.header.scales == 0.001).all()
    both = np.concatenate([low, high])
    inside = {tuple(p) for p in np.round(both, 3)}
    assert all(tuple(p) in inside for p in kept)


def test_all_dimensions_travel_and_every_point_may_be_kept(tmp_path):
    path = make_las(tmp_path / "all.laz")
    job = make_job(tmp_path / "work", [path], value=1.0, most=800)
    figures = simplify_tiles(job, tmp_path / "same.laz", workers=1)
    before, after = laspy.read(path), laspy.read(tmp_path / "same.laz")
    assert figures["kept_points"] == len(before)
    np.testing.assert_array_equal(before.points.array, after.points.array)
    records = [v.record_data_bytes() for v in before.header.vlrs]
    assert [v.record_data_bytes() for v in after.header.vlrs] == records
    assert (before.header.offsets == after.header.offsets).all()


def test_points_in_one_place_keep_one(tmp_path):
    path = write_scan(tmp_path / "one.las", np.full((50, 3), 7.25))
    job = make_job(tmp_path / "work", [path], value=0.5, most=10)
    assert simplify_tiles(job, tmp_path / "light.las", workers=1)["kept_points"] == 1


@pytest.fixture
def say(capsys, tmp_path, monkeypatch):
    """Run the command in a folder of its own and return its one line on standard error."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments, status=2):
        assert main([str(a) for a in ("simplify", *arguments, "--quiet")]) == status
        return capsys.readouterr().err

    return call


def test_a_file_cut_short_is_named_and_nothing_is_written(scans, say, tmp_path):
    damaged = tmp_path / "damaged.laz"
    damaged.write_bytes(scans[1].read_bytes()[:-40_000])
    said = say(scans[0], damaged, "light.laz", "--ratio", 0.1, "--tiled")
    assert "damaged.laz: is cut short or damaged" in said
    assert len(said.splitlines()) == 1
    assert not (tmp_path / "light.laz").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["light.laz", "--alpha", 1], "--alpha: is not worked out by tiles; give --ratio"),
        (["light.laz", "--ratio", 0.1, "--contrast", "difference"], "--contrast: needs the whole"),
        (["light.laz", "--ratio", 0.1, "--tiles", "no/no"], "no such folder; make it first"),
        (["light.ply", "--ratio", 0.1], "tiles are written as .laz or .las"),
        (["light.laz", "--ratio", 0.1, "--placement", "optimal"], "--placement: needs the whole"),
        (["light.laz", "--ratio", 0.1, "--memory", "9M"], "too little for one tile; give at least"),
        (["light.laz", "--count", 10**9], "give at most so many"),
        (["light.laz", "--ratio", 0.1, "--resume", "none"], "holds no run to resume"),
        (["light.laz", "--ratio", 0.1, "--work-folder", "no/no"], "no such folder; make it first"),
    ],
)
def test_what_tiles_cannot_do_is_refused(scans, say, tmp_path, arguments, message):
    said = say(*scans, *arguments, "--tiled")
    assert message in said
    assert len(said.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_other_files_than_scans_are_refused(say, tmp_path):
    (tmp_path / "a.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    assert "only .las and .laz files" in say("a.xyz", "light.xyz", "--ratio", 0.5, "--tiled")


def test_a_scheduler_that_is_not_there_is_said(scans, say, tmp_path, monkeypatch):
    monkeypatch.setattr("meshlab_filter.large.workers.PATIENCE", 1)
    said = say(*scans, "light.laz", "--ratio", 0.1, "--scheduler", "tcp://127.0.0.1:9")
    assert "no Dask scheduler answers there" in said
    assert not list(tmp_path.iterdir())


def test_the_command_chooses_tiles_by_memory_and_says_so(tmp_path, monkeypatch, capsys):
    points = np.random.default_rng(1).random((15_000, 3)) * [300, 100, 0.3]
    path, output = write_scan(tmp_path / "scan.laz", points), tmp_path / "light.laz"
    arguments = ["simplify", str(path), str(output), "--ratio", "0.5", "--memory", "4G"]
    assert main([*arguments, "--no-errors"]) == 0
    assert "by tiles" not in capsys.readouterr().err
    assert len(laspy.read(output)) == 7500
    # As if a point took more, for a scan that needs so much would take minutes.
    monkeypatch.setattr("meshlab_filter.cli.tiles.POINT", 300_000)
    monkeypatch.setattr("meshlab_filter.large.workers.LEAST", 1000)
    report = tmp_path / "report.json"
    assert main([*arguments, "--force", "--workers", "1", "--report", str(report)]) == 0
    assert "light.laz: by tiles of at most" in capsys.readouterr().err
    assert len(laspy.read(output)) == 7500
    assert json.loads(report.read_text())["kept_points"] == 7500


@pytest.mark.skipif(os.name == "nt", reason="limits the size of files")
def test_a_full_disk_is_said_and_the_run_goes_on(tmp_path):
    import resource  # not on Windows

    points = np.random.default_rng(3).random((20_000, 3)) * [300, 100, 0.3]
    job = make_job(tmp_path / "work", [write_scan(tmp_path / "scan.laz", points)], most=15_000)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))  # as a disk that is full
    try:
        with pytest.raises(OSError, match=r"File too large; the work done is kept.*--resume"):
            simplify_tiles(job, tmp_path / "light.laz", workers=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not (tmp_path / "light.laz").exists()
    figures = simplify_tiles(job, tmp_path / "light.laz", workers=1, resume=True)
    assert figures["kept_points"] == len(laspy.read(tmp_path / "light.laz")) == 2000


def test_formats_that_differ_are_refused(tmp_path):
    paths = [make_las(tmp_path / "a.las", 7), make_las(tmp_path / "b.las", 6)]
    with pytest.raises(salcore.SalcoreError, match=r"b\.las: its points are of another format"):
        output_header(make_job(tmp_path / "work", paths), print)
    paths[1] = write_scan(tmp_path / "c.las", np.zeros((3, 3)), scale=0.003)
    paths[0] = write_scan(tmp_path / "d.las", np.zeros((3, 3)), scale=0.002)
    with pytest.raises(salcore.SalcoreError, match=r"c\.las: scale or offset do not go together"):
        output_header(make_job(tmp_path / "work", paths), print)


@pytest.mark.parametrize(("point", "halo"), [(POINT, halo_width(1.0, 0.1)), (MESH_POINT, HALO)])
def test_memory_is_shared_among_workers(point, halo):
    assert share_memory(8e9, 2, point, halo) == (2, 1_000_000)
    assert share_memory(1e9, 8, point, halo)[0] < 8
    assert share_memory(2e9, 2, point, 4 * halo)[1] < share_memory(2e9, 2, point, halo)[1]
    with pytest.raises(salcore.ParameterError, match="too little"):
        share_memory(1e8, 2, point, halo)


def test_fewer_points_kept_need_wider_halos():
    tiles = [share_memory(2e9, 2, POINT, halo_width(1.0, ratio))[1] for ratio in (0.1, 0.001)]
    assert share_memory(4e9, 2, POINT, halo_width(1.0, 0.1)) == (2, 1_000_000)
    assert tiles[1] < tiles[0]


def test_the_spacing_of_a_surface_is_found_from_counts():
    grid = np.stack(np.meshgrid(np.arange(320.0), np.arange(160.0)), axis=-1).reshape(-1, 2)
    for height in (0.0, 0.2):
        points = np.column_stack([0.5 * grid, height * np.sin(grid[:, 0])])
        box = points.min(axis=0), points.max(axis=0)
        assert 0.35 < typical_spacing(count_cells(points, *box), *box) < 0.65


def test_an_empty_tile_has_no_points(tmp_path):
    path = write_scan(tmp_path / "a.las", np.random.default_rng(2).random((30, 3)))
    (tmp_path / "spill-0").mkdir()
    points, numbers = read_tile(make_job(tmp_path, [path]), 5)
    assert points.shape == (0, 3)
    assert len(numbers) == 0
