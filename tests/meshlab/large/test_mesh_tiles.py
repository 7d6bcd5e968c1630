# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in tiles: from a PLY file to one, killed, resumed, damaged, refused."""

import json
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from shapes import grid, torus

import meshlab_filter
import salcore
from meshlab_filter.cli.command import main
from meshlab_filter.io import ply
from meshlab_filter.large.mesh_job import MeshJob
from meshlab_filter.large.mesh_run import simplify_mesh
from meshlab_filter.large.ply_blocks import look_at_mesh
from salcore.arrays.edges import find_edges


@pytest.fixture(autouse=True)
def same_code(monkeypatch):
    """Let processes import the code that the tests import, whatever copy is installed."""
    monkeypatch.setenv("PYTHONPATH", str(Path(meshlab_filter.__file__).parents[1]))


def write_mesh(path, points, faces, order="<", dtype="f4", lists=3, extra=()):
    """Write a mesh whose points and faces carry what tells them apart."""
    kinds = {"f4": "float", "f8": "double"}
    vertex = np.zeros(
        len(points), [(c, order + dtype) for c in "xyz"] + [("red", "u1"), ("id", order + "i4")]
    )
    for axis, name in enumerate("xyz"):
        vertex[name] = points[:, axis]
    vertex["red"], vertex["id"] = np.arange(len(points)) % 251, np.arange(len(points))
    face = np.zeros(
        len(faces), [("n", "u1"), ("corners", order + "i4", lists), ("mark", order + "f4")]
    )
    face["n"], face["corners"], face["mark"] = lists, faces, np.arange(len(faces)) / 8
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    lines = ["ply", f"format {form} 1.0", "comment from a test", f"element vertex {len(points)}"]
    lines += [f"property {kinds[dtype]} {c}" for c in "xyz"]
    lines += ["property uchar red", "property int id", f"element face {len(faces)}"]
    lines += ["property list uchar int vertex_indices", "property float mark", *extra]
    data = "\n".join([*lines, "end_header", ""]).encode()
    path.write_bytes(data + vertex.tobytes() + face.tobytes() + b"\0" * 8 * len(extra))
    return path


def bumpy_torus():
    """Return a closed mesh of 3080 points."""
    points, faces = torus(70, 44)
    noise = np.random.default_rng(3).normal(scale=0.002, size=(len(points), 1))
    return points * (1.0 + noise + 0.02 * np.sin(9 * points[:, :1])), faces


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    return write_mesh(tmp_path_factory.mktemp("mesh") / "torus.ply", *bumpy_torus())


def make_job(folder, path, target="ratio", value=0.15, most=800, **options):
    """Return a job of small tiles."""
    source, layout = look_at_mesh(path)
    parameters = salcore.Parameters().as_dict()
    return MeshJob(
        str(folder), (source,), parameters, target, float(value), most, layout=layout, **options
    )


@pytest.fixture(scope="module")
def expected(mesh, tmp_path_factory):
    """Return the bytes that a pool of two processes writes, undisturbed."""
    folder = tmp_path_factory.mktemp("pool")
    figures = simplify_mesh(make_job(folder / "work", mesh), folder / "light.ply", workers=2)
    assert figures["tiles"] >= 4
    assert figures["passes"] > 1
    assert not (folder / "work").exists()
    return (folder / "light.ply").read_bytes()


def open_edges(faces):
    """Return how many edges have one face, and how many more than two."""
    edges = find_edges(faces, int(faces.max()) + 1)
    return int((edges.uses == 1).sum()), int((edges.uses > 2).sum())


def test_the_light_mesh_is_closed_and_carries_all_bit_for_bit(mesh, expected, tmp_path):
    (tmp_path / "light.ply").write_bytes(expected)
    (before,), (after,) = ply.read(mesh), ply.read(tmp_path / "light.ply")
    assert len(after.points) == 462
    assert open_edges(after.faces) == (0, 0)
    assert len(after.faces) == 2 * 462  # a torus
    number = after.columns["id"]
    assert (np.diff(number) > 0).all()
    for name, values in before.columns.items():
        assert values.dtype == after.columns[name].dtype
        np.testing.assert_array_equal(after.columns[name], values[number])
    mark = (8 * after.face_columns["mark"]).astype(int)
    assert len(np.unique(mark)) == len(mark)
    # A face stands where the face was whose values it has, or next to it.
    middle = before.points[before.faces[mark]].mean(axis=1)
    away = np.linalg.norm(after.points[after.faces].mean(axis=1) - middle, axis=1)
    assert np.median(away) < 0.1
    assert b"comment from a test" in expected[:200]
    whole = salcore.simplify(before.points, before.faces, count=462)
    surface = salcore.make_surface(before.points, before.faces)
    light, other = (
        salcore.compare(surface, salcore.make_surface(points, faces)).surface.rms
        for points, faces in (
            (after.points, after.faces),
            (before.points[whole.indices], whole.faces),
        )
    )
    assert light < 1.15 * other  # tiles of hardly a hundred kept points


def test_big_endian_and_doubles_are_written_as_they_were(expected, tmp_path):
    path = write_mesh(tmp_path / "big.ply", *bumpy_torus(), order=">", dtype="f8")
    figures = simplify_mesh(make_job(tmp_path / "work", path), tmp_path / "a.ply", workers=1)
    (layer,) = ply.read(tmp_path / "a.ply")
    assert figures["kept_points"] == len(layer.points) == 462
    assert ply.read_header(tmp_path / "a.ply").order == ">"
    assert open_edges(layer.faces) == (0, 0)
    (before,) = ply.read(path)
    np.testing.assert_array_equal(layer.points, before.points[layer.columns["id"]])


def test_dask_writes_the_same_bytes(mesh, expected, tmp_path):
    job = make_job(tmp_path / "work", mesh)
    simplify_mesh(job, tmp_path / "light.ply", workers=2, scheduler="local")
    assert (tmp_path / "light.ply").read_bytes() == expected


def test_tiles_without_faces_do_no_harm(tmp_path):
    points, faces = bumpy_torus()
    rng = np.random.default_rng(1)
    loose = 5.0 + rng.random((5000, 3))
    path = write_mesh(tmp_path / "a.ply", np.concatenate([points, loose]), faces)
    job = make_job(tmp_path / "work", path, "count", 700)
    figures = simplify_mesh(job, tmp_path / "b.ply", workers=1)
    (light,) = ply.read(tmp_path / "b.ply")
    assert figures["kept_points"] == len(light.points) == 700
    assert open_edges(light.faces) == (0, 0)


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
def test_a_killed_run_goes_on_where_it_was_and_writes_the_same(mesh, expected, tmp_path):
    output, work = tmp_path / "light.ply", tmp_path / "work"

    def kill():
        while not (work / "left-0-0.npz").exists():
            time.sleep(0.01)
        busy = psutil.Process().children(recursive=True)
        workers = [p for p in busy if "spawn_main" in " ".join(p.cmdline())]
        os.kill(max(workers, key=lambda p: p.memory_info().rss).pid, signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    job = make_job(work, mesh)
    with pytest.raises(salcore.MemoryLimitError, match=r"a worker was killed.*--resume"):
        simplify_mesh(job, output, workers=1)
    thread.join()
    assert not output.exists()
    with pytest.raises(salcore.SalcoreError, match="exists already; go on with it by --resume"):
        simplify_mesh(job, output, workers=1)
    with pytest.raises(salcore.SalcoreError, match=r"belongs to another run.*keep_border"):
        simplify_mesh(make_job(work, mesh, keep_border=True), output, workers=1, resume=True)
    simplify_mesh(job, output, workers=1, resume=True)
    assert output.read_bytes() == expected


@pytest.mark.parametrize("most", [800, 10_000])
def test_a_number_of_faces_is_met(mesh, tmp_path, most):
    job = make_job(tmp_path / "work", mesh, "faces", 900, most)
    figures = simplify_mesh(job, tmp_path / "light.ply", workers=1)
    assert figures["kept_faces"] == 900
    assert figures["passes"] == (1 if most > 3080 else figures["passes"])


def test_what_is_no_mesh_is_left_out_and_said(tmp_path):
    points, faces = grid(50, 70)
    points[:, 2] = np.sin(points[:, 0] / 5)
    rng = np.random.default_rng(0)
    copied = rng.random(faces.shape) < 0.05
    again = faces.copy()
    again[copied] = len(points) + np.arange(copied.sum())
    every = np.concatenate([points, points[faces[copied]], [[5.0, 5.0, 9.0], [np.nan] * 3]])
    flat = np.concatenate([again, [[0, 0, 1]], [[0, 1, len(every) - 1]], again[:9, ::-1]])
    path, said = write_mesh(tmp_path / "a.ply", every, flat), []
    job = make_job(tmp_path / "work", path, "count", 600, 900)
    figures = simplify_mesh(job, tmp_path / "b.ply", workers=1, warn=said.append)
    (light,) = ply.read(tmp_path / "b.ply")
    assert (
        figures["kept_points"] == len(light.points) == len(np.unique(light.points, axis=0)) == 600
    )
    single, crowded = open_edges(light.faces)
    assert crowded == 0
    assert single < 2 * (49 + 69)
    text = " ".join(said)
    assert "2 points that no face uses are left out" in text
    assert f"{copied.sum():,} points equal others" in text
    assert "9 faces are the backs of others and are left out" in text


def test_other_elements_and_braces_in_comments_do_no_harm(tmp_path):
    points, faces = grid(12, 12)
    extra = ["element camera 1", "property double focal"]
    path = write_mesh(tmp_path / "a.ply", points, faces, extra=extra[:1])
    data = path.read_bytes().replace(b"camera 1", b"camera 1\nproperty double focal", 1)
    path.write_bytes(data.replace(b"from a test", b"{from} {0}", 1))
    assert main(["simplify", str(path), str(tmp_path / "b.ply"), "--count", "50", "--tiled"]) == 0
    (light,) = ply.read(tmp_path / "b.ply")
    assert len(light.points) == 50
    assert b"comment {from} {0}\n" in (tmp_path / "b.ply").read_bytes()
    assert b"camera" not in (tmp_path / "b.ply").read_bytes()


def test_texture_with_seams_is_refused(tmp_path):
    points, faces = grid(30, 30)
    path = write_mesh(tmp_path / "a.ply", np.concatenate([points, points]), faces)
    faces = faces + 900 * (np.arange(len(faces)) % 2)[:, None]
    data = write_mesh(path, np.concatenate([points, points]), faces).read_bytes()
    path.write_bytes(data.replace(b"int id", b"short s\nproperty short t", 1))
    said = []
    with pytest.raises(salcore.SalcoreError, match="its texture has seams, which tiles do not"):
        simplify_mesh(
            make_job(tmp_path / "work", path), tmp_path / "b.ply", workers=1, warn=said.append
        )


@pytest.fixture
def say(capsys, tmp_path, monkeypatch):
    """Run the command in a folder of its own and return its one line on standard error."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments, status=2):
        assert main([str(a) for a in ("simplify", *arguments, "--quiet")]) == status
        return capsys.readouterr().err

    return call


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["light.ply", "--max-error", 0.1], "--max-error: is not worked out by tiles"),
        (["light.ply", "--alpha", 1], "give --ratio, --count or --faces"),
        (["light.obj", "--ratio", 0.1], "the tiles of a mesh are written as .ply"),
        (["light.ply", "--ratio", 0.1, "--placement", "optimal"], "--placement: needs the whole"),
        (["light.ply", "--ratio", 0.1, "--transfer-normals"], "--transfer-normals: needs the"),
        (["light.ply", "--ratio", 0.1, "--memory", "9M"], "too little for one tile; give at least"),
        (["light.ply", "--ratio", 0.1, "--resume", "none"], "holds no run to resume"),
    ],
)
def test_what_tiles_cannot_do_is_refused(mesh, say, tmp_path, arguments, message):
    said = say(mesh, *arguments, "--tiled")
    assert message in said
    assert len(said.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_files_that_tiles_cannot_read_are_refused(mesh, say, tmp_path):
    points, faces = grid(4, 4)
    quads = np.column_stack([faces, faces[:, 2]])
    tail = ["--ratio", 0.5, "--tiled"]
    write_mesh(tmp_path / "quads.ply", points, quads, lists=4)
    assert "not all faces are triangles" in say("quads.ply", "a.ply", *tail)
    write_mesh(tmp_path / "far.ply", points, faces + 9)
    assert "a face refers to a point outside 0 to 15" in say("far.ply", "b.ply", *tail)
    text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    text += "property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "text.ply").write_text(text + "0 0 0\n")
    assert "read from binary files only" in say("text.ply", "c.ply", *tail)
    data = mesh.read_bytes()
    (tmp_path / "short.ply").write_bytes(data[:-100])
    assert "is cut short" in say("short.ply", "d.ply", *tail)
    lists = b"property list uchar float texcoord\nproperty float mark"
    (tmp_path / "uv.ply").write_bytes(data.replace(b"property float mark", lists, 1))
    assert "lists such as 'texcoord' of face are not carried by tiles" in say(
        "uv.ply", "e.ply", *tail
    )
    flat = np.column_stack([faces[:, 0]] * 3)
    write_mesh(tmp_path / "flat.ply", points, flat)
    assert "has no faces with three different, finite corners" in say("flat.ply", "f.ply", *tail)
    assert "a mesh in one .ply file" in say(mesh, mesh.with_name("other.ply"), "g.ply", *tail)


def test_the_command_chooses_tiles_by_memory_and_says_so(mesh, tmp_path, monkeypatch, capsys):
    output, report = tmp_path / "light.ply", tmp_path / "report.json"
    arguments = ["simplify", str(mesh), str(output), "--ratio", "0.5", "--no-errors"]
    assert main([*arguments, "--memory", "1G"]) == 0
    assert "by tiles" not in capsys.readouterr().err
    assert len(ply.read(output)[0].points) == 1540
    # As if a point took more, for a mesh that needs so much would take minutes.
    monkeypatch.setattr("salcore.estimated_memory", lambda *_: 10**12)
    arguments += ["--memory", "1G", "--force", "--workers", "1", "--report", str(report)]
    assert main(arguments) == 0
    assert "light.ply: by tiles of at most" in capsys.readouterr().err
    assert len(ply.read(output)[0].points) == 1540
    assert json.loads(report.read_text())["kept_points"] == 1540
