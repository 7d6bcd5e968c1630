# SPDX-License-Identifier: GPL-3.0-or-later
"""The command as a person runs it: real files, and real processes where these matter."""

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pymeshlab
import pytest
from models import model_path
from plyfile import PlyData, PlyElement
from shapes import bumpy, torus

import salcore
from meshlab_filter.cli import demo
from meshlab_filter.cli.command import main

COMMAND = [sys.executable, "-m", "meshlab_filter"]


def run(*arguments, status=0):
    """Run the command in this process, which saves starting one, and return what it printed."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            found = main([str(argument) for argument in arguments])
        except SystemExit as end:  # what the parser says
            found = end.code or 0
    assert found == status, err.getvalue()
    return SimpleNamespace(stdout=out.getvalue(), stderr=err.getvalue())


def run_process(*arguments, status=0):
    """Run the command as a shell does; no user ever sees a traceback."""
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr
    assert done.returncode == status, done.stderr
    return done


OPEN = []  # a mesh lives no longer than its set


def load(path):
    meshes = pymeshlab.MeshSet(verbose=False)
    OPEN[:] = [*OPEN[-3:], meshes]
    meshes.load_new_mesh(str(path))
    return meshes.current_mesh()


@pytest.fixture
def scan(tmp_path):
    """A file with a name that people do use."""
    path = tmp_path / "süß 石像 scan.ply"
    meshes = pymeshlab.MeshSet(verbose=False)
    colors = np.column_stack([np.random.default_rng(0).random((1500, 3)), np.ones(1500)])
    meshes.add_mesh(pymeshlab.Mesh(bumpy(), v_color_matrix=colors))
    meshes.save_current_mesh(str(path))
    return path


def test_simplify(scan, tmp_path):
    output, report = tmp_path / "leicht.ply", tmp_path / "figures.json"
    done = run_process("simplify", scan, output, "--alpha", 30, "--report", report)
    source, light = load(scan), load(output)
    kept = salcore.simplify(source.vertex_matrix(), alpha=30).indices
    assert light.vertex_matrix() == pytest.approx(source.vertex_matrix()[kept])
    assert (light.vertex_color_matrix() == source.vertex_color_matrix()[kept]).all()
    figures = json.loads(report.read_text())
    assert figures["points_after"] == len(kept)
    assert "1,500 -> " in done.stdout
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        [scan.name, "leicht.ply", "figures.json"]
    )


def test_parameters_and_presets_reach_the_core(scan, tmp_path):
    parameters = salcore.Parameters.preset("paper")
    points = load(scan).vertex_matrix()
    for extra, expected in (
        (["--preset", "paper"], salcore.simplify(points, parameters=parameters, alpha=10)),
        (["--cells", "3", "--no-whole-percent"], salcore.simplify(
            points, parameters=salcore.Parameters(cells=3), alpha=10)),
        (["--max-gap", "3"], salcore.simplify(
            points, parameters=salcore.Parameters(max_gap=3), alpha=10)),
    ):  # fmt: skip
        run("simplify", scan, tmp_path / "o.ply", "--alpha", 10, "--force", "--quiet", *extra)
        assert load(tmp_path / "o.ply").vertex_number() == len(expected.indices)


def test_meshes_stay_meshes(tmp_path):
    scan, output = demo.sample("bone.ply"), tmp_path / "bone.ply"
    done = run("simplify", scan, output, "--ratio", 0.25)
    assert load(output).vertex_number() == round(0.25 * 1872)
    assert load(output).face_number() > 0
    assert "faces    3,022 -> " in done.stdout
    run("simplify", scan, output, "--count", 100, "--points", "--force", "--quiet")
    assert (load(output).vertex_number(), load(output).face_number()) == (100, 0)
    run("simplify", scan, output, "--max-error", 0.01, "--force", "--quiet")
    errors = salcore.compare(
        *(salcore.make_surface(load(p).vertex_matrix(), load(p).face_matrix())
          for p in (scan, output))
    )  # fmt: skip
    assert errors.surface.max <= 0.01 * errors.diagonal * 1.001


def test_levels_of_detail(tmp_path):
    scan = demo.sample("bone.ply")
    run("lods", scan, tmp_path / "bone_{}.obj", "--ratios", 0.5, 0.25, 0.1)
    counts = [load(tmp_path / f"bone_{level}.obj").vertex_number() for level in range(3)]
    assert counts == [936, 468, 187]
    message = run("lods", scan, tmp_path / "b.obj", "--ratios", 0.5, status=2).stderr
    assert "name a pattern with {}" in message


@pytest.mark.parametrize("ending", ["ply", "obj", "off", "xyz"])
def test_formats(scan, tmp_path, ending):
    output = tmp_path / f"out.{ending}"
    run("simplify", scan, output, "--alpha", 20, "--quiet")
    assert 0 < load(output).vertex_number() < 1500


def test_saliency_and_regions_with_pictures(scan, tmp_path):
    for what in ("saliency", "regions"):
        output, picture = tmp_path / f"{what}.ply", tmp_path / f"{what}.png"
        run_process(what, scan, output, "--picture", picture, "--up", "z")
        assert picture.read_bytes()[:4] == b"\x89PNG"
        mesh = load(output)
        expected = getattr(salcore.analyze(load(scan).vertex_matrix()), what)
        assert mesh.vertex_scalar_array() == pytest.approx(expected, abs=1e-6)
        assert len(np.unique(mesh.vertex_color_matrix(), axis=0)) > 1


def test_compare(scan, tmp_path):
    output, report = tmp_path / "light.ply", tmp_path / "errors.json"
    run("simplify", scan, output, "--alpha", 50, "--quiet")
    done = run("compare", scan, output, "--report", report)
    errors = json.loads(report.read_text())
    assert errors["point"]["max"] > 0
    assert f"{errors['point']['max']:.4g} max" in done.stdout


def test_nothing_is_overwritten_without_force(scan, tmp_path):
    before = scan.read_bytes()
    assert "is the input" in run("simplify", scan, scan, "--alpha", 1, status=2).stderr
    other = tmp_path / "other.ply"
    other.write_text("precious")
    assert "exists already" in run("simplify", scan, other, "--alpha", 1, status=2).stderr
    assert other.read_text() == "precious"
    assert scan.read_bytes() == before
    run("simplify", scan, other, "--alpha", 1, "--force", "--quiet")
    assert load(other).vertex_number() > 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["simplify", "IN", "out.ply"], "--alpha"),
        (["simplify", "IN", "out.ply", "--alpha", "-2"], "alpha=-2.0: give a number from 0"),
        (["simplify", "IN", "out.ply", "--alpha", "much"], "--alpha: 'much' is no number"),
        (["simplify", "IN", "out.ply", "--alpha", "1", "--cells", "99"], "cells=99"),
        (["simplify", "none.ply", "out.ply", "--alpha", "1"], "none.ply: no such file"),
        (["simplify", ".", "out.ply", "--alpha", "1"], "is a folder"),
        (["simplify", "IN", "missing/out.ply", "--alpha", "1"], "missing: no such folder"),
        (["simplify", "IN", "out.nonsense", "--alpha", "1"], "out.nonsense"),
        (["simplify", "text.ply", "out.ply", "--alpha", "1"], "text.ply"),
        (["simplify", "IN", "out.ply", "--alpha", "1", "--layer", "x"], "layer 'x': there is none"),
        (["saliency", "IN", "out.ply", "--picture", "missing/p.png"], "missing: no such folder"),
        (["wonder"], "'wonder' is no command; give one of"),
        (["simplify", "IN"], "missing: output"),
        (
            ["simplify", "IN", "out.ply", "--ratoi", "1"],
            "--ratoi: no such option; did you mean --r",
        ),
        (["--verion"], "--verion: no such option; did you mean --version?"),
        (["simplify", "IN", "out.ply", "--count", "1.5"], "--count: '1.5' is no whole number"),
        (["simplify", "IN", "out.ply", "--count"], "--count: give a value after it"),
        (
            ["simplify", "IN", "out.ply", "--count", "1", "--ratio", "1"],
            "--ratio: not together with --count; give one",
        ),
        (["simplify", "IN", "out.ply", "--preset", "best"], "--preset: 'best' is none of"),
        (["compare", "IN", "IN", "IN"], "one argument too many"),
        (["simplify", "IN", ".", "--ratio", "1"], "is a folder; name a file in it"),
        (["simplify", "nan.xyz", "out.ply", "--ratio", "1"], "all coordinates are NaN"),
    ],
)
def test_mistakes_are_one_line_and_status_2(scan, tmp_path, monkeypatch, arguments, message):
    (tmp_path / "text.ply").write_text("this is no mesh")
    (tmp_path / "nan.xyz").write_text("nan nan nan\n" * 3)
    before = sorted(p.name for p in tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    said = run(*(scan if a == "IN" else a for a in arguments), status=2).stderr
    assert message in said
    assert sum("error: " in line for line in said.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_mistakes_of_a_process_are_one_line_and_status_2(scan, tmp_path):
    done = run_process("simplify", scan, tmp_path / "o.ply", "--alpha", 1, "--layer", "x", status=2)
    assert "layer 'x': there is none" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "'wonder' is no command" in run_process("wonder", status=2).stderr
    assert [p.name for p in tmp_path.iterdir()] == [scan.name]


@pytest.fixture
def project(tmp_path):
    folder = tmp_path / "scene"
    folder.mkdir()
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(bumpy()), "ground")
    meshes.save_current_mesh(str(folder / "ground.ply"))
    meshes.add_mesh(pymeshlab.Mesh(*torus(40, 20)), "ring")
    meshes.set_matrix(transformmatrix=np.diag([3.0, 3, 3, 1]), freeze=False)
    meshes.save_current_mesh(str(folder / "ring.ply"))
    meshes.save_project(str(folder / "scene.mlp"))
    return folder / "scene.mlp"


@pytest.mark.parametrize("layer", ["ring", "1"])
def test_projects(project, tmp_path, layer):
    folder = tmp_path / "out"
    folder.mkdir()
    run("simplify", project, folder / "light.mlp", "--layer", layer, "--alpha", 10)
    moved = folder.rename(tmp_path / "moved elsewhere")
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_project(str(moved / "light.mlp"))
    counts = [(m.label(), m.vertex_number(), m.face_number()) for m in meshes]
    assert counts[:2] == [("ground", 1500, 0), ("ring", 800, 1600)]
    assert counts[2][0] == "ring simplified"
    assert 0 < counts[2][1] < 800
    assert meshes.mesh(2).transform_matrix()[0, 0] == 3
    assert str(tmp_path) not in (moved / "light.mlp").read_text()


def test_projects_are_not_overwritten(project):
    message = run("simplify", project, project, "--layer", 1, "--alpha", 1, status=2).stderr
    assert "is the input" in message


def test_invalid_points_that_the_reader_drops_are_told(tmp_path):
    source = PlyData.read(model_path("nasty/kinect_nan.ply"))["vertex"].data[::16].copy()
    PlyData([PlyElement.describe(source, "vertex")]).write(tmp_path / "i.ply")
    invalid = np.count_nonzero(~np.isfinite([source[axis] for axis in "xyz"]).all(axis=0))
    assert invalid > 1000
    done = run("simplify", tmp_path / "i.ply", tmp_path / "o.ply", "--alpha", 90)
    assert f"{invalid} of {len(source)} points have no valid coordinates" in done.stderr


def test_ctrl_c_leaves_nothing(tmp_path):
    path = model_path("dragon_vrip.ply")
    process = subprocess.Popen(
        [*COMMAND, "simplify", str(path), "dragon.ply", "--ratio", "0.1"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        # a shell lets jobs in the background, as these tests may be, not hear it
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    time.sleep(4.0)  # reading takes one second, the rest some twenty
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "interrupted: no partial file was left" in message
    assert "Traceback" not in message
    assert os.listdir(tmp_path) == []


def test_libraries_that_are_not_installed_are_named():
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-S", "-m", "meshlab_filter", "compare", "a.ply", "b.ply"],  # no packages
        cwd=root, env={}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "No module named 'numpy'" in done.stderr
    assert "pip install 'salient-simplify[meshlab]'" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_demo(tmp_path):
    done = run("demo", tmp_path / "demo")
    names = {p.name for p in (tmp_path / "demo").iterdir()}
    for scan in demo.SCANS:
        for what in ("saliency", "regions", "simplified"):
            assert f"{scan}_{what}.ply" in names
    report = json.loads((tmp_path / "demo" / "report.json").read_text())
    assert report["face"]["points_before"] == 85849
    assert (tmp_path / "demo" / "demo.png").stat().st_size > 100_000
    assert report["face"]["faces_after"] > 5000
    assert "demo.png" in done.stdout
    light = load(tmp_path / "demo" / "face_simplified.ply")
    assert light.vertex_number() == report["face"]["points_after"]


def test_the_two_ways_to_call_it():
    assert run_process("--version").stdout.split() == ["salient-simplify", salcore.__version__]
    assert run("--version").stdout.split() == ["salient-simplify", salcore.__version__]
    assert "simplify" in run_process("--help").stdout


def test_help_fits_on_a_screen_and_help_all_names_everything():
    short, whole = (run("simplify", option).stdout for option in ("--help", "--help-all"))
    assert len(short.splitlines()) <= 36
    for option in ("--ratio", "--count", "--faces", "--max-error", "--memory", "--report"):
        assert f"  {option} " in short
    for row in (*salcore.TABLE, *salcore.TARGETS):
        assert f"--{row.name.replace('_', '-')}" in whole


def test_help_needs_no_library_that_takes_long_to_import():
    code = (
        "import sys; from meshlab_filter.cli.options import make_parser; make_parser(); "
        "print(*sorted({name.split('.')[0] for name in sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"scipy", "pymeshlab", "dask", "tqdm"} & set(done.stdout.split())


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion(shell):
    script = run("--completion", shell).stdout
    assert "max-error" in script
    assert "lods" in script
