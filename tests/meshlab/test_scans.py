# SPDX-License-Identifier: GPL-3.0-or-later
"""Formats of scanners: all that belongs to a point, all scans with their poses."""

import subprocess
import sys

import laspy
import numpy as np
import pye57
import pypcd4
import pytest
from models import model_path
from plyfile import PlyData
from scan_files import POINTS, RNG, make_las
from scipy.spatial.transform import Rotation

import salcore
from meshlab_filter.io import e57, las, pcd, ptx


@pytest.mark.parametrize("point_format", [3, 7, 8])
@pytest.mark.parametrize(("source", "output"), [("las", "laz"), ("laz", "las"), ("laz", "laz")])
def test_a_las_file_keeps_records_and_header_bit_for_bit(
    run, tmp_path, point_format, source, output
):
    version = "1.2" if point_format == 3 else "1.4"
    path = make_las(tmp_path / f"in.{source}", point_format, version)
    assert run("simplify", path, tmp_path / f"o.{output}", "--ratio", "0.2") == ""
    before, after = laspy.read(path), laspy.read(tmp_path / f"o.{output}")
    kept = salcore.simplify(before.xyz, ratio=0.2).indices
    assert after.points.array.tobytes() == before.points.array[kept].tobytes()
    assert after.header.version == before.header.version
    assert after.point_format == before.point_format
    for name in ("scales", "offsets"):
        assert np.array_equal(getattr(after.header, name), getattr(before.header, name))
    assert b"PROJCS" in b"".join(vlr.record_data_bytes() for vlr in after.header.vlrs)


def test_las_dimensions_become_properties_of_a_ply_file_and_back(run, tmp_path):
    path = make_las(tmp_path / "in.laz")
    run("simplify", path, tmp_path / "o.ply", "--ratio", "0.2")
    before, table = laspy.read(path), PlyData.read(tmp_path / "o.ply")["vertex"].data
    kept = salcore.simplify(before.xyz, ratio=0.2).indices
    for name in ("intensity", "classification", "gps_time", "red", "roughness", "return_number"):
        assert np.array_equal(table[name], np.asarray(before[name])[kept]), name
    assert np.array_equal(table["direction_1"], before["direction"][kept][:, 1])
    run("simplify", tmp_path / "o.ply", tmp_path / "p.laz", "--ratio", "1")
    after = laspy.read(tmp_path / "p.laz")
    assert np.abs(after.xyz - before.xyz[kept]).max() < 1e-6
    for name in ("intensity", "classification", "gps_time", "red", "roughness"):
        assert np.array_equal(np.asarray(after[name]), np.asarray(before[name])[kept]), name


def test_a_map_of_saliency_in_a_las_file(run, tmp_path):
    path = make_las(tmp_path / "in.laz")
    run("saliency", path, tmp_path / "o.laz")
    before, after = laspy.read(path), laspy.read(tmp_path / "o.laz")
    analysis = salcore.analyze(before.xyz)
    assert np.array_equal(after["quality"], analysis.saliency)
    assert np.array_equal(after["gps_time"], before["gps_time"])
    assert not np.array_equal(after["red"], before["red"])


def test_a_real_tile(run, tmp_path):
    path = model_path("autzen_laz/autzen_00.laz")
    with laspy.open(path) as reader:
        small = laspy.LasData(reader.header, reader.read_points(30_000))
    small.write(str(tmp_path / "in.laz"))
    assert run("simplify", tmp_path / "in.laz", tmp_path / "o.laz", "--count", "3000") == ""
    after = laspy.read(tmp_path / "o.laz")
    assert len(after.points) == 3000
    rows = set(map(bytes, small.points.array))
    assert all(bytes(row) in rows for row in after.points.array)


def test_pcd_fields_travel(run, tmp_path):
    colors = RNG.integers(0, 256, (len(POINTS), 3)).astype(np.uint8)
    rgb = pypcd4.PointCloud.encode_rgb(colors)
    columns = [*POINTS.T, rgb, RNG.random(len(POINTS)), RNG.integers(0, 9, len(POINTS))]
    names = ("x", "y", "z", "rgb", "intensity", "label")
    types = (np.float64, np.float64, np.float64, np.float32, np.float32, np.uint32)
    cloud = pypcd4.PointCloud.from_points(columns, names, types)
    for encoding in pypcd4.Encoding:
        path = tmp_path / f"{encoding.value}.pcd"
        cloud.save(path, encoding)
        (layer,) = pcd.read(path)
        assert list(layer.columns) == ["x", "y", "z", "red", "green", "blue", "intensity", "label"]
        if encoding != pypcd4.Encoding.ASCII:  # which rounds the packed field
            found = np.column_stack([layer.columns[name] for name in ("red", "green", "blue")])
            assert np.array_equal(found, colors)
    output = tmp_path / "o.pcd"
    assert run("simplify", path, output, "--ratio", "0.2") == ""
    kept = salcore.simplify(layer.points, ratio=0.2).indices
    after = pypcd4.PointCloud.from_path(output)
    assert after.fields == names
    assert np.array_equal(after.pc_data, cloud.pc_data[kept])


def test_ptx_scans_are_merged_with_their_poses_or_chosen(run, tmp_path):
    path = tmp_path / "in.ptx"
    local = [np.round(RNG.normal(size=(12 * 10, 3)), 4) for _ in range(2)]
    turns = [np.eye(3), Rotation.from_euler("z", 90, degrees=True).as_matrix()]
    moves = [np.array([2.0, 1.0, 1.5]), np.array([-3.0, 0.5, 0.25])]
    with path.open("w") as file:
        for points, turn, move in zip(local, turns, moves, strict=True):
            points[::10] = 0.0
            file.write("12\n10\n" + " ".join(map(str, move)) + "\n1 0 0\n0 1 0\n0 0 1\n")
            for row in turn.T:  # the rows of the file are the columns of the matrix
                file.write(" ".join(map(str, [*row, 0])) + "\n")
            file.write(" ".join(map(str, [*move, 1])) + "\n")
            file.writelines(f"{x} {y} {z} 0.5 10 20 30\n" for x, y, z in points)
    said = run("simplify", path, tmp_path / "o.ply", "--ratio", "1")
    assert "24 cells of its grids hold no point" in said
    assert "2 scans were merged" in said
    table = PlyData.read(tmp_path / "o.ply")["vertex"].data
    expected = [p[p.any(axis=1)] @ r.T + t for p, r, t in zip(local, turns, moves, strict=True)]
    found = np.column_stack([table[k] for k in "xyz"])
    assert found == pytest.approx(np.concatenate(expected))
    assert table["scan"].tolist() == [0] * 108 + [1] * 108
    assert table["red"].tolist() == [10] * 216
    run("simplify", path, tmp_path / "p.ply", "--ratio", "1", "--layer", "1")
    table = PlyData.read(tmp_path / "p.ply")["vertex"].data
    assert np.column_stack([table[k] for k in "xyz"]) == pytest.approx(expected[1])
    assert "there is none" in run(
        "simplify", path, tmp_path / "q.ply", "--ratio", "1", "--layer", "2", status=2
    )


def test_e57_stations_are_merged_with_their_poses(run, tmp_path):
    path = tmp_path / "in.e57"
    local = [RNG.normal(size=(100, 3)) for _ in range(2)]
    turn, move = Rotation.from_euler("xyz", [20, 30, 40], degrees=True), np.array([5.0, -6.0, 7.0])
    with pye57.E57(str(path), mode="w") as file:
        for number, points in enumerate(local):
            data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T, strict=True))
            data |= {"intensity": np.arange(100.0)}
            data |= {f"color{k}": np.full(100, 7 * number, "u1") for k in ("Red", "Green", "Blue")}
            x, y, z, w = turn.as_quat()
            pose = {"rotation": np.array([w, x, y, z]), "translation": move} if number else {}
            file.write_scan_raw(data, name=f"station {number}", **pose)
    run("simplify", path, tmp_path / "o.ply", "--ratio", "1")
    table = PlyData.read(tmp_path / "o.ply")["vertex"].data
    expected = np.concatenate([local[0], turn.apply(local[1]) + move])
    assert np.column_stack([table[k] for k in "xyz"]) == pytest.approx(expected)
    assert table["intensity"].tolist() == [*range(100), *range(100)]
    assert table["red"].tolist() == [0] * 100 + [7] * 100
    assert table["scan"].tolist() == [0] * 100 + [1] * 100
    run("simplify", path, tmp_path / "p.ply", "--ratio", "1", "--layer", "station 1")
    assert len(PlyData.read(tmp_path / "p.ply")["vertex"].data) == 100


def damaged(folder, ending):
    """Return files of a format that are cut short, empty, or declare too much."""
    whole = folder / f"whole.{ending}"
    if ending in ("las", "laz"):
        make_las(whole)
    elif ending == "pcd":
        cloud = pypcd4.PointCloud.from_xyz_points(POINTS.astype(np.float32))
        cloud.save(whole, pypcd4.Encoding.BINARY_COMPRESSED)
    elif ending == "ptx":
        pose = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
        rows = "".join(f"{x} {y} {z} 1\n" for x, y, z in POINTS[:100])
        whole.write_text("10\n10\n" + pose + rows)
    else:
        with pye57.E57(str(whole), mode="w") as file:
            axes = ("cartesianX", "cartesianY", "cartesianZ")
            file.write_scan_raw(dict(zip(axes, POINTS.T, strict=True)))
    data = whole.read_bytes()
    whole.unlink()
    yield b""
    yield from (data[: int(share * len(data))] for share in (0.01, 0.3, 0.9))
    yield b"something else, " * 100
    if ending == "las":
        yield (
            data[:107]
            + (10**9).to_bytes(4, "little")
            + data[111:247]
            + (10**9).to_bytes(8, "little")
            + data[255:]
        )
    if ending == "pcd":
        yield data.replace(f"POINTS {len(POINTS)}".encode(), b"POINTS 1000000000").replace(
            f"WIDTH {len(POINTS)}".encode(), b"WIDTH 1000000000"
        )
    if ending == "ptx":
        yield data.replace(b"10\n10\n", b"100000\n10000\n")


@pytest.mark.parametrize("ending", ["las", "laz", "pcd", "ptx", "e57"])
def test_damaged_scans_end_in_one_sentence(run, tmp_path, ending):
    (tmp_path / "in").mkdir()
    for number, data in enumerate(damaged(tmp_path, ending)):
        path = tmp_path / "in" / f"{number}.{ending}"
        path.write_bytes(data)
        said = run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", status=2)
        assert str(path) in said
    assert [path.name for path in tmp_path.iterdir()] == ["in"]


def test_a_missing_library_is_named(run, tmp_path, monkeypatch):
    path = make_las(tmp_path / "in.las")
    monkeypatch.setitem(sys.modules, "laspy", None)
    said = run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", status=2)
    assert "pip install 'salient-simplify[scans]'" in said


def test_readers_say_nothing_when_imported():
    code = f"import {las.__name__}, {pcd.__name__}, {ptx.__name__}, {e57.__name__}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout + done.stderr == b""
