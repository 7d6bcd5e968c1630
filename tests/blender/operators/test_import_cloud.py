# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds come in as precise as their file has them, with colours and a fitting size of points."""

import bpy
import numpy as np
import pytest
import scenes

ORIGIN = np.array([637_000.0, 850_000.0, 400.0])


def points_of(count=500):
    return ORIGIN + scenes.relief(count) * 0.1


def write(path, kind, points, extra=(), before=()):
    """Write a PLY file; `extra` are further properties: name, type and values."""
    types = {"double": "f8", "uchar": "u1", "float": "f4", "int": "i4", "ushort": "u2"}
    columns = [(axis, "double", points[:, k]) for k, axis in enumerate("xyz")] + list(extra)
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}.get(kind, "<")
    rows = np.empty(len(points), dtype=[(n, order + types[t]) for n, t, _ in columns])
    for name, _, values in columns:
        rows[name] = values
    header = ["ply", f"format {kind} 1.0", "comment made by a test", *before]
    header += [f"element vertex {len(points)}", *(f"property {t} {n}" for n, t, _ in columns)]
    header += ["element face 0", "property list uchar int vertex_indices", "end_header", ""]
    data = rows.tobytes()
    if kind == "ascii":
        data = "".join(" ".join(repr(v) for v in row) + "\n" for row in rows.tolist()).encode()
    path.write_bytes("\n".join(header).encode() + data)
    return str(path)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_coordinates_are_as_precise_as_in_the_file(tmp_path, kind):
    points = points_of()
    path = write(tmp_path / "scan ünï.ply", kind, points)
    assert bpy.ops.import_scene.salient_cloud(filepath=path) == {"FINISHED"}
    obj = bpy.context.active_object
    assert (obj.type, obj.name, obj.select_get()) == ("POINTCLOUD", "scan ünï", True)
    offset = np.array(obj["salient_offset"][:])
    assert (offset == np.rint(offset)).all()
    np.testing.assert_allclose(scenes.positions(obj) + offset, points, rtol=0, atol=1e-7)
    tree = np.linalg.norm(points[:, None] - points[None], axis=2) + 1e9 * np.eye(len(points))
    radius = np.array([item.value for item in obj.data.attributes["radius"].data])
    np.testing.assert_allclose(radius, 0.5 * tree.min(axis=1).mean(), rtol=1e-3)
    bpy.ops.object.salient_simplify(ratio=0.2)  # and it is simplified like any cloud
    result = bpy.data.objects["scan ünï_simplified"]
    assert len(result.data.points) == 100
    assert result["salient_offset"][:] == obj["salient_offset"][:]


def test_colours_normals_and_other_properties(tmp_path):
    points, rng = points_of(), np.random.default_rng(1)
    rgb = rng.integers(0, 256, (500, 3))
    normals = rng.normal(size=(500, 3)).astype("f4")
    extra = [(name, "uchar", rgb[:, k]) for k, name in enumerate(("red", "green", "blue"))]
    extra += [(name, "float", normals[:, k]) for k, name in enumerate(("nx", "ny", "nz"))]
    extra += [("intensity", "ushort", np.arange(500)), ("time", "double", np.arange(500) / 8)]
    path = write(tmp_path / "a.ply", "binary_little_endian", points, extra)
    bpy.ops.import_scene.salient_cloud(filepath=path)
    obj = bpy.context.active_object
    found = np.array([item.color_srgb[:3] for item in obj.data.attributes["Col"].data])
    np.testing.assert_array_equal(np.rint(found * 255), rgb)
    stored = np.array([item.vector[:] for item in obj.data.attributes["normal"].data])
    np.testing.assert_array_equal(stored.astype("f4"), normals)
    assert [item.value for item in obj.data.attributes["intensity"].data] == list(range(500))
    assert obj.data.attributes["time"].data[9].value == 1.125
    nodes = obj.material_slots[0].material.node_tree.nodes
    assert {n.attribute_name for n in nodes if n.type == "ATTRIBUTE"} == {"Col"}


def test_elements_before_the_vertices_are_passed_over(tmp_path):
    before = ["element camera 1", "property float view", "property uchar on"]
    path = tmp_path / "a.ply"
    write(path, "binary_little_endian", points_of(), before=before)
    data = path.read_bytes()
    head = data.index(b"end_header\n") + len(b"end_header\n")
    path.write_bytes(data[:head] + b"\0\0\0\0\1" + data[head:])
    bpy.ops.import_scene.salient_cloud(filepath=str(path))
    obj = bpy.context.active_object
    assert np.abs(scenes.positions(obj) + obj["salient_offset"][:] - points_of()).max() < 1e-7


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("keep", [0, 3, 40, 200, 3000])
def test_a_damaged_file_is_one_sentence(tmp_path, kind, keep, extension):
    path = tmp_path / "a.ply"
    write(path, kind, points_of())
    path.write_bytes(path.read_bytes()[:keep])
    before = scenes.fingerprint(extension)
    with pytest.raises(RuntimeError, match=r"a\.ply: .*give a PLY file of points") as caught:
        bpy.ops.import_scene.salient_cloud(filepath=str(path))
    assert "Traceback" not in str(caught.value)
    assert scenes.fingerprint(extension) == before


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(RuntimeError, match="No such file"):
        bpy.ops.import_scene.salient_cloud(filepath=str(tmp_path / "no.ply"))
