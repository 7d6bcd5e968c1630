# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command leaves on the disk: nothing lost, nothing harmed, nothing said wrongly."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pymeshlab
import pytest
from shapes import bumpy, torus

import meshlab_filter as mf
import salcore
from meshlab_filter.cli import demo
from meshlab_filter.cli.command import main
from meshlab_filter.io import files
from meshlab_filter.io.projects import save_project

MAP = np.array([637100.25, 851327.5, 424.0])
"""Where a scan in map coordinates lies."""


def write_cloud(path, points):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points))
    meshes.save_current_mesh(str(path), save_vertex_color=False, save_vertex_quality=False)
    return path


@pytest.fixture
def cloud(tmp_path):
    return write_cloud(tmp_path / "cloud.ply", bumpy())


@pytest.fixture
def textured(tmp_path):
    folder = tmp_path / "textured"
    folder.mkdir()
    for name in ("bunny10k_textured.obj", "bunny10k_textured.mtl", "TextureDouble_A.png"):
        shutil.copy(demo.sample(name), folder / name)
    return folder / "bunny10k_textured.obj"


OPEN = []  # a mesh lives no longer than its set


def load(path):
    OPEN[:] = [*OPEN[-3:], files.load(path)]
    return OPEN[-1].current_mesh()


def header(path):
    return path.read_bytes().split(b"end_header")[0].decode()


def test_a_cloud_without_colour_or_quality_gets_none(run, cloud, tmp_path):
    output = tmp_path / "light.ply"
    run("simplify", cloud, output, "--ratio", 0.5)
    assert "red" not in header(output)
    assert "quality" not in header(output)
    run("saliency", cloud, tmp_path / "map.ply")
    assert "red" in header(tmp_path / "map.ply")
    assert "quality" in header(tmp_path / "map.ply")


def test_normals_of_faces_are_written_as_unit_vectors(run, tmp_path):
    """A mesh whose file has no normals gets none; as points it does."""
    for extra in ([], ["--points"]):
        output = tmp_path / "bone.ply"
        run("simplify", demo.sample("bone.ply"), output, "--ratio", 0.3, "--force", *extra)
        assert ("property double nx" in header(output)) == bool(extra)
        if extra:
            length = np.linalg.norm(load(output).vertex_normal_matrix(), axis=1)
            assert length[length > 0.0] == pytest.approx(1.0)
            assert (length > 0.0).sum() > 100


@pytest.mark.parametrize("ending", ["stl", "wrl", "3ds"])
def test_formats_that_cannot_hold_a_cloud_are_refused(run, cloud, tmp_path, ending):
    message = run("simplify", cloud, tmp_path / f"o.{ending}", "--ratio", 0.5, status=2)
    assert len(message.splitlines()) == 1
    assert "such as .ply" in message
    assert ".salient-" not in message
    assert [p.name for p in tmp_path.iterdir()] == ["cloud.ply"]


def test_stl_holds_a_mesh(run, tmp_path):
    run("simplify", demo.sample("bone.ply"), tmp_path / "o.stl", "--count", 500)
    assert load(tmp_path / "o.stl").face_number() > 100


@pytest.mark.parametrize("ending", ["ctm", "dae", "x3d", "e57"])
def test_formats_that_round_are_told(run, tmp_path, ending):
    scan = write_cloud(tmp_path / "map.ply", bumpy() + MAP)
    message = run("simplify", scan, tmp_path / f"o.{ending}", "--ratio", 0.5)
    assert "the format rounds coordinates" in message


@pytest.mark.parametrize("ending", ["ply", "obj", "off", "xyz"])
def test_formats_that_do_not_round(run, tmp_path, ending):
    scan = write_cloud(tmp_path / "map.ply", bumpy() + MAP)
    output = tmp_path / f"o.{ending}"
    assert run("simplify", scan, output, "--ratio", 0.5) == ""
    found = load(output).vertex_matrix()
    points = (bumpy() + MAP)[salcore.simplify(bumpy() + MAP, ratio=0.5).indices]
    assert np.abs(found - points).max() < 1e-5


def test_unknown_formats_are_refused_before_any_work(run, cloud, tmp_path):
    for name, why in (("o.nonsense", ".nonsense files are not written"), ("o", "has no ending")):
        assert why in run("simplify", cloud, tmp_path / name, "--ratio", 0.5, status=2)
    message = run("saliency", cloud, tmp_path / "o.ply", "--picture", "map.foo", status=2)
    assert "no format for pictures" in message
    assert [p.name for p in tmp_path.iterdir()] == ["cloud.ply"]


def test_two_outputs_of_one_name_are_refused(run, cloud, tmp_path):
    output = tmp_path / "o.ply"
    message = run("simplify", cloud, output, "--ratio", 0.5, "--report", output, status=2)
    assert "is to be written twice" in message


def test_the_inputs_own_texture_stays_as_it_is(run, textured):
    texture = textured.parent / "TextureDouble_A.png"
    before = texture.read_bytes()
    output = textured.parent / "light.obj"
    run("simplify", textured, output, "--ratio", 0.5)
    assert texture.read_bytes() == before
    assert list(load(output).textures()) == [texture.name]
    run("simplify", textured, textured.parent / "light.mlp", "--ratio", 0.5)
    assert texture.read_bytes() == before


def test_files_that_go_along_are_not_overwritten_without_force(run, textured, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    for name in ("TextureDouble_A.png", "light.mtl"):
        (folder / name).write_text("precious")
        message = run("simplify", textured, folder / "light.obj", "--ratio", 0.5, status=2)
        assert f"{name}: exists already and goes along with light.obj" in message
        assert [p.name for p in folder.iterdir()] == [name]
        assert (folder / name).read_text() == "precious"
        run("simplify", textured, folder / "light.obj", "--ratio", 0.5, "--force")
        assert {p.name for p in folder.iterdir()} == {
            "light.obj", "light.mtl", "TextureDouble_A.png"
        }  # fmt: skip
        for file in folder.iterdir():
            file.unlink()


def test_textures_in_folders(run, textured, tmp_path):
    folder = textured.parent / "maps"
    folder.mkdir()
    (textured.parent / "TextureDouble_A.png").rename(folder / "skin.png")
    material = textured.with_suffix(".mtl")
    material.write_text(material.read_text().replace("TextureDouble_A.png", "maps/skin.png"))
    for output in (textured.parent / "map.obj", tmp_path / "map.obj"):
        run("saliency", textured, output)
        assert (output.parent / "maps" / "skin.png").exists()
        assert load(output).texture_number() == 1


def test_texture_coordinates_of_corners_reach_a_cloud():
    meshes = files.load(demo.sample("bunny10k_textured.obj"))
    source = meshes.current_mesh()
    faces, wedges = source.face_matrix(), source.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    mf.generate_simplified_point_cloud_by_saliency(meshes, count=400)
    light = meshes.current_mesh()
    number = {tuple(p): i for i, p in enumerate(source.vertex_matrix())}
    for point, coordinates in zip(
        light.vertex_matrix(), light.vertex_tex_coord_matrix(), strict=True
    ):
        vertex = number[tuple(point)]
        assert (wedges[faces == vertex] == coordinates).all(axis=1).any()


@pytest.fixture
def project(tmp_path):
    """A project with a raster, and a layer whose matrix has more than six digits."""
    folder = tmp_path / "scene"
    folder.mkdir()
    from matplotlib.image import imsave

    imsave(folder / "photo.png", np.zeros((48, 64, 3)))
    meshes = pymeshlab.MeshSet(verbose=False)
    for name, mesh in (
        ("ring", pymeshlab.Mesh(*torus(40, 20))),
        ("a & <b>", pymeshlab.Mesh(bumpy())),
    ):
        meshes.add_mesh(mesh, name)
        meshes.save_current_mesh(str(folder / f"mesh {meshes.current_mesh_id()}.ply"))
    matrix = np.eye(4)
    matrix[:3, 3] = 637100.25, 851327.5, 424.0
    meshes.set_matrix(transformmatrix=matrix, freeze=False)
    meshes.load_new_raster(str(folder / "photo.png"))
    save_project(meshes, folder / "scene.mlp", force=True)
    return folder / "scene.mlp"


def test_projects_keep_matrices_rasters_and_names(run, project, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    run("simplify", project, folder / "light.mlp", "--layer", "1", "--ratio", 0.5)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_project(str(folder / "light.mlp"))
    assert [m.label() for m in meshes] == ["ring", "a & <b>", "a & <b> simplified"]
    for number in (1, 2):
        assert meshes.mesh(number).transform_matrix()[:3, 3].tolist() == MAP.tolist()
    assert meshes.raster_number() == 1
    text = (folder / "light.mlp").read_text()
    assert text.startswith("<!DOCTYPE MeshLabDocument>")
    reference = text.split('fileName="')[1].split('"')[0]
    assert os.path.samefile(folder / reference, project.parent / "photo.png")


def test_a_layer_of_several_is_named_and_its_matrix_too(run, project, tmp_path):
    message = run("simplify", project, tmp_path / "o.ply", "--ratio", 0.5)
    assert "has 2 layers" in message
    assert "matrix is kept in a project only" in message
    message = run("simplify", project, tmp_path / "p.ply", "--layer", "ring", "--ratio", 0.5)
    assert "has 2 layers" not in message
    assert "matrix" not in message


def test_a_reader_that_goes_away_is_no_traceback(cloud, tmp_path):
    command = [sys.executable, "-m", "meshlab_filter", "simplify", cloud, tmp_path / "o.ply"]
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [*map(str, command), "--ratio", "0.5"],
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write)
    assert done.stderr == ""
    assert (tmp_path / "o.ply").exists()


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("get_simplification_error", {"originallmesh": 0}, "did you mean originalmesh"),
        ("get_simplification_error", {"originalmesh": "x"}, "originalmesh='x': there is no such"),
        ("compute_scalar_by_saliency_per_vertex", {"colorise": True}, "did you mean colorize"),
        (
            "generate_simplified_point_cloud_by_saliency",
            {"ratio": 0.5, "customattributes": "mine"},
            "customattributes='mine': the layer has no scalar attribute",
        ),
    ],
)
def test_mistakes_in_filters(name, parameters, message):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(bumpy()))
    with pytest.raises(salcore.ParameterError, match=message):
        mf.apply(meshes, name, **parameters)
    assert meshes.mesh_number() == 1


def test_options_that_change_nothing_are_named(run, cloud, tmp_path):
    output, ratio = tmp_path / "o.ply", ("--ratio", 0.5, "--force")
    said = run("simplify", cloud, output, *ratio, "--keep-topology", "--placement", "optimal")
    assert "--placement, --keep-topology: for faces, and there are none" in said
    said = run("simplify", cloud, output, *ratio, "--protect-selected")
    assert "--protect-selected: no point of the input is selected" in said
    assert run("simplify", cloud, output, *ratio, "--keep-topology", "--quiet") == ""


def test_success_says_what_was_written(cloud, tmp_path, capsys):
    output = tmp_path / "o.ply"
    assert main(["simplify", str(cloud), str(output), "--count", "100"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "o.ply:"
    assert "-> 100 (" in lines[1]
    assert lines[2].endswith("of the diagonal)")
    assert main(["saliency", str(cloud), str(output), "--force"]) == 0
    assert "points, saliency as quality and colour" in capsys.readouterr().out
    mesh = demo.sample("bone.ply")
    assert main(["simplify", str(mesh), str(output), "--ratio", "0.5", "--points", "--force"]) == 0
    assert "faces" not in capsys.readouterr().out
