# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs appear whole or not at all, whenever and however the command ends."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pymeshlab
import pytest
from shapes import torus

from meshlab_filter.cli import demo
from meshlab_filter.io import files, staging
from meshlab_filter.io.projects import save_project

COMMAND = [sys.executable, "-m", "meshlab_filter"]


def hear_ctrl_c():
    """Undo what a shell does to jobs in the background, as these tests may be one."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def start(folder, *arguments, before=hear_ctrl_c):
    """Start the command in a session of its own, so that its processes can be waited for."""
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=before,
    )  # fmt: skip


def wait_for_session(process):
    """Wait until no process of the session is left; return what was said."""
    _, said = process.communicate(timeout=60)
    for _ in range(600):
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return said
        time.sleep(0.05)
    raise AssertionError("a process outlives the command")


def staged(folder):
    return [path for path in folder.iterdir() if path.name.startswith(staging.PREFIX)]


@pytest.fixture
def scene(tmp_path):
    """A folder with a textured mesh and a project, and one for outputs."""
    folder = tmp_path / "in"
    folder.mkdir()
    for name in ("bunny10k_textured.obj", "bunny10k_textured.mtl", "TextureDouble_A.png"):
        shutil.copy(demo.sample(name), folder / name)
    meshes = pymeshlab.MeshSet(verbose=False)
    for name in ("one", "two"):
        meshes.add_mesh(pymeshlab.Mesh(*torus(60, 30)), name)
    save_project(meshes, folder / "scene.mlp", force=True)
    (tmp_path / "out").mkdir()
    return tmp_path


RUNS = {
    "ply": (["simplify", "in/scene_0_one.ply", "out/o.ply", "--ratio", "0.5"], ["o.ply"]),
    "obj": (
        ["simplify", "in/bunny10k_textured.obj", "out/o.obj", "--count", "900"],
        ["TextureDouble_A.png", "o.mtl", "o.obj"],
    ),
    "lods": (
        ["lods", "in/scene_1_two.ply", "out/o_{}.ply", "--ratios", "0.5", "0.2", "0.1"],
        ["o_0.ply", "o_1.ply", "o_2.ply"],
    ),
    "mlp": (
        ["simplify", "in/scene.mlp", "out/o.mlp", "--layer", "1", "--ratio", "0.5"],
        ["o_0_one.ply", "o_1_two.ply", "o_2_two_simplified.ply", "o.mlp"],
    ),
}


def check_outputs(out, names, before):
    """Every output is as it was, or loads; the main one comes last."""
    found = {path.name for path in out.iterdir() if not path.name.startswith(".")}
    assert found <= set(names)
    assert found >= set(before)
    for path in (out / name for name in found if not name.endswith((".png", ".mtl"))):
        if before.get(path.name) != path.read_bytes():
            mesh_set = files.load(path)
            assert min(mesh.vertex_number() for mesh in mesh_set) > 150
    if names[-1] in found and names[0] != "o_0.ply":  # each level stands for itself
        assert found == set(names)


@pytest.mark.parametrize("what", RUNS)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_killed_at_any_moment(scene, what, number):
    arguments, names = RUNS[what]
    dice = random.Random(f"{what} {number}")
    out = scene / "out"
    for existing in (True,) if number == signal.SIGTERM else (False, True):
        before = {}
        if existing:
            before = dict.fromkeys(names, b"precious")
            for name, content in before.items():
                (out / name).write_bytes(content)
        process = start(scene, *arguments, "--force")
        end = time.monotonic() + 30.0
        early = dice.random() < 0.3
        while not early and process.poll() is None and time.monotonic() < end and not staged(out):
            time.sleep(0.001)  # what matters happens once the hidden folder is there
        time.sleep(dice.uniform(0.0, 1.0 if early else 0.05))
        process.send_signal(number)
        said = wait_for_session(process)
        check_outputs(out, names, before)
        assert "Traceback" not in said
        if number == signal.SIGTERM:
            assert process.returncode in (0, 143, -15)
            assert staged(out) == []


def test_ctrl_c_is_heard_by_compiled_code(tmp_path):
    """A 3D Delaunay triangulation of many points takes half a minute, all of it in one call."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.random.default_rng(0).random((200_000, 3))))
    meshes.save_current_mesh(str(tmp_path / "in.ply"))
    process = start(tmp_path, "simplify", "in.ply", "o.ply", "--ratio", 0.1, "--graph", "delaunay")
    time.sleep(4.0)
    begin = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    said = wait_for_session(process)
    assert time.monotonic() - begin < 2.0
    assert process.returncode == 130
    assert said == "salient-simplify: interrupted: no partial file was left\n"
    assert os.listdir(tmp_path) == ["in.ply"]


def test_ctrl_c_while_starting(tmp_path):
    for delay in (0.1, 0.2, 0.4):
        process = start(tmp_path, "simplify", "none.ply", "o.ply", "--ratio", 0.1)
        ready = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        while ready.exists() and not ready.read_text() and process.poll() is None:
            time.sleep(0.001)  # before that, it is Python itself that starts
        time.sleep(delay)
        os.killpg(process.pid, signal.SIGINT)
        said = wait_for_session(process)
        assert (process.returncode, len(said.splitlines())) in ((130, 1), (2, 1))
        assert "Traceback" not in said


@pytest.mark.parametrize("ending", ["ply", "xyz", "e57", "mlp"])
def test_a_full_disk(tmp_path, ending):
    """A limit on the size of files is to a writer as a full disk is."""
    output = tmp_path / f"o.{ending}"
    output.write_bytes(b"precious")

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    process = start(
        tmp_path, "simplify", demo.sample("bone.ply"), output, "--ratio", 0.9, "--force",
        *["--points"] * (ending == "xyz"), before=limit,
    )  # fmt: skip
    said = wait_for_session(process)
    assert process.returncode == 1
    assert len(said.splitlines()) == 1
    assert "not written to the end" in said or "the disk full" in said
    assert output.read_bytes() == b"precious"
    assert [path.name for path in tmp_path.iterdir()] == [output.name]


def test_a_crash_is_one_sentence(tmp_path):
    """So is an end by the system when memory runs out."""
    program = (
        "import os, signal, sys; from meshlab_filter.io.supervise import supervise\n"
        "sys.exit(supervise(lambda: os.kill(os.getpid(), int(sys.argv[1]))))"
    )
    for number, message in ((signal.SIGSEGV, "(SIGSEGV)"), (signal.SIGKILL, "want of memory")):
        done = subprocess.run(
            [sys.executable, "-c", program, str(int(number))],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 1
        assert message in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_a_failed_move_is_undone(tmp_path):
    """A material can be moved into place, and then the file itself cannot."""
    with staging.staging(tmp_path / "o.obj") as folder:
        (folder / "o.mtl").write_text("new")
        (folder / "fresh.png").write_text("new")
        (folder / "o.obj").write_text("new")
        (tmp_path / "o.mtl").write_text("old")
        (tmp_path / "o.obj").mkdir()
        with pytest.raises(OSError, match=r"o\.obj"):
            staging.publish(folder, tmp_path / "o.obj", force=True)
    assert (tmp_path / "o.mtl").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["o.mtl", "o.obj"]


def test_hidden_folders_of_killed_runs_go_after_an_hour(tmp_path):
    fresh, stale, other = (
        tmp_path / name
        for name in (".salient-simplify-0123abcd", ".salient-simplify-4567cdef", ".salient-mine")
    )
    for folder in (fresh, stale, other):
        folder.mkdir()
        (folder / "o.ply").write_text("part")
    for folder in (stale, other):
        os.utime(folder, (0, 0))
    staging.write_text(tmp_path / "figures.json", "{}")
    assert {path.name for path in tmp_path.iterdir()} == {
        "figures.json", fresh.name, other.name
    }  # fmt: skip
