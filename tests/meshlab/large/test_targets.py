# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans in tiles: errors and the fewest points within one, a folder of tiles, odd tiles."""

import json

import laspy
import numpy as np
import pytest
from scan_jobs import RATIO, make_job, write_scan

import salcore
from meshlab_filter.cli.command import main
from meshlab_filter.large import stages
from meshlab_filter.large.bins import count_file, make_plan, spill_file
from meshlab_filter.large.job import look_at
from meshlab_filter.large.run import simplify_tiles

FIELDS = ("max", "mean", "rms")


def coordinates(path):
    """Return the points (n, 3) of a file."""
    scan = laspy.read(path)
    return np.column_stack([scan.x, scan.y, scan.z])


@pytest.fixture(scope="module")
def analysis(scans):
    """Return the scans as one cloud in memory, analysed."""
    return salcore.analyze(np.concatenate([coordinates(path) for path in scans]))


def test_errors_and_tiles_are_those_of_the_one_file(scans, analysis, tmp_path):
    job = make_job(tmp_path / "work", scans, errors=True)
    output, folder = tmp_path / "light.laz", tmp_path / "light"
    figures = simplify_tiles(job, output, workers=2, tiles=folder)
    whole = analysis.simplify(ratio=RATIO).errors.as_dict()
    for kind in ("point", "surface"):
        found = [figures["errors"][kind][name] for name in FIELDS[1:]]
        np.testing.assert_allclose(found, [whole[kind][name] for name in FIELDS[1:]], rtol=0.01)
    assert figures["errors"]["diagonal"] == pytest.approx(whole["diagonal"], rel=1e-12)
    index = json.loads((folder / "index.json").read_text())
    parts = [laspy.read(folder / row["file"]) for row in index["tiles"]]
    assert {f.name for f in folder.iterdir()} == {
        "index.json", *(row["file"] for row in index["tiles"])
    }  # fmt: skip
    assert [row["points"] for row in index["tiles"]] == [len(part) for part in parts]
    for row, part in zip(index["tiles"], parts, strict=True):
        corners = [[axis.min() for axis in part.xyz.T], [axis.max() for axis in part.xyz.T]]
        np.testing.assert_allclose(row["bounds"], corners, atol=1e-6)
    one = laspy.read(output)
    records = np.concatenate([part.points.array for part in parts])
    np.testing.assert_array_equal(np.sort(records), np.sort(one.points.array))
    assert index["points"] == len(one)
    assert parts[0].header.point_format == one.header.point_format
    with pytest.raises(salcore.SalcoreError, match=r"light: exists already; remove it, or name"):
        simplify_tiles(job, output, workers=1, tiles=folder, force=True)
    assert not (tmp_path / "work").exists()


def test_the_fewest_points_within_an_error(scans, analysis, tmp_path):
    job = make_job(tmp_path / "work", scans, "max_error", 0.006, errors=True)
    figures = simplify_tiles(job, tmp_path / "light.laz", workers=1)
    found, diagonal = figures["errors"], figures["errors"]["diagonal"]
    assert found["surface"]["max"] <= 0.006 * diagonal
    whole = analysis.simplify(max_error=0.006)
    assert figures["kept_points"] == pytest.approx(len(whole.indices), rel=0.05)
    # The error is measured for true, to the points of all tiles.
    points, kept = analysis.geometry.coordinates, coordinates(tmp_path / "light.laz")
    shift = points.min(axis=0)
    number = {tuple(p): k for k, p in enumerate(np.round(points - shift, 2))}
    ids = np.array([number[tuple(p)] for p in np.round(kept - shift, 2)])
    normals = analysis.normals
    to = salcore.Surface(points[ids], np.empty((0, 3), dtype=int), normals[ids])
    exact = salcore.compare(salcore.make_surface(points, normals=normals), to)
    assert found["surface"]["max"] == pytest.approx(exact.surface.max, rel=1e-3)
    assert found["point"]["rms"] == pytest.approx(exact.point.rms, rel=1e-9)


def test_points_on_the_border_of_tiles_that_two_files_have(tmp_path):
    rng = np.random.default_rng(4)
    grid = np.stack(np.meshgrid(np.arange(80.0), np.arange(40.0)), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.round(rng.random(len(grid)), 2)])
    paths = [write_scan(tmp_path / f"{k}.las", points, offset=np.zeros(3)) for k in range(2)]
    job = make_job(tmp_path / "work", paths, "count", 700, most=2000)
    figures = simplify_tiles(job, tmp_path / "light.las", workers=1)
    assert figures["tiles"] > 2
    kept = coordinates(tmp_path / "light.las")
    assert len(kept) == len(np.unique(kept, axis=0)) == 700
    job = make_job(tmp_path / "all", paths, "count", 3201, most=2000)
    with pytest.raises(salcore.ParameterError, match="count=3201: there are 3200 valid points"):
        simplify_tiles(job, tmp_path / "all.las", workers=1)


def test_a_tile_without_points_adds_nothing(tmp_path):
    points = np.random.default_rng(5).random((3000, 3)) * [60, 50, 0.3]
    job = make_job(tmp_path, [write_scan(tmp_path / "a.las", points)], errors=True)
    count_file(job, 0)
    plan = make_plan(job)
    plan.boxes[:] = [[-np.inf] * 3, [np.inf] * 3]
    empty = np.array([[[70.0, 0, 0], [80.0, 1, 1]]])
    plan = type(plan)(plan.low, plan.high, np.concatenate([plan.boxes, empty]), plan.halo)
    spill_file(job, plan, 0)
    for tile in range(2):
        stages.analyse(job, plan, tile)
    whole = stages.gather(job, plan)
    for tile in range(2):
        stages.order(job, whole, tile)
    counts = stages.count_all(job, plan)
    cut = stages.cut_at(job, plan, counts, 300)
    for tile, count in enumerate((300, 0)):
        stages.keep(job, cut, tile)
        assert len(np.load(tmp_path / f"kept-{tile}.npy")) == count


def test_what_is_damaged_or_gone_is_named(tmp_path):
    points = np.random.default_rng(6).random((500, 3)) * [60, 50, 0.3]
    path = write_scan(tmp_path / "a.las", points)
    job = make_job(tmp_path, [path])
    count_file(job, 0)
    (tmp_path / "count-0.npz").write_bytes(b"PK\x03\x04")
    with pytest.raises(salcore.SalcoreError, match=r"count-0.npz: is damaged; remove the folder"):
        make_plan(job)
    assert look_at([path]) == job.sources
    path.unlink()
    with pytest.raises(salcore.SalcoreError, match=r"a.las: cannot be read .* all workers must se"):
        spill_file(job, None, 0)


def test_the_command_measures_errors_and_writes_tiles(tmp_path, capsys):
    points = np.random.default_rng(7).random((3000, 3)) * [60, 50, 0]
    points[:, 2] = 3.0 * np.sin(points[:, 0] / 8.0)
    path, light = write_scan(tmp_path / "a.laz", points), tmp_path / "light.laz"
    arguments = ["simplify", path, light, "--max-error", 0.2, "--error-unit", "length", "--tiled"]
    folder = tmp_path / "light"
    arguments += ["--tiles", folder, "--workers", 1, "--report", tmp_path / "report.json"]
    assert main([str(a) for a in arguments]) == 0
    said = capsys.readouterr()
    assert "to the light surface" in said.out
    report = json.loads((tmp_path / "report.json").read_text())
    assert 0.05 < report["errors"]["surface"]["max"] <= 0.2
    assert report["kept_points"] == len(laspy.read(light)) < 1500
    assert json.loads((folder / "index.json").read_text())["points"] == report["kept_points"]
    mesh = tmp_path / "a.xyz"
    mesh.write_text("0 0 0\n1 0 0\n0 1 0\n")
    arguments = ["simplify", mesh, tmp_path / "b.xyz", "--ratio", 0.5, "--tiles", tmp_path / "b"]
    assert main([str(a) for a in arguments]) == 2
    assert "--tiles: only .las and .laz files are written as tiles" in capsys.readouterr().err
