# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as people have them, through the command and the filters: split vertices, tiles, parts."""

import json

import numpy as np
import pymeshlab
import pytest
from mesh_files import grid, rows, write_obj, write_ply
from shapes import bumpy, torus

import meshlab_filter as mf
import salcore
from meshlab_filter.io import obj, ply


def split_torus(n):
    """Return a torus whose vertices are split along the seams of its texture, and that texture."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    u, v = (i / n).ravel(), (j / n).ravel()
    a, b = 2 * np.pi * (i.ravel() % n) / n, 2 * np.pi * (j.ravel() % n) / n
    points = np.column_stack([(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a),
                              np.sin(b) + 0.15 * np.sin(9 * a) * np.cos(5 * b)])  # fmt: skip
    return points, grid(n)[1], np.column_stack([u, v])


def torn(points, faces, coords):
    """Return the share of the area whose texture spans more than half of the square."""
    corners = points[faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return area[np.ptp(coords, axis=1).max(axis=1) > 0.5].sum() / area.sum()


def read_ply(path):
    (layer,) = ply.read(path)
    return layer, layer.points, layer.faces


@pytest.mark.parametrize("ratio", ["0.5", "0.1", "0.02"])
def test_split_vertices_keep_their_charts_and_stay_split(run, tmp_path, ratio):
    points, faces, coords = split_torus(60)
    columns = {"s": coords[:, 0], "t": coords[:, 1]}
    source = write_ply(tmp_path / "in.ply", rows(points, columns), faces)
    run("simplify", source, tmp_path / "o.ply", "--ratio", ratio)
    layer, places, light = read_ply(tmp_path / "o.ply")
    found = np.column_stack([layer.columns["s"], layer.columns["t"]])
    shared = write_obj(tmp_path / "in.obj", points, faces, coords=(coords, faces))
    text = shared.read_text().splitlines()
    unique, number = np.unique(points, axis=0, return_inverse=True)
    write_obj(shared, unique, number.reshape(-1)[faces], coords=(coords, faces))
    assert len(shared.read_text().splitlines()) < len(text)
    run("simplify", shared, tmp_path / "o.obj", "--ratio", ratio)
    (other,) = obj.read(tmp_path / "o.obj")
    reference = torn(other.points, other.faces, other.corners["texcoord"])
    assert torn(places, light, found[light]) <= reference + 0.001
    count = round(float(ratio) * 60 * 60)
    assert len(np.unique(places, axis=0)) == count
    assert np.array_equal(np.unique(light), np.arange(len(places)))  # no copy is loose


def test_neighbouring_tiles_meet_where_the_border_is_kept(run, tmp_path):
    points, faces = grid(30)
    points[:, 2] = 0.05 * np.sin(9 * points[:, 0]) * np.cos(7 * points[:, 1])
    edges = []
    for shift in (0.0, 1.0):
        source = write_ply(
            tmp_path / f"{shift}.ply", rows(points + np.array([shift, 0.0, 0.0]), {}), faces
        )
        run("simplify", source, tmp_path / f"o{shift}.ply", "--ratio", "0.3", "--keep-border")
        _, places, _ = read_ply(tmp_path / f"o{shift}.ply")
        edges.append({tuple(p) for p in places if p[0] == 1.0})
    assert len(edges[0]) == 31
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(tmp_path / "0.0.ply"))
    mf.apply(meshes, "meshing_decimation_by_saliency", ratio=0.3, keepborder=True)
    kept = {tuple(p) for p in meshes.current_mesh().vertex_matrix()}
    assert {tuple(p) for p in points if 0.0 in p[:2] or 1.0 in p[:2]} <= kept


def test_a_symmetrical_mesh_stays_so_or_is_refused(run, tmp_path):
    points, faces = torus(60, 30)
    source = write_ply(tmp_path / "in.ply", rows(points, {}), faces)
    run("simplify", source, tmp_path / "o.ply", "--ratio", "0.1", "--symmetry", "y")
    _, places, _ = read_ply(tmp_path / "o.ply")
    image = np.round(places * [1, -1, 1], 4) + 0.0
    assert {*map(tuple, image)} == {*map(tuple, np.round(places, 4) + 0.0)}
    crooked = write_ply(tmp_path / "b.ply", rows(points + np.array([0.0, 0.3, 0.0]), {}), faces)
    arguments = ["simplify", str(crooked), str(tmp_path / "c.ply"), "--ratio", "0.1"]
    said = run(*arguments, "--symmetry", "y", status=2)
    assert "of 1,800 points have no twin" in said
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(source))
    mf.apply(meshes, "meshing_decimation_by_saliency", ratio=0.1, symmetry="y")
    found = np.round(meshes.current_mesh().vertex_matrix(), 4) + 0.0
    assert {*map(tuple, found)} == {*map(tuple, image)}


def test_topology_is_kept_or_the_loss_is_said(run, tmp_path):
    points, faces = torus(30, 15)
    both = np.concatenate([points, 0.05 * points + [9, 0, 0]])
    source = write_ply(tmp_path / "in.ply", rows(both, {}), np.concatenate([faces, faces + 450]))
    report = tmp_path / "report.json"
    said = run("simplify", source, tmp_path / "o.ply", "--count", "8", "--report", report)
    notes = json.loads(report.read_text())["notes"]
    assert notes
    assert all(note in said for note in notes)
    said = run("simplify", source, tmp_path / "p.ply", "--count", "8", "--keep-topology")
    assert said
    _, places, light = read_ply(tmp_path / "p.ply")
    edge = {tuple(sorted(e)) for f in light.tolist() for e in zip(f, f[1:] + f[:1], strict=True)}
    assert len(places) - len(edge) + len(light) == 0  # two tori


def test_a_target_in_faces(run, tmp_path):
    points, faces = torus(60, 30)
    source = write_ply(tmp_path / "in.ply", rows(points, {}), faces)
    run("simplify", source, tmp_path / "o.ply", "--faces", "700")
    assert 690 <= len(read_ply(tmp_path / "o.ply")[2]) <= 700
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points, faces))
    report = mf.apply(meshes, "meshing_decimation_by_saliency", faces=700, errors=False)
    assert 690 <= meshes.current_mesh().face_number() <= 700
    assert report["errors"] is None
    assert "ratio=0" in run("simplify", source, tmp_path / "p.ply", "--ratio", "0", status=2)


def test_indices_are_written(run, tmp_path):
    points = bumpy()
    points[3] = np.nan
    source = write_ply(tmp_path / "in.ply", rows(points, {}))
    expected = salcore.simplify(points, ratio=0.3)
    for ending in ("npz", "csv"):
        path = tmp_path / f"kept.{ending}"
        run("simplify", source, tmp_path / f"{ending}.ply", "--ratio", "0.3", "--indices", path)
    with np.load(tmp_path / "kept.npz") as file:
        assert np.array_equal(file["indices"], expected.indices)
        assert np.array_equal(file["source"], expected.source)
    table = np.loadtxt(tmp_path / "kept.csv", int, delimiter=",", skiprows=1)
    assert np.array_equal(table[:, 1], expected.source)
    assert table[3].tolist() == [3, -1, -1]
    assert np.array_equal(np.flatnonzero(table[:, 0] == table[:, 2]), expected.indices)
    said = run("simplify", source, tmp_path / "o.ply", "--ratio", "0.3", "--indices", "kept.txt",
               status=2)  # fmt: skip
    assert "indices are written as .npz or .csv" in said
    assert not (tmp_path / "o.ply").exists()


def test_errors_need_not_be_measured(run, tmp_path, capsys):
    source = write_ply(tmp_path / "in.ply", rows(bumpy(), {}))
    report = tmp_path / "report.json"
    run("simplify", source, tmp_path / "o.ply", "--ratio", "0.3", "--no-errors", "--report", report)
    assert json.loads(report.read_text())["errors"] is None


def test_seams_may_be_let_go(run, tmp_path):
    points, faces, coords = split_torus(60)
    columns = {"s": coords[:, 0], "t": coords[:, 1]}
    source = write_ply(tmp_path / "in.ply", rows(points, columns), faces)
    seams = {tuple(p) for p in points[(coords % 1.0 == 0.0).any(axis=1)]}
    kept = []
    for switch in ([], ["--no-seams"]):
        run("simplify", source, tmp_path / "o.ply", "--ratio", "0.05", "--force", *switch)
        kept.append(len(seams & {tuple(p) for p in read_ply(tmp_path / "o.ply")[1]}))
    assert kept[1] < kept[0]


def test_colours_and_normals_of_split_vertices_make_seams(run, tmp_path):
    """Two halves of a plane, of two colours, whose vertices are split where they meet."""
    points, faces = grid(40)
    wave = 0.5 + 0.2 * np.sin(9 * points[faces].mean(axis=1)[:, 0])
    upper = points[faces].mean(axis=1)[:, 1] > wave
    parts = [faces[upper], faces[~upper]]
    pieces, offset, places, paint = [], 0, [], []
    for number, part in enumerate(parts):
        used, local = np.unique(part, return_inverse=True)
        pieces.append(local.reshape(-1, 3) + offset)
        offset += len(used)
        places.append(points[used])
        paint.append(np.full(len(used), 255 * number, np.uint8))
    red = np.concatenate(paint)
    columns = {"red": red, "green": 255 - red, "blue": red}
    all_points, all_faces = np.concatenate(places), np.concatenate(pieces)
    source = write_ply(tmp_path / "in.ply", rows(all_points, columns), all_faces)
    run("simplify", source, tmp_path / "o.ply", "--ratio", "0.1")
    layer, found, light = read_ply(tmp_path / "o.ply")
    shade = layer.columns["red"][light].astype(int)
    assert (shade == shade[:, :1]).all()  # no face mixes the colours
    area = np.cross(found[light][:, 1] - found[light][:, 0],
                    found[light][:, 2] - found[light][:, 0])[:, 2] / 2  # fmt: skip
    before = np.cross(points[parts[1]][:, 1] - points[parts[1]][:, 0],
                      points[parts[1]][:, 2] - points[parts[1]][:, 0])[:, 2] / 2  # fmt: skip
    assert area[shade[:, 0] == 255].sum() == pytest.approx(before.sum(), abs=0.01)
    assert area.sum() == pytest.approx(1.0)


def test_the_filters_see_seams_of_split_vertices_too():
    points, faces, coords = split_torus(60)
    for texture in ({"v_tex_coords_matrix": coords},
                    {"w_tex_coords_matrix": coords[faces].reshape(-1, 2)}):  # fmt: skip
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(points, faces, **texture))
        report = mf.apply(meshes, "meshing_decimation_by_saliency", ratio=0.1)
        light = meshes.current_mesh()
        places, triangles = light.vertex_matrix(), light.face_matrix()
        assert len(np.unique(places, axis=0)) == 360
        assert report["faces_after"] == len(triangles)
        if "v_tex_coords_matrix" in texture:
            found = light.vertex_tex_coord_matrix()[triangles]
        else:
            found = light.wedge_tex_coord_matrix().reshape(-1, 3, 2)
        assert torn(places, triangles, found) < 0.001


def test_normals_of_the_original_surface_on_a_light_mesh(run, tmp_path):
    points, faces = torus(80, 40)
    source = write_ply(tmp_path / "in.ply", rows(points, {}), faces)
    run("simplify", source, tmp_path / "o.obj", "--ratio", "0.2", "--transfer-normals")
    (light,) = obj.read(tmp_path / "o.obj")
    place = light.points[light.faces]
    expected = salcore.analyze(points, faces).normals
    number = {tuple(p): k for k, p in enumerate(points.tolist())}
    rows_of = np.array([number[tuple(p)] for p in place.reshape(-1, 3).tolist()])
    cosine = np.einsum("fkc,fkc->fk", light.corners["normal"], expected[rows_of].reshape(-1, 3, 3))
    assert np.quantile(cosine, 0.01) > np.cos(np.radians(10.0))  # few faces stand on edge


def test_colours_count_beside_distances(run, tmp_path):
    """On a flat side nothing but the colours tells where points are wanted."""
    points, faces = grid(60)
    shade = np.where(points[:, 0] > 0.5 + 0.2 * np.sin(9 * points[:, 1]), 255, 0).astype(np.uint8)
    columns = dict.fromkeys(("red", "green", "blue"), shade)
    source = write_ply(tmp_path / "in.ply", rows(points, columns), faces)
    errors = []
    for weight in ("0", "1"):
        arguments = ("--ratio", "0.1", "--force", "--attribute-weight", weight)
        run("simplify", source, tmp_path / "o.ply", *arguments)
        layer, places, light = read_ply(tmp_path / "o.ply")
        middle = places[light].mean(axis=1)
        area = np.cross(places[light][:, 1] - places[light][:, 0],
                        places[light][:, 2] - places[light][:, 0])[:, 2]  # fmt: skip
        truth = np.where(middle[:, 0] > 0.5 + 0.2 * np.sin(9 * middle[:, 1]), 255.0, 0.0)
        errors.append(area @ np.abs(layer.columns["red"][light].mean(axis=1) - truth) / area.sum())
    assert errors[1] < errors[0]
