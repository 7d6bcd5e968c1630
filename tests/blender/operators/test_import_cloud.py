# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds come in as precise as their file has them, with colours and a fitting size of points."""

from pathlib import Path

import bpy
import laspy
import numpy as np
import pytest
import scenes
from models import model_path

ORIGIN = np.array([637_000.0, 850_000.0, 400.0])


def points_of(count=500):
    return ORIGIN + scenes.relief(count) * 0.1


def write(path, kind, points, extra=(), before=()):
    """Write a PLY file; `extra` are further properties: name, type and values."""
    types = {"double": "f8", "uchar": "u1", "float": "f4", "int": "i4", "ushort": "u2"}
    types["uint"] = "u4"
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


@pytest.mark.parametrize("name", ["no.ply", "no.las", "no.laz"])
def test_a_file_that_is_not_there(tmp_path, name):
    with pytest.raises(RuntimeError, match="No such file"):
        bpy.ops.import_scene.salient_cloud(filepath=str(tmp_path / name))


def test_a_file_of_another_kind(tmp_path):
    path = tmp_path / "a.e57"
    path.write_bytes(b"")
    with pytest.raises(RuntimeError, match=r"a\.e57: is none of \.ply, \.las, \.laz"):
        bpy.ops.import_scene.salient_cloud(filepath=str(path))


def test_lists_before_the_vertices_are_passed_over(tmp_path):
    before = ["element strip 2", "property list uchar int indices"]
    path = tmp_path / "a.ply"
    write(path, "binary_little_endian", points_of(), before=before)
    data = path.read_bytes()
    head = data.index(b"end_header\n") + len(b"end_header\n")
    path.write_bytes(data[:head] + b"\1" + bytes(4) + b"\2" + bytes(8) + data[head:])
    bpy.ops.import_scene.salient_cloud(filepath=str(path))
    obj = bpy.context.active_object
    assert np.abs(scenes.positions(obj) + obj["salient_offset"][:] - points_of()).max() < 1e-7


def write_las(path, points, kind=3, version="1.2", **dimensions):
    """Write a LAS or LAZ file with steps of a tenth of a millimetre; return its coordinates."""
    header = laspy.LasHeader(point_format=kind, version=version)
    header.scales, header.offsets = [1e-4] * 3, np.floor(points[0])
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    for name, values in dimensions.items():
        if name not in las.point_format.dimension_names:
            las.add_extra_dim(laspy.ExtraBytesParams(name, values.dtype))
        las[name] = values
    las.write(str(path))
    return np.column_stack([las.x, las.y, las.z])


def values_of(obj, name):
    return np.array([item.value for item in obj.data.attributes[name].data])


@pytest.mark.parametrize("ending", ["las", "laz"])
def test_scans_of_airborne_lidar(tmp_path, ending):
    rng = np.random.default_rng(2)
    rgb = rng.integers(0, 65536, (500, 3)).astype("u2")
    dimensions = {name: rgb[:, k] for k, name in enumerate(("red", "green", "blue"))}
    dimensions["intensity"] = np.arange(500, dtype="u2")
    dimensions["classification"] = (np.arange(500) % 7).astype("u1")
    dimensions["return_number"] = (np.arange(500) % 5).astype("u1")
    dimensions["gps_time"] = 3.1e8 + np.arange(500) / 1024
    dimensions["height"] = rng.normal(size=500).astype("f4")
    path = tmp_path / f"scan ünï.{ending}"
    points = write_las(path, points_of(), **dimensions)
    assert bpy.ops.import_scene.salient_cloud(filepath=str(path)) == {"FINISHED"}
    obj = bpy.context.active_object
    assert (obj.type, obj.name) == ("POINTCLOUD", "scan ünï")
    assert np.abs(scenes.positions(obj) + obj["salient_offset"][:] - points).max() < 1e-7
    found = np.array([item.color_srgb[:3] for item in obj.data.attributes["Col"].data])
    np.testing.assert_allclose(found, rgb / 65535.0, rtol=0, atol=0.5 / 255 + 1e-6)
    for name in ("intensity", "classification", "return_number", "height"):
        np.testing.assert_array_equal(values_of(obj, name), dimensions[name])
    times = values_of(obj, "gps_time").astype("f8") + obj["salient_offset_gps_time"]
    np.testing.assert_array_equal(times, dimensions["gps_time"])
    assert obj.data.attributes["classification"].data_type == "INT"
    assert "user_data" not in obj.data.attributes  # 0 everywhere
    assert obj.material_slots[0].material is not None
    assert values_of(obj, "radius").min() > 0.0


def test_colours_of_eight_bits_in_sixteen(tmp_path):
    rgb = np.random.default_rng(2).integers(0, 256, (500, 3)).astype("u2")
    colors = {name: rgb[:, k] for k, name in enumerate(("red", "green", "blue"))}
    write_las(tmp_path / "a.las", points_of(), 7, "1.4", **colors)
    bpy.ops.import_scene.salient_cloud(filepath=str(tmp_path / "a.las"))
    col = bpy.context.active_object.data.attributes["Col"]
    found = np.array([item.color_srgb[:3] for item in col.data])
    np.testing.assert_array_equal(np.rint(found * 255), rgb)


def test_wide_numbers_keep_their_values(tmp_path):
    """Of PLY files, whose numbers may be wider than Blender's."""
    extra = [
        ("stamp", "double", 1.7e9 + np.arange(500) / 64),
        ("number", "uint", np.arange(500) + 2**24),
        ("far", "uint", np.arange(500) + 2**31),
        ("small", "double", np.linspace(-1.0, 1.0, 500)),
    ]
    path = write(tmp_path / "a.ply", "binary_little_endian", points_of(), extra)
    bpy.ops.import_scene.salient_cloud(filepath=path)
    obj = bpy.context.active_object
    for name, _, values in extra[:3]:
        found = values_of(obj, name).astype("f8") + obj.get(f"salient_offset_{name}", 0.0)
        np.testing.assert_array_equal(found, values)
    np.testing.assert_array_equal(values_of(obj, "small"), extra[3][2].astype("f4"))
    assert "salient_offset_small" not in obj


@pytest.mark.parametrize("ending", ["las", "laz"])
@pytest.mark.parametrize("keep", [0, 3, 100, 300, 0.7])
def test_a_damaged_scan_is_one_sentence(tmp_path, ending, keep, extension):
    path = tmp_path / f"a.{ending}"
    write_las(path, points_of())
    data = path.read_bytes()
    path.write_bytes(data[: keep if isinstance(keep, int) else int(keep * len(data))])
    before = scenes.fingerprint(extension)
    with pytest.raises(RuntimeError, match=rf"a\.{ending}: is cut short or damaged") as caught:
        bpy.ops.import_scene.salient_cloud(filepath=str(path))
    assert "Traceback" not in str(caught.value)
    assert scenes.fingerprint(extension) == before


def test_a_library_that_is_not_there_is_named(module):
    libraries = module("geometry.libraries")
    with pytest.raises(module("geometry.read").HostError, match="need the library no_such_thing"):
        libraries.required("no_such_thing", Path("a.laz"))


def test_a_tile_of_a_real_scan():
    path = model_path("autzen_laz/autzen_00.laz")
    bpy.ops.import_scene.salient_cloud(filepath=str(path))
    obj = bpy.context.active_object
    las = laspy.read(path)
    assert len(obj.data.points) == las.header.point_count
    first = np.column_stack([las.x[:1000], las.y[:1000], las.z[:1000]])
    near = scenes.positions(obj)[:1000] + obj["salient_offset"][:]
    assert np.abs(near - first).max() < 1e-4 < 0.01  # the file's own step
    assert obj.data.attributes["Col"].data[0].color_srgb[0] > 0.0
