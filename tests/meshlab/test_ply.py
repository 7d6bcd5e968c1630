# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY files keep every property of what is kept, bit for bit, in its own type."""

import numpy as np
import pytest
from mesh_files import rows, write_ply
from plyfile import PlyData, PlyElement
from shapes import bumpy, torus

import salcore

TYPES = {"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint",
         "f4": "float", "f8": "double"}  # fmt: skip


def random_columns(count, prefix=""):
    """Return a column of every type that PLY files have, with values over the type's range."""
    rng = np.random.default_rng(5)
    columns = {}
    for code in TYPES:
        dtype = np.dtype(code)
        if dtype.kind == "f":
            values = rng.normal(size=count) * 1e6
        else:
            bounds = np.iinfo(dtype)
            values = rng.integers(bounds.min, bounds.max, count, endpoint=True, dtype=dtype)
        columns[f"{prefix}{TYPES[code]}_value"] = values.astype(dtype)
    return columns


@pytest.mark.parametrize(("text", "order"), [(False, "<"), (False, ">"), (True, "=")])
def test_every_type_of_property_travels_with_a_clouds_points(run, tmp_path, text, order):
    points = bumpy()
    table = rows(points, random_columns(len(points)))
    source = write_ply(tmp_path / "in.ply", table, text=text, order=order)
    before = PlyData.read(source)["vertex"].data
    assert run("simplify", source, tmp_path / "o.ply", "--ratio", "0.3") == ""
    after = PlyData.read(tmp_path / "o.ply")["vertex"].data
    kept = salcore.simplify(np.column_stack([before[k] for k in "xyz"]), ratio=0.3).indices
    assert after.dtype.names == before.dtype.names
    for name in before.dtype.names:
        assert after[name].dtype == before[name].dtype.newbyteorder("=")
        assert np.array_equal(after[name], before[name][kept]), name


def test_single_precision_stays_single(run, tmp_path):
    source = write_ply(tmp_path / "in.ply", rows(bumpy(), {}, "f4"))
    run("simplify", source, tmp_path / "o.ply", "--ratio", "0.3")
    assert PlyData.read(tmp_path / "o.ply")["vertex"].data.dtype["x"] == np.float32


@pytest.mark.parametrize("text", [False, True])
def test_values_of_faces_and_corners_travel(run, tmp_path, text):
    points, faces = torus(30, 15)
    coords = points[faces][:, :, :2].reshape(len(faces), 6)
    camera = np.array([(7, 0.5)], [("view", "i4"), ("scale", "f4")])
    source = write_ply(
        tmp_path / "in.ply", rows(points, random_columns(len(points))), faces, text=text,
        texcoord=coords, comments=["TextureFile skin.jpg", "made by a test"],
        more=[PlyElement.describe(camera, "camera")],
    )  # fmt: skip
    (tmp_path / "skin.jpg").write_bytes(b"any image, for nobody decodes it")
    (tmp_path / "out").mkdir()
    assert run("simplify", source, tmp_path / "out" / "o.ply", "--ratio", "0.5") == ""
    data = PlyData.read(tmp_path / "out" / "o.ply")
    assert "TextureFile skin.jpg" in data.comments
    assert "made by a test" in data.comments
    assert (tmp_path / "out" / "skin.jpg").read_bytes() == (tmp_path / "skin.jpg").read_bytes()
    assert data["camera"].data.tolist() == [(7, 0.5)]
    vertices, triangles = data["vertex"].data, np.stack(data["face"].data["vertex_indices"])
    found = np.column_stack([vertices[k] for k in "xyz"])
    assert len(found) == len(points) // 2
    assert np.stack(data["face"].data["texcoord"]).reshape(-1, 3, 2) == pytest.approx(
        found[triangles][:, :, :2], abs=1e-6
    )
    assert len(faces) > len(triangles) > 100


def test_polygons_are_cut_inside_and_that_is_said(run, tmp_path):
    """The second quad is not convex: one of its diagonals lies outside."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [1.2, 0.2, 0]], float)
    faces = [[0, 1, 2, 3], [2, 1, 4, 5]]
    source = write_ply(tmp_path / "in.ply", rows(points, {}), faces)
    said = run("simplify", source, tmp_path / "o.ply", "--ratio", "1")
    assert "2 of 2 faces are no triangles and were cut into triangles, which makes 4" in said
    data = PlyData.read(tmp_path / "o.ply")
    found = np.column_stack([data["vertex"].data[k] for k in "xyz"])
    triangles = np.stack(data["face"].data["vertex_indices"])
    corners = found[triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    x, y = points[[2, 1, 4, 5], :2].T
    area = 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))
    assert np.abs(areas).sum() == pytest.approx(1.0 + abs(area))


def test_elements_that_number_points_are_left_out_with_a_word(run, tmp_path):
    edges = np.array([(0, 1), (1, 2)], [("vertex1", "i4"), ("vertex2", "i4")])
    more = [PlyElement.describe(edges, "edge")]
    source = write_ply(tmp_path / "in.ply", rows(bumpy(), {}), more=more)
    said = run("simplify", source, tmp_path / "o.ply", "--ratio", "0.5")
    assert "left out: 2 edge" in said
    assert [e.name for e in PlyData.read(tmp_path / "o.ply").elements] == ["vertex"]


def header(*lines):
    return "\n".join(["ply", *lines, "end_header", ""]).encode()


HOSTILE = {
    "header only": header("format binary_little_endian 1.0", "element vertex 9",
                          *(f"property float {k}" for k in "xyz")),
    "no count": header("format ascii 1.0", "element vertex", "property float x"),
    "a word for a count": header("format ascii 1.0", "element vertex many", "property float x"),
    "an unknown type": header("format ascii 1.0", "element vertex 1", "property quad x"),
    "no end": b"ply\nformat ascii 1.0\nelement vertex 1\n",
    "a billion points": header("format binary_little_endian 1.0", "element vertex 1000000000",
                               *(f"property float {k}" for k in "xyz")) + bytes(1200),
    "a billion points as text": header("format ascii 1.0", "element vertex 1000000000",
                                       *(f"property float {k}" for k in "xyz")) + b"1 2 3\n",
    "text for numbers": header("format ascii 1.0", "element vertex 2",
                               *(f"property float {k}" for k in "xyz")) + b"1 2 x\n1 2 3\n",
    "too few columns": header("format ascii 1.0", "element vertex 2",
                              *(f"property float {k}" for k in "xyz")) + b"1 2\n1 2 3\n",
    "a face out of range": header("format ascii 1.0", "element vertex 3",
                                  *(f"property float {k}" for k in "xyz"), "element face 1",
                                  "property list uchar int vertex_indices")
    + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n",
    "a list that never ends": header("format binary_little_endian 1.0", "element vertex 1",
                                     *(f"property float {k}" for k in "xyz"), "element face 1",
                                     "property list uint int vertex_indices")
    + bytes(12) + b"\xff\xff\xff\x7f" + bytes(12),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_damaged_files_end_in_one_sentence(run, tmp_path, kind):
    (tmp_path / "in.ply").write_bytes(HOSTILE[kind])
    said = run("simplify", tmp_path / "in.ply", tmp_path / "o.ply", "--ratio", "0.5", status=2)
    assert "in.ply" in said
    assert [path.name for path in tmp_path.iterdir()] == ["in.ply"]


def test_points_without_coordinates_are_told(run, tmp_path):
    points = bumpy()
    points[::7] = np.nan
    source = write_ply(tmp_path / "in.ply", rows(points, random_columns(len(points))))
    said = run("simplify", source, tmp_path / "o.ply", "--ratio", "0.5")
    assert f"{len(points[::7])} of {len(points)} points have no valid coordinates" in said
    after = PlyData.read(tmp_path / "o.ply")["vertex"].data
    assert np.isfinite(after["x"]).all()
