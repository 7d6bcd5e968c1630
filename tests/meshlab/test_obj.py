# SPDX-License-Identifier: GPL-3.0-or-later
"""OBJ files keep what their corners say: materials, hard edges, charts, groups and libraries."""

import numpy as np
import pytest
from mesh_files import grid, write_obj
from plyfile import PlyData
from shapes import torus

from meshlab_filter.io import mtl, obj


@pytest.fixture
def two_materials(tmp_path):
    """A square whose upper part is of another material, along a wave, each with its image."""
    points, faces = grid(40)
    upper = points[faces].mean(axis=1)[:, 1] > 0.5 + 0.2 * np.sin(
        9 * points[faces].mean(axis=1)[:, 0]
    )
    faces = np.concatenate([faces[upper], faces[~upper]])
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "scene.mtl").write_text(
        "# what an exporter wrote\n"
        "newmtl red paint\nKd 1 0 0\nNs 250\nmap_Kd -s 2 2 1 red skin.jpg\n"
        "newmtl blue\nKd 0 0 1\nmap_Kd blue.png\nmap_Bump -bm 0.5 sub\\bump.png\n"
    )
    for name in ("red skin.jpg", "blue.png"):
        (tmp_path / "in" / name).write_bytes(name.encode())
    (tmp_path / "in" / "sub").mkdir()
    (tmp_path / "in" / "sub" / "bump.png").write_bytes(b"bump")
    return write_obj(
        tmp_path / "in" / "square.obj", points, faces, coords=(points[:, :2], faces),
        head=["mtllib scene.mtl"],
        lines=[(0, ["o upper", "usemtl red paint"]), (upper.sum(), ["o lower", "usemtl blue"])],
    )  # fmt: skip


def wrong_area(layer):
    """Return the share of the area in the wrong material, at middles of cells."""
    corners = layer.points[layer.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                          axis=1)  # fmt: skip
    rng = np.random.default_rng(0)
    face = rng.choice(len(area), 50_000, p=area / area.sum())
    place = (corners[face] * rng.dirichlet((1, 1, 1), len(face))[:, :, None]).sum(axis=1)
    cell = np.floor(40 * place[:, :2]) / 40
    centre = np.where(place[:, 0] - cell[:, 0] > place[:, 1] - cell[:, 1], 2, 1) / 120
    other = 3 / 120 - centre
    middle = cell + np.column_stack([centre, other])
    upper = middle[:, 1] > 0.5 + 0.2 * np.sin(9 * middle[:, 0])
    names = np.array([m.name for m in layer.materials])
    return float((upper != (names == "red paint")[layer.face_columns["material"]][face]).mean())


@pytest.mark.parametrize("ratio", ["0.5", "0.1"])
def test_materials_keep_their_borders_libraries_and_images(run, tmp_path, two_materials, ratio):
    (tmp_path / "out").mkdir()
    output = tmp_path / "out" / "light.obj"
    assert wrong_area(obj.read(two_materials)[0]) == 0.0
    assert run("simplify", two_materials, output, "--ratio", ratio) == ""
    (layer,) = obj.read(output)
    assert wrong_area(layer) < 0.01
    assert layer.corners["texcoord"][:, :, :2] == pytest.approx(layer.points[layer.faces][..., :2])
    library = (tmp_path / "out" / "light.mtl").read_text()
    assert library == (tmp_path / "in" / "scene.mtl").read_text().replace("sub\\bump", "sub/bump")
    for name in ("red skin.jpg", "blue.png", "sub/bump.png"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "in" / name).read_bytes()
    groups = [state for state in layer.origin.groups if state]
    assert groups == [("o upper",), ("o lower",)]


def test_materials_become_several_textures_of_a_ply_file(run, tmp_path, two_materials):
    (tmp_path / "out").mkdir()
    run("simplify", two_materials, tmp_path / "out" / "light.ply", "--ratio", "0.2")
    data = PlyData.read(tmp_path / "out" / "light.ply")
    assert [c for c in data.comments if c.startswith("TextureFile")] == [
        "TextureFile red skin.jpg", "TextureFile blue.png"
    ]  # fmt: skip
    faces = data["face"].data
    assert np.array_equal(faces["texnumber"], faces["material"])
    assert set(faces["texnumber"]) == {0, 1}
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "blue.png", "light.ply", "red skin.jpg"
    ]  # fmt: skip
    run("simplify", tmp_path / "out" / "light.ply", tmp_path / "out" / "p.obj", "--ratio", "1")
    (layer,) = obj.read(tmp_path / "out" / "p.obj")
    assert [material.texture for material in layer.materials] == ["red skin.jpg", "blue.png"]


def test_a_missing_image_or_library_is_said(run, tmp_path, two_materials):
    (tmp_path / "in" / "blue.png").unlink()
    (tmp_path / "out").mkdir()
    said = run("simplify", two_materials, tmp_path / "out" / "o.obj", "--ratio", "0.5")
    assert "its texture blue.png is missing" in said
    said = run("simplify", two_materials, tmp_path / "out" / "o.mlp", "--ratio", "0.5")
    assert "an image of its textures is missing" in said
    (tmp_path / "in" / "scene.mtl").unlink()
    said = run("simplify", two_materials, tmp_path / "out" / "p.obj", "--ratio", "0.5")
    assert "its material library scene.mtl is missing" in said


def block(n):
    """Return a cube of n by n cells a side, and the axis of every face."""
    points, faces, axes = [], [], []
    square, cells = grid(n)
    for axis in range(3):
        for end in (0.0, 1.0):
            side = np.roll(
                np.column_stack([square[:, :2], np.full(len(square), end)]), axis, axis=1
            )
            turned = cells if end else cells[:, ::-1]
            faces.append(turned + sum(map(len, points)))
            points.append(side)
            axes += [np.eye(3)[(axis + 2) % 3] * (2 * end - 1)] * len(cells)
    unique, number = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    return unique, number.reshape(-1)[np.concatenate(faces)], np.array(axes)


def steepest(points, faces, normals):
    """Return the largest angle, in degrees, between a face and the normals of its corners."""
    p = points[faces]
    across = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.clip(np.einsum("fc,fkc->fk", across, normals), -1, 1))).max()


@pytest.mark.parametrize("ratio", ["0.5", "0.1"])
def test_hard_edges_keep_the_normals_of_their_corners(run, tmp_path, ratio):
    points, faces, axes = block(16)
    rows = np.repeat(np.arange(len(faces))[:, None], 3, axis=1)
    source = write_obj(tmp_path / "in.obj", points, faces, normals=(axes, rows))
    assert steepest(points, faces, axes[rows]) == pytest.approx(0.0)
    assert run("simplify", source, tmp_path / "o.obj", "--ratio", ratio) == ""
    (layer,) = obj.read(tmp_path / "o.obj")
    assert len(layer.faces) < float(ratio) * 1.2 * len(faces)
    assert steepest(layer.points, layer.faces, layer.corners["normal"]) < 20.0
    said = run("simplify", source, tmp_path / "o.ply", "--ratio", ratio)
    assert ".ply files do not keep normals of corners; .obj does" in said


def test_smooth_normals_become_those_of_points_in_a_ply_file(run, tmp_path):
    points, faces = torus(30, 15)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    source = write_obj(tmp_path / "in.obj", points, faces, normals=(normals, faces))
    assert run("simplify", source, tmp_path / "o.ply", "--ratio", "0.5") == ""
    table = PlyData.read(tmp_path / "o.ply")["vertex"].data
    found = np.column_stack([table[k] for k in ("nx", "ny", "nz")])
    place = np.column_stack([table[k] for k in "xyz"])
    assert found == pytest.approx(place / np.linalg.norm(place, axis=1, keepdims=True))


def test_spellings(tmp_path):
    (tmp_path / "in.obj").write_text(
        "# comment\n\ng first\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0 # inline\nv 1 1 0 0 0 1\r\n"
        "v\t0 1 0 1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n  f -4/1/1 -3/2/1 \\\n -2/3/1 # one\n"
        "g second\nf 1//1 3//1 4//-1\nl 1 2\n"
    )
    said = []
    (layer,) = obj.read(tmp_path / "in.obj", said.append)
    assert layer.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert layer.columns["green"].tolist() == [0, 1, 0, 1]
    assert layer.corners["texcoord"].tolist() == [[[0, 0], [1, 0], [1, 1]], [[0, 0]] * 3]
    assert layer.corners["normal"].tolist() == [[[0, 0, 1]] * 3] * 2
    assert [layer.origin.groups[k] for k in layer.face_columns["group"]] == [
        ("g first",), ("g second",)
    ]  # fmt: skip
    assert "1 of 'l'" in said[0]


def test_polygons_are_cut_and_that_is_said(run, tmp_path):
    points, _ = grid(12)
    q = np.arange(169).reshape(13, 13)
    quads = np.stack([q[:-1, :-1], q[1:, :-1], q[1:, 1:], q[:-1, 1:]], axis=-1).reshape(-1, 4) + 1
    (tmp_path / "in.obj").write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in points)
        + "".join(f"f {a} {b} {c} {d}\n" for a, b, c, d in quads)
    )
    said = run("simplify", tmp_path / "in.obj", tmp_path / "o.obj", "--ratio", "0.5")
    assert "144 of 144 faces are no triangles and were cut into triangles, which makes 288" in said


HOSTILE = {
    "empty": b"# nothing\n",
    "a face alone": b"f 1 2 3\n",
    "out of range": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "zero": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
    "before the first": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 1 2\n",
    "no coordinates there": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n",
    "two coordinates": b"v 0 0\nv 1 0\n",
    "words": b"v a b c\n",
    "words in faces": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n",
    "cut short": b"v 0 0 0\nv 1 0 0\nv 0 1",
    "binary": bytes(200),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_damaged_files_end_in_one_sentence(run, tmp_path, kind):
    (tmp_path / "in.obj").write_bytes(HOSTILE[kind])
    said = run("simplify", tmp_path / "in.obj", tmp_path / "o.obj", "--ratio", "0.5", status=2)
    assert "in.obj" in said
    assert [path.name for path in tmp_path.iterdir()] == ["in.obj"]


def test_options_of_images():
    lines = {
        "map_Kd plain.png": "plain.png",
        "map_Kd a name with blanks.jpg": "a name with blanks.jpg",
        "map_Kd -s 1 1 1 -o 0.5 0 0 image.png": "image.png",
        "map_Kd -s 2 image.png": "image.png",
        "map_Bump -bm 1.5 -clamp on deep/er\\bump.png": "deep/er\\bump.png",
        "\tdisp -type sphere x.png": "x.png",
    }
    for line, name in lines.items():
        assert list(mtl.images(line)) == [name]
        renamed = mtl.rename_images(line, {name: "new.png"})
        assert renamed == line.replace(name, "new.png") + "\n"
