# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are damaged, misnamed or full of traps: they work, or end in one clear sentence."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pymeshlab
import pytest
from models import model_path
from shapes import bumpy, torus

from meshlab_filter.cli import demo
from meshlab_filter.io import files

COMMAND = [sys.executable, "-m", "meshlab_filter"]
SMALL = ["degtri_sliding.off", "non_manif_hole.ply", "planar_logo.ply", "sliver_tet.ply"]
"""Of the models in the folder `nasty` those that take a second or two."""


def write(path, mesh=None, **options):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(mesh or pymeshlab.Mesh(*torus(30, 15)))
    meshes.save_current_mesh(str(path), **options)
    return path


@pytest.mark.parametrize("name", SMALL)
def test_nasty_models(run, tmp_path, name):
    path = model_path(f"nasty/{name}")
    for number, arguments in enumerate(
        (
            ["simplify", "--ratio", "0.5"],
            ["simplify", "--alpha", "30"],
            ["saliency"],
            ["regions"],
            ["lods", "--ratios", "0.5", "0.1"],
        )
    ):
        command, *rest = arguments
        run(command, path, tmp_path / f"{number}_{{}}.ply", *rest)
    original = files.load(path)
    for output in tmp_path.iterdir():
        mesh_set = files.load(output)
        points = mesh_set.current_mesh().vertex_matrix()
        assert 0 < len(points) <= original.current_mesh().vertex_number()
        assert np.isfinite(points).all()


@pytest.mark.parametrize("ending", ["3ds", "ply", "stl", "obj", "off", "wrl", "ctm", "x3d", "e57"])
def test_files_cut_short(run, tmp_path, ending):
    whole = write(tmp_path / f"whole.{ending}").read_bytes()
    cut = tmp_path / f"cut.{ending}"
    for share in (0.0, 0.002, 0.1, 0.5):
        cut.write_bytes(whole[: int(share * len(whole))])
        try:
            said = run("simplify", cut, tmp_path / "o.ply", "--ratio", "0.5", status=2)
        except AssertionError:
            assert ending == "obj"  # lines of text: nothing tells how many there should be
            (tmp_path / "o.ply").unlink()
        else:
            assert f"cut.{ending}: " in said
    assert not (tmp_path / "o.ply").exists()


def test_files_that_are_something_else(run, tmp_path):
    for source, name in (("ply", "o.obj"), ("ply", "o.stl"), ("obj", "o.ply"), ("ply", "o.mlp")):
        write(tmp_path / f"in.{source}").rename(tmp_path / name)
        said = run("simplify", tmp_path / name, tmp_path / "x.ply", "--ratio", "0.5", status=2)
        assert name in said
    (tmp_path / "noise.ply").write_bytes(np.random.default_rng(0).bytes(10_000))
    run("simplify", tmp_path / "noise.ply", tmp_path / "x.ply", "--ratio", "0.5", status=2)
    assert not (tmp_path / "x.ply").exists()


def test_files_that_cannot_be_read(run, tmp_path):
    os.mkfifo(tmp_path / "pipe.ply")
    (tmp_path / "loop.ply").symlink_to("loop.ply")
    (tmp_path / "folder.ply").mkdir()
    (tmp_path / "nowhere.ply").symlink_to("gone.ply")
    for name, why in (
        ("pipe.ply", "is no regular file"),
        ("loop.ply", "leads nowhere"),
        ("folder.ply", "is a folder"),
        ("nowhere.ply", "leads nowhere"),
        ("a" * 300 + ".ply", "no such file"),
    ):
        said = run("simplify", tmp_path / name, tmp_path / "o.ply", "--ratio", "0.5", status=2)
        assert why in said
    said = run("simplify", "/proc/self/mem", tmp_path / "o.ply", "--ratio", "0.5", status=2)
    assert "/proc/self/mem" in said


def test_outputs_that_cannot_be_written(run, tmp_path):
    source = write(tmp_path / "in.ply")
    (tmp_path / "folder.ply").mkdir()
    (tmp_path / "link.ply").symlink_to("in.ply")
    os.mkfifo(tmp_path / "pipe.ply")
    for name, why in (
        ("folder.ply", "is a folder"),
        ("link.ply", "is a link to in.ply"),
        ("pipe.ply", "is no regular file"),
        ("in.ply/o.ply", "no such folder"),
    ):
        arguments = ("--ratio", "0.5", "--force")
        assert why in run("simplify", source, tmp_path / name, *arguments, status=2)
    said = run("simplify", source, "/proc/o.ply", "--ratio", "0.5", status=2)
    assert "/proc/o.ply: cannot be written" in said
    for report in (source, "/dev/stdout"):
        arguments = ("--ratio", "0.5", "--force", "--report", report)
        run("simplify", source, tmp_path / "o.ply", *arguments, status=2)
    run("compare", source, source, "--report", source, "--force", status=2)
    mesh_set = files.load(source)
    assert mesh_set.current_mesh().vertex_number() == 450


@pytest.mark.parametrize(
    "name",
    [
        "石像 süß", "quo'te\"s", "--force", "%s%d{0}", "new\nline", "..", "back\\slash",
        "$(touch pwned);touch pwned", "\x1b[31mred",
    ],
)  # fmt: skip
def test_names(run, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / f"{name}.ply")
    (tmp_path / "out").mkdir()
    for ending in ("ply", "obj", "mlp"):
        output = tmp_path / "out" / f"{name} o.{ending}"
        said = run("simplify", f"./{name}.ply", output, "--ratio", "0.5")
        assert "\x1b" not in said
        light = files.load(output)
        assert light.current_mesh().vertex_number() in (225, 450)
    assert not list(tmp_path.rglob("pwned"))
    assert len(list((tmp_path / "out").iterdir())) == 5


def test_a_name_that_is_no_text(tmp_path):
    name = os.fsencode(tmp_path) + b"/by\xffte.ply"
    shutil.copy(write(tmp_path / "in.ply"), name)
    for pair in ([name, b"o.ply"], [b"in.ply", b"l\xfeight.ply"]):
        done = subprocess.run(
            [*COMMAND, "simplify", *pair, "--ratio", "0.5"],
            cwd=tmp_path, capture_output=True, check=False,
        )  # fmt: skip
        assert done.returncode == 2
        assert b"is no valid UTF-8" in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert len(list(tmp_path.iterdir())) == 2


def test_projects_that_are_not_whole(run, tmp_path):
    write(tmp_path / "a.ply")
    start = "<!DOCTYPE MeshLabDocument>\n<MeshLabProject><MeshGroup>"
    end = "</MeshGroup><RasterGroup/></MeshLabProject>"
    mesh = '<MLMesh label="{0}" filename="{0}"/>'
    (tmp_path / "empty.ply").touch()
    for number, (text, why) in enumerate(
        (
            (start + mesh.format("gone.ply") + end, "gone.ply"),
            (start + mesh.format("a.ply"), "not a MeshLab project"),
            (start + mesh.format("empty.ply") + end, "empty.ply: is empty"),
            (start + end, "holds no mesh"),
            (start + '<MLMesh label="x"/>' + end, "mesh file not found"),
            ("", "is empty"),
        )
    ):
        path = tmp_path / f"p{number}.mlp"
        path.write_text(text)
        assert why in run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", status=2)
    assert not (tmp_path / "o.ply").exists()


def test_values_that_the_reader_leaves_out_are_told(run, tmp_path):
    path = tmp_path / "in.ply"
    lines = [f"{x} {y} {z} 1 7 9" for x, y, z in bumpy()]
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(lines)}\n"
        + "".join(f"property float {name}\n" for name in "xyz")
        + "property float intensity\nproperty int scan_id\nproperty float red\nend_header\n"
        + "\n".join(lines)
    )
    assert run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5") == ""
    said = run("simplify", path, tmp_path / "o.obj", "--ratio", "0.5")
    assert ".obj files do not keep intensity, scan_id, red; .ply does" in said
    said = run("simplify", path, tmp_path / "o.off", "--ratio", "0.5")
    assert "MeshLab does not read intensity, scan_id, red; the output is without" in said
    assert run("simplify", path, tmp_path / "p.ply", "--ratio", "0.5", "--quiet") == ""


def test_a_scan_that_comes_along_says_nothing(run, tmp_path):
    output = tmp_path / "o.obj"
    assert run("simplify", demo.sample("bunny10k_textured.obj"), output, "--ratio", "0.5") == ""
