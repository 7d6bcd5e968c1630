# SPDX-License-Identifier: GPL-3.0-or-later
"""Every command that README and documentation print runs."""

import importlib.util
import re
import shlex
from pathlib import Path

import pymeshlab
import pytest
from mesh_files import write_glb, write_obj
from scan_files import make_las
from shapes import torus

from meshlab_filter.cli.command import main
from meshlab_filter.io.projects import save_project

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
SHELL = re.compile(r"```sh\n(.*?)```", re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with all files that commands name."""
    folder = tmp_path_factory.mktemp("files")
    points, faces = torus(150, 140)  # more than any count that is asked for
    write_glb(folder / "scene.glb", [{"points": points, "faces": faces, "node": {}}])
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points, faces))
    meshes.set_selection_none()
    meshes.compute_selection_by_condition_per_vertex(condselect="x > 1.39")
    meshes.save_current_mesh(str(folder / "statue.ply"), save_vertex_flag=True)
    points, faces = torus(40, 30)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points, faces), "statue")
    for name in ("room", "part", "splat", "huge"):
        meshes.save_current_mesh(str(folder / f"{name}.ply"))
    meshes.add_mesh(pymeshlab.Mesh(points[:500]), "scan 3")
    for name in ("scene", "room"):
        save_project(meshes, folder / f"{name}.mlp", force=True)
    coords = points[:, :2], faces
    write_obj(folder / "atlas.obj", points, faces, coords=coords)
    for name in ("scans", "tiles"):
        (folder / name).mkdir()
        make_las(folder / name / "one.laz")
    return folder


def commands():
    """Yield the lines of shell that call the command, but for loops and other machines."""
    seen = set()
    for page in PAGES:
        for block in SHELL.findall(page.read_text(encoding="utf-8")):
            for line in block.replace("\\\n", " ").splitlines():
                if line.startswith("salient-simplify ") and line not in seen:
                    seen.add(line)
                    yield pytest.param(line, id=" ".join(line.split())[len("salient-simplify ") :])


@pytest.mark.parametrize("line", list(commands()))
def test_a_command_that_is_printed_runs(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    arguments = shlex.split(line)[1:]
    if "--scheduler" in arguments:  # nobody else's machine is at hand
        arguments[arguments.index("--scheduler") + 1] = "local"
    if arguments[0] == "compare":
        main(["simplify", "statue.ply", "light.ply", "--ratio", "0.5", "--force", "--no-errors"])
    assert main([*arguments, "--force"]) == 0, capsys.readouterr().err


def printed(pattern):
    """Return what a pattern finds on all pages."""
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    return sorted({found for text in texts for found in re.findall(pattern, text)})


@pytest.mark.parametrize("module", printed(r"python -m ((?:benchmarks|docs|meshlab_filter)[\w.]*)"))
def test_a_module_that_is_printed_is_there(module):
    assert importlib.util.find_spec(module) is not None


@pytest.mark.parametrize("path", printed(r"(?:python|pytest) ((?:\w+/)+[\w.]*)"))
def test_a_script_or_test_that_is_printed_is_there(path):
    assert (ROOT / path).exists()
