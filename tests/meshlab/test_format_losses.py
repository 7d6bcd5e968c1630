# SPDX-License-Identifier: GPL-3.0-or-later
"""What formats do not hold is said, and what they hold is right; textures keep to themselves."""

import shutil

import numpy as np
import pymeshlab
import pytest
from shapes import torus

from meshlab_filter.cli import demo
from meshlab_filter.cli.command import main
from meshlab_filter.io import files
from meshlab_filter.io.projects import save_project


@pytest.fixture
def rich(tmp_path):
    """A mesh with colours and quality of points and faces, and a texture."""
    folder = tmp_path / "in"
    folder.mkdir()
    for name in ("bunny10k_textured.obj", "bunny10k_textured.mtl", "TextureDouble_A.png"):
        shutil.copy(demo.sample(name), folder / name)
    meshes = files.load(folder / "bunny10k_textured.obj")
    meshes.compute_color_by_function_per_vertex(x="255*(x>0)", y="10", z="99", a="255")
    meshes.compute_color_by_function_per_face(r="255*(x0>0)", g="10", b="99", a="255")
    meshes.compute_scalar_by_function_per_vertex(q="x")
    meshes.compute_scalar_by_function_per_face(q="x0")
    meshes.save_current_mesh(str(folder / "rich.ply"))
    return folder / "rich.ply"


LOST = {
    "ply": "",
    "obj": "quality, quality of faces",
    "off": "quality, quality of faces, texture coordinates, textures",
    "stl": "colours, quality, quality of faces, texture coordinates, textures",
    "wrl": "quality, colours of faces, quality of faces, texture coordinates, textures",
    "dae": "quality, colours of faces, quality of faces",
    "3ds": "colours, quality, colours of faces, quality of faces, texture coordinates, textures",
    "ctm": "colours, quality, colours of faces, quality of faces, texture coordinates, textures",
    "x3d": "quality, colours of faces, quality of faces, texture coordinates, textures",
}


@pytest.mark.parametrize("ending", LOST)
def test_what_a_format_does_not_keep_is_said(run, rich, tmp_path, ending):
    said = run("simplify", rich, tmp_path / f"o.{ending}", "--count", "500", "--free-seams")
    told = [line for line in said.splitlines() if "do not keep" in line]
    if not LOST[ending]:
        assert not told
        return
    assert told == [
        f"salient-simplify: {tmp_path}/o.{ending}: .{ending} files do not keep "
        f"{'' if ending == 'obj' else 'the '}{LOST[ending]}; .ply does"
    ]


def test_quiet_is_quiet(rich, tmp_path, capfd):
    for name in ("o.stl", "o.mlp"):
        assert not main(["simplify", str(rich), str(tmp_path / name), "--count=500", "--quiet"])
    project, other = (str(tmp_path / name) for name in ("o.mlp", "p.mlp"))
    assert not main(["simplify", project, other, "--count", "400", "--quiet"])
    assert capfd.readouterr() == ("", "")


def test_formats_that_cannot_be_read_back_are_told(run, tmp_path):
    said = run("simplify", demo.sample("bone.ply"), tmp_path / "o.dxf", "--ratio", "0.5")
    assert "MeshLab cannot read .dxf files, so what is in it was not checked" in said


def test_colours_and_normals_do_not_mix_in_off_files(run, tmp_path):
    """MeshLab reads them in an order other than the one it writes."""
    points, _ = torus(30, 15)
    colors = np.random.default_rng(0).integers(0, 256, (len(points), 4)) / 255
    colors[:, 3] = 1.0
    meshes = pymeshlab.MeshSet(verbose=False)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    meshes.add_mesh(pymeshlab.Mesh(points, v_normals_matrix=normals, v_color_matrix=colors))
    meshes.save_current_mesh(str(tmp_path / "in.ply"), save_vertex_normal=True)
    said = run("simplify", tmp_path / "in.ply", tmp_path / "o.off", "--ratio", "1")
    assert "do not keep the quality, normals; .ply does" in said
    mesh_set = files.load(tmp_path / "o.off")
    mesh = mesh_set.current_mesh()
    assert mesh.vertex_matrix() == pytest.approx(points)
    assert mesh.vertex_color_matrix() == pytest.approx(colors)


def textured_square(folder, texture, value):
    from matplotlib.image import imsave

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / texture
    path.parent.mkdir(parents=True, exist_ok=True)
    imsave(path, np.full((8, 8, 3), value))
    mesh = folder / "square.obj"
    (folder / "square.mtl").write_text(f"newmtl skin\nmap_Kd {texture}\n")
    grid = [(x, y) for y in range(9) for x in range(9)]
    quads = [(9 * y + x + 1, 9 * y + x + 2, 9 * y + x + 11, 9 * y + x + 10)
             for y in range(8) for x in range(8)]  # fmt: skip
    mesh.write_text(
        "mtllib square.mtl\nusemtl skin\n"
        + "".join(f"v {x} {y} {x * y % 3}\nvt {x / 8} {y / 8}\n" for x, y in grid)
        + "".join(f"f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}\n" for a, b, c, d in quads)
    )
    return mesh


def shade(mesh, folder):
    """Return the grey of a mesh's only texture."""
    from matplotlib.image import imread

    (image,) = mesh.textures().values()
    image.save(str(folder / "texture.png"))
    return round(float(imread(folder / "texture.png")[..., :3].mean()), 1)


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")])
def test_textures_of_one_name_stay_apart_in_projects(run, tmp_path, order):
    grey = {"a": 0.2, "b": 0.8}
    meshes = pymeshlab.MeshSet(verbose=False)
    homes = {"a": tmp_path / "scene", "b": tmp_path / "scene" / "sub"}
    for name in order:  # the texture of `a` lies where the project will be
        meshes.load_new_mesh(str(textured_square(homes[name], "skin.png", grey[name])))
        meshes.current_mesh().set_label(name)
    meshes.save_project(str(tmp_path / "scene" / "scene.mlp"))
    before = (tmp_path / "scene" / "skin.png").read_bytes()
    (tmp_path / "elsewhere").mkdir()
    for output in (tmp_path / "elsewhere" / "o.mlp", tmp_path / "scene" / "o.mlp"):
        source = tmp_path / "scene" / "scene.mlp"
        run("simplify", source, output, "--layer", order[1], "--ratio", "0.5")
        again = files.load(output)
        for mesh, name in zip(again, (*order, order[1]), strict=True):
            assert shade(mesh, tmp_path) == grey[name]
    assert (tmp_path / "scene" / "skin.png").read_bytes() == before


@pytest.mark.parametrize("ending", ["obj", "ply", "mlp"])
def test_textures_are_written_inside_the_outputs_folder_only(run, tmp_path, ending):
    """A texture's name can point anywhere: here to a file beside the output's folder."""
    source = textured_square(tmp_path / "in", "../precious/skin.png", 0.2)
    (tmp_path / "out" / "sub").mkdir(parents=True)
    (tmp_path / "out" / "precious").mkdir()
    (tmp_path / "out" / "precious" / "skin.png").write_text("precious")
    before = (tmp_path / "precious" / "skin.png").read_bytes()
    for command in (["saliency"], ["simplify", "--ratio", "0.5", "--force"]):
        name, *rest = command
        output = tmp_path / "out" / "sub" / f"o.{ending}"
        run(name, source, output, *rest)
        mesh_set = files.load(output)
        assert shade(mesh_set.current_mesh(), tmp_path) == 0.2
    assert (tmp_path / "out" / "precious" / "skin.png").read_text() == "precious"
    assert (tmp_path / "precious" / "skin.png").read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {"in", "out", "precious", "texture.png"}


def test_several_textures_are_kept_or_left_out_with_a_word(run, tmp_path):
    source = textured_square(tmp_path / "in", "one.png", 0.2)
    textured_square(tmp_path / "other", "two.png", 0.8)
    shutil.copy(tmp_path / "other" / "two.png", tmp_path / "in" / "two.png")
    material = source.with_suffix(".mtl")
    material.write_text(material.read_text() + "newmtl second\nmap_Kd two.png\n")
    lines = source.read_text().splitlines()
    source.write_text("\n".join([*lines[:-20], "usemtl second", *lines[-20:]]))
    said = run("simplify", source, tmp_path / "o.x3d", "--ratio", "0.5")
    assert "its 2 textures are left out" in said
    for name in ("o.ply", "o.obj"):
        said = run("simplify", source, tmp_path / name, "--ratio", "0.5", "--force")
        assert ("names of materials" in said) == (name == "o.ply")
        mesh_set = files.load(tmp_path / name)
        assert mesh_set.current_mesh().texture_number() == 2
    run("saliency", source, tmp_path / "map.ply", "--force")
    mesh_set = files.load(tmp_path / "map.ply")
    assert mesh_set.current_mesh().texture_number() == 2


def test_compare_chooses_layers(run, tmp_path, capsys):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(*torus(30, 15)), "large")
    meshes.add_mesh(pymeshlab.Mesh(0.5 * torus(30, 15)[0], torus(30, 15)[1]), "small")
    scene = tmp_path / "scene.mlp"
    save_project(meshes, scene, force=True)
    pairs = (("large", "large", True), ("0", "1", False), ("small", "1", True))
    for original, simplified, same in pairs:
        arguments = ("--original-layer", original, "--simplified-layer", simplified)
        report = tmp_path / "errors.json"
        run("compare", scene, scene, *arguments, "--report", report, "--force")
        assert ('"max": 0.0' in report.read_text().split("mean")[0]) == same
    assert "choose another with --simplified-layer" in run("compare", scene, scene)
    said = run("compare", scene, scene, "--original-layer", "none", status=2)
    assert "layer 'none': there is none" in said
