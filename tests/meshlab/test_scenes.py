# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of several parts, several files as one, and machines without MeshLab's library."""

import json
import os
import subprocess
import sys
from xml.etree import ElementTree

import laspy
import numpy as np
import pymeshlab
import pytest
from mesh_files import grid, rows, write_glb, write_ply
from plyfile import PlyData
from scan_files import MAP, make_las
from scipy.spatial.transform import Rotation
from shapes import bumpy, torus

import meshlab_filter
import salcore
from meshlab_filter.io import gltf, obj, ply
from meshlab_filter.io.projects import save_project

JPEG = b"\xff\xd8 as the camera wrote it"
PNG = b"\x89PNG as a program wrote it"


def turned(axis, angle, scale, move):
    """Return a node's place, as entries of the file and as a function of points."""
    turn = Rotation.from_euler(axis, angle, degrees=True)
    node = {"rotation": turn.as_quat().tolist(), "scale": [scale] * 3, "translation": move}
    return node, lambda points: turn.apply(points * scale) + move


@pytest.fixture
def scene(tmp_path):
    points, faces = torus(30, 15)
    placed, parts = [], []
    for number in range(3):
        node, place = turned("xyz"[number], 40.0 * number, 1.0 + number, [10.0 * number, 0.0, 1.0])
        parts.append({"points": points, "faces": faces, "node": {"name": f"ring {number}"} | node})
        placed.append(place(points.astype("f4").astype(float)))
    return write_glb(tmp_path / "in.glb", parts), placed, faces


def test_all_parts_of_a_scene_are_where_their_nodes_put_them(run, tmp_path, scene):
    path, placed, faces = scene
    layers = gltf.read(path)
    for layer, points in zip(layers, placed, strict=True):
        assert layer.points == pytest.approx(points, abs=1e-9)
        assert np.array_equal(layer.faces, faces)
    said = run("simplify", path, tmp_path / "o.obj", "--ratio", "0.3")
    assert "3 parts were merged" in said
    (light,) = obj.read(tmp_path / "o.obj")
    assert light.origin.groups == tuple((f"o ring {number}",) for number in range(3))
    whole = {tuple(p) for p in np.concatenate(placed).round(6)}
    assert {tuple(p) for p in light.points.round(6)} <= whole
    assert len(light.points) == round(0.3 * len(whole))
    counts = np.bincount(light.face_columns["group"])
    assert counts[2] > counts[0]  # the budget goes where the error is largest
    report = tmp_path / "errors.json"
    run("compare", path, tmp_path / "o.obj", "--report", report)
    errors = json.loads(report.read_text())
    assert 0.0 < errors["surface"]["mean"] < 0.1
    run("simplify", path, tmp_path / "one.ply", "--ratio", "1", "--layer", "ring 1")
    assert ply.read(tmp_path / "one.ply")[0].points == pytest.approx(placed[1], abs=1e-6)


def test_each_part_of_a_scene_on_its_own(run, tmp_path, scene):
    path, placed, _ = scene
    report = tmp_path / "report.json"
    arguments = ("--ratio", "0.5", "--layer", "each", "--report", report)
    run("simplify", path, tmp_path / "part_{}.ply", *arguments)
    for number in range(3):
        points = ply.read(tmp_path / f"part_{number}.ply")[0].points
        assert len(points) == 225
        whole = {tuple(p) for p in placed[number].round(6)}
        assert {tuple(p) for p in points.round(6)} <= whole
    assert list(json.loads(report.read_text())) == ["part_0.ply", "part_1.ply", "part_2.ply"]
    said = run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", "--layer", "each", status=2)
    assert "part_{}.ply" in said


@pytest.mark.parametrize("text", [False, True])
def test_images_inside_of_a_scene_stay_what_they_are(run, tmp_path, text):
    points, faces = grid(20)
    flat = {"faces": faces, "coords": points[:, :2]}
    heights = [points + np.array([0.0, 0.0, k]) for k in range(2)]
    parts = [flat | {"points": place, "material": k} for k, place in enumerate(heights)]
    materials = [
        {"name": name, "pbrMetallicRoughness": {"baseColorTexture": {"index": k}}}
        for k, name in enumerate(("stone", "moss"))
    ]
    images = [("image/jpeg", JPEG), ("image/png", PNG)]
    path = write_glb(tmp_path / f"in.{'gltf' if text else 'glb'}", parts, images=images,
                     materials=materials, text=text)  # fmt: skip
    for ending in ("ply", "obj"):
        (tmp_path / ending).mkdir()
        output = tmp_path / ending / f"o.{ending}"
        run("simplify", path, output, "--ratio", "0.3")
        assert (tmp_path / ending / "in_0.jpg").read_bytes() == JPEG
        assert (tmp_path / ending / "in_1.png").read_bytes() == PNG
        (layer,) = (obj if ending == "obj" else ply).read(output)
        place = layer.points[layer.faces]
        coords = layer.corners["texcoord"]
        assert coords[..., 0] == pytest.approx(place[..., 0], abs=1e-6)
        assert coords[..., 1] == pytest.approx(1.0 - place[..., 1], abs=1e-6)
        number = layer.face_columns["texnumber" if ending == "ply" else "material"]
        assert np.array_equal(number, place[:, 0, 2].round())
    assert PlyData.read(tmp_path / "ply" / "o.ply").comments == [
        "TextureFile in_0.jpg", "TextureFile in_1.png"
    ]  # fmt: skip
    library = (tmp_path / "obj" / "o.mtl").read_text()
    assert "newmtl stone\nKd 1 1 1\nmap_Kd in_0.jpg\n" in library


def test_colours_normals_and_mirrored_nodes(run, tmp_path):
    points, faces = torus(30, 15)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    colors = np.random.default_rng(0).integers(0, 256, points.shape).astype(np.uint8)
    part = {"points": points, "faces": faces, "normals": normals, "colors": colors,
            "node": {"scale": [-2.0, 1.0, 1.0]}}  # fmt: skip
    (layer,) = gltf.read(write_glb(tmp_path / "in.glb", [part]))
    assert np.array_equal(
        np.column_stack([layer.columns[k] for k in ("red", "green", "blue")]), colors
    )
    expected = normals * [-0.5, 1.0, 1.0]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert layer.normals is None  # those of a mesh come from its faces
    found = np.column_stack([layer.columns[k] for k in ("nx", "ny", "nz")])
    assert found == pytest.approx(expected, abs=1e-6)
    volumes = [
        np.linalg.det(place[triangles]).sum()
        for place, triangles in ((points, faces), (layer.points, layer.faces))
    ]
    assert volumes[1] == pytest.approx(2 * volumes[0], rel=1e-4)


def test_damaged_scenes_end_in_one_sentence(run, tmp_path):
    points, faces = torus(30, 15)
    part = {"points": points, "faces": faces}
    whole = write_glb(tmp_path / "whole.glb", [part]).read_bytes()
    (tmp_path / "whole.glb").unlink()

    def far(tree):
        tree["accessors"][0]["count"] = 10**9

    def ring(tree):
        tree["nodes"][0]["children"] = [0]

    def packed(tree):
        tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]

    (tmp_path / "in").mkdir()
    paths = [write_glb(tmp_path / "in" / f"{change.__name__}.glb", [part], change=change)
             for change in (far, ring, packed)]  # fmt: skip
    for number, share in enumerate((0.0, 0.001, 0.02, 0.5, 0.99)):
        paths.append(tmp_path / "in" / f"{number}.glb")
        paths[-1].write_bytes(whole[: int(share * len(whole))])
    for path in paths:
        said = run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", status=2)
        assert path.name in said
    assert "KHR_draco_mesh_compression" in run(
        "simplify", tmp_path / "in" / "packed.glb", tmp_path / "o.ply", "--ratio", "0.5", status=2
    )
    assert not (tmp_path / "o.ply").exists()


def test_several_files_are_one_cloud(run, tmp_path):
    (tmp_path / "scans").mkdir()
    for number in range(2):
        make_las(tmp_path / "scans" / f"{number}.laz", shift=[50.0 * number, 0.0, 0.0])
    files = [laspy.read(tmp_path / "scans" / f"{number}.laz") for number in range(2)]
    assert not np.array_equal(files[0].header.offsets, files[1].header.offsets)
    run("simplify", tmp_path / "scans" / "*.laz", tmp_path / "o.laz", "--ratio", "0.2")
    after = laspy.read(tmp_path / "o.laz")
    both = np.concatenate([file.xyz for file in files])
    kept = salcore.simplify(both, ratio=0.2).indices
    assert after.xyz == pytest.approx(both[kept], abs=1e-9)
    for name in ("gps_time", "intensity", "roughness", "classification"):
        expected = np.concatenate([np.asarray(file[name]) for file in files])[kept]
        assert np.array_equal(np.asarray(after[name]), expected)
    names = [tmp_path / "scans" / f"{number}.laz" for number in range(2)]
    run("simplify", *names, tmp_path / "o.ply", "--ratio", "0.2")
    table = PlyData.read(tmp_path / "o.ply")["vertex"].data
    assert np.array_equal(table["scan"], kept >= len(files[0].points))
    assert MAP[0] < table["x"].min()
    said = run("simplify", tmp_path / "none*.laz", tmp_path / "p.ply", "--ratio", "0.2", status=2)
    assert "no file matches this pattern" in said
    said = run("simplify", *names, names[0], "--ratio", "0.2", status=2)
    assert "is the input" in said


@pytest.mark.parametrize(
    ("ending", "remedy"),
    [("usd", "Blender"), ("blend", "Blender"), ("step", "CAD"), ("nonsense", ".ply"), ("", ".ply")],
)
def test_formats_that_nothing_reads_get_a_remedy(run, tmp_path, ending, remedy):
    path = tmp_path / (f"in.{ending}" if ending else "in")
    path.write_text("something")
    said = run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", status=2)
    assert "not read" in said
    assert remedy in said


def test_without_a_library_of_meshlab_the_command_works(tmp_path):
    """As on a server without OpenGL: pymeshlab is installed, and cannot be loaded."""
    (tmp_path / "pymeshlab").mkdir()
    (tmp_path / "pymeshlab" / "__init__.py").write_text(
        "raise ImportError('libGL.so.1: cannot open shared object file')"
    )
    root = os.path.dirname(os.path.dirname(meshlab_filter.__file__))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), root])}
    source = write_ply(tmp_path / "in.ply", rows(bumpy(), {}))

    def command(*arguments):
        return subprocess.run(
            [sys.executable, "-m", "meshlab_filter", *map(str, arguments)],
            env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip

    for ending in ("ply", "csv", "laz"):
        done = command("simplify", source, tmp_path / f"o.{ending}", "--ratio", "0.5")
        assert done.returncode == 0, done.stderr
        assert (tmp_path / f"o.{ending}").exists()
    done = command("simplify", source, tmp_path / "o.stl", "--ratio", "0.5", "--points")
    assert done.returncode == 2
    assert "apt install libgl1 libopengl0" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.fixture
def project(tmp_path):
    """A project of two rings, the second of which a matrix moves."""
    meshes = pymeshlab.MeshSet(verbose=False)
    for number in range(2):
        meshes.add_mesh(pymeshlab.Mesh(*torus(30, 15)), f"ring{number}")
    meshes.compute_matrix_from_translation(traslmethod=0, axisx=10.0)
    path = tmp_path / "in.mlp"
    save_project(meshes, path, force=True)
    return path


def test_all_layers_of_a_project_as_one(run, tmp_path, project):
    run("simplify", project, tmp_path / "o.ply", "--ratio", "0.5", "--layer", "all")
    places = ply.read(tmp_path / "o.ply")[0].points
    assert len(places) == 450
    points = torus(30, 15)[0].astype("f4").astype(float)
    both = {tuple(p) for p in np.concatenate([points, points + np.array([10.0, 0, 0])]).round(5)}
    assert {tuple(p) for p in places.round(5)} <= both


def test_the_light_layer_of_a_project_is_shown_and_its_source_hidden(run, tmp_path, project):
    output = tmp_path / "o.mlp"
    run("simplify", project, output, "--ratio", "0.5", "--layer", "ring1")
    shown = {
        mesh.get("label"): mesh.get("visible") for mesh in ElementTree.parse(output).iter("MLMesh")
    }
    assert shown == {"ring0": "1", "ring1": "0", "ring1 simplified": "1"}
    run("simplify", output, tmp_path / "p.mlp", "--ratio", "0.5", "--layer", "ring1 simplified")
    again = ElementTree.parse(tmp_path / "p.mlp").iter("MLMesh")
    assert [mesh.get("visible") for mesh in again] == ["1", "0", "0", "1"]
    run("saliency", project, tmp_path / "map.mlp", "--layer", "ring1")
    maps = ElementTree.parse(tmp_path / "map.mlp").iter("MLMesh")
    assert [mesh.get("visible") for mesh in maps] == ["1", "1"]
