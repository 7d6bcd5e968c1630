# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams: where charts of a texture meet, a mesh is simplified along the line."""

import os
from pathlib import Path

import numpy as np
import pymeshlab
import pytest
from shapes import grid, torus

import salcore


def split_grid(size=24):
    """Return a flat grid whose texture has two charts, meeting on a zigzag."""
    points, faces = grid(size, size)
    centre = points[faces].mean(axis=1)
    right = centre[:, 0] > size / 2 + 2 * np.sign(np.sin(centre[:, 1]))
    charts = points[faces][:, :, :2] + 100.0 * right[:, None, None]
    return points, faces, charts


def crossing(faces, charts, result):
    """Return the share of faces that reach from one chart into the other."""
    chosen = charts.reshape(-1, 2)[result.corner_source(faces, charts)]
    return (np.ptp(chosen[:, :, 0], axis=1) > 50).mean()


def test_seams_are_found():
    points, faces, charts = split_grid()
    seams = salcore.find_seams(faces, charts)
    right = charts[:, :, 0].min(axis=1) > 50
    sides = {}
    for face, side in zip(faces, right, strict=True):
        for k in range(3):
            edge = tuple(sorted((face[k], face[(k + 1) % 3])))
            sides.setdefault(edge, set()).add(side)
    assert {tuple(edge) for edge in seams.tolist()} == {e for e, s in sides.items() if len(s) == 2}
    assert len(salcore.find_seams(faces, points[faces])) == 0
    assert salcore.find_seams(np.empty((0, 3), int), np.empty((0, 3, 2))).shape == (0, 2)
    with pytest.raises(salcore.GeometryError, match=r"give values of corners of shape"):
        salcore.find_seams(faces, charts[:-1])


def test_materials_have_borders():
    _, faces, charts = split_grid()
    kind = (charts[:, :, :1] > 50).min(axis=1, keepdims=True).repeat(3, axis=1)
    np.testing.assert_array_equal(
        salcore.find_seams(faces, kind), salcore.find_seams(faces, charts)
    )


@pytest.mark.parametrize("ratio", [0.5, 0.2, 0.1])
def test_no_face_of_a_flat_sheet_reaches_across(ratio):
    points, faces, charts = split_grid()
    analysis, seams = salcore.analyze(points, faces), salcore.find_seams(faces, charts)
    free = analysis.simplify(ratio=ratio)
    held = analysis.simplify(ratio=ratio, seams=seams)
    assert crossing(faces, charts, free) > 0.02
    assert crossing(faces, charts, held) == 0.0
    assert len(held.indices) == len(free.indices)


def test_meshes_stay_closed_and_every_point_goes_in_the_end():
    points, faces = torus(40, 20)
    around = np.arctan2(points[faces][:, :, 1], points[faces][:, :, 0])
    charts = np.where(np.ptp(around, axis=1, keepdims=True) > 3, around % (2 * np.pi), around)
    seams = salcore.find_seams(faces, charts[:, :, None])
    assert len(seams) >= 20
    analysis = salcore.analyze(points, faces)
    for count in (400, 100, 30):
        result = analysis.simplify(count=count, seams=seams)
        edges = np.sort(
            np.concatenate(
                [result.faces[:, [0, 1]], result.faces[:, [1, 2]], result.faces[:, [2, 0]]]
            ),
            axis=1,
        )
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert len(analysis.simplify(count=1, seams=seams).indices) == 1
    order = analysis.ranking(seams=seams)
    assert sorted(order.rank.tolist()) == list(range(len(points)))


def test_a_textured_scan():
    path = Path(pymeshlab.__file__).parent / "tests/sample_meshes/bunny10k_textured.obj"
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(os.fspath(path))
    mesh = meshes.current_mesh()
    points, faces = mesh.vertex_matrix(), mesh.face_matrix()
    charts = mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    seams = salcore.find_seams(faces, charts)
    analysis = salcore.analyze(points, faces)

    def stretched(result):
        def lengths(values):
            return np.linalg.norm(values - np.roll(values, -1, axis=1), axis=2).sum(axis=1)

        uv = charts.reshape(-1, 2)[result.corner_source(faces, charts)]
        ratio = lengths(uv) / lengths(points[result.indices[result.faces]])
        usual = np.median(lengths(charts) / lengths(points[faces]))
        return (ratio > 3 * usual).mean()

    free = analysis.simplify(ratio=0.1)
    held = analysis.simplify(ratio=0.1, seams=seams)
    assert stretched(free) > 0.2
    assert stretched(held) < 0.03
    assert held.report.errors.surface.rms < 2.5 * free.report.errors.surface.rms


def test_seams_are_checked():
    points, faces, _ = split_grid()
    analysis = salcore.analyze(points, faces)
    for seams, message in (
        ([[0, len(points)]], "is out of range .* give indices from 0"),
        ([[-1, 0]], "index -1 is out of range"),
        ([0, 1], r"shape \(2,\)"),
        ([[0.5, 1.0]], "integers"),
    ):
        with pytest.raises(salcore.GeometryError, match=message):
            analysis.simplify(ratio=0.5, seams=seams)
    # What is no edge does no harm.
    assert len(analysis.simplify(count=9, seams=[[0, len(points) - 1], [3, 3]]).indices) == 9


def test_a_texture_of_single_triangles_has_no_seams():
    points, faces = torus(40, 20)
    charts = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(faces), 1, 1))
    seams = salcore.find_seams(faces, charts)
    assert len(seams) > 1000
    analysis = salcore.analyze(points, faces)
    free, held = analysis.simplify(ratio=0.2), analysis.simplify(ratio=0.2, seams=seams)
    np.testing.assert_array_equal(free.indices, held.indices)
