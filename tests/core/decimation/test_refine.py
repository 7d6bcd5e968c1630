# SPDX-License-Identifier: GPL-3.0-or-later
"""Edge flips after the cut."""

import dataclasses

import numpy as np
import pytest
from models import load_model
from shapes import grid, torus

import salcore
from salcore.arrays.edges import edge_key, find_edges
from salcore.decimation.refine import fixed_edges, refine_faces
from salcore.decimation.samples import Samples, Triangles

CUT = salcore.Parameters(refine=False)
# A square whose ridge runs from 1 to 3, cut along the other diagonal; point 4 is on the ridge.
RIDGE = np.array([[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1], [0.5, 0.5, 1]], dtype=float)
VALLEY = np.array([[0, 1, 2], [0, 2, 3]])
NOTHING = np.empty((0, 2), dtype=np.int32)
FREE = np.zeros(5, dtype=bool)


def on_ridge() -> Samples:
    up = np.array([[0.0, 0.0, 1.0]])
    return Samples(RIDGE[4:], up, np.ones(1), np.array([0]))


def test_distances_to_triangles_by_hand():
    triangles = Triangles.of(np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]]), np.array([[0, 1, 2]]))
    queries = np.array([[1, 1, 3], [-3, -4, 0], [2, -2, 0], [3, 3, 0], [-1, 2, 1], [9, 0, 0.0]])
    square = triangles.square_distances(queries, np.zeros(6, dtype=int))
    np.testing.assert_allclose(square, [9, 25, 4, 2, 2, 25], atol=1e-12)
    line = Triangles.of(np.array([[0, 0, 0], [4, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]))
    assert line.square_distances(queries[:1], np.zeros(1, dtype=int)) == [10]


def test_an_edge_is_flipped_onto_the_ridge_with_its_corners():
    corners = np.arange(6).reshape(2, 3)
    faces, moved = refine_faces(RIDGE, VALLEY, corners, on_ridge(), np.empty(0, np.int64))
    assert {frozenset(face) for face in faces.tolist()} == {
        frozenset({0, 1, 3}),
        frozenset({1, 2, 3}),
    }
    assert (VALLEY.ravel()[moved] == faces).all()
    assert (VALLEY == [[0, 1, 2], [0, 2, 3]]).all()  # the input stays


def test_fixed_edges_stay():
    source = np.array([0, 1, 2, 3, 0])
    corners = np.arange(6).reshape(2, 3)
    seam = fixed_edges(VALLEY, source, np.array([[2, 4]], dtype=np.int32), FREE)
    assert seam.tolist() == [2]  # 4 went into 0: the key of edge 0-2 of five points
    held = FREE.copy()
    held[[0, 2]] = True
    for fixed in (seam, fixed_edges(VALLEY, source, NOTHING, held)):
        faces, _ = refine_faces(RIDGE, VALLEY, corners, on_ridge(), fixed)
        assert (faces == VALLEY).all()


def test_no_edge_twice_and_no_face_turned():
    # A tetrahedron has all edges already; a dart's other diagonal lies outside.
    corners = np.arange(12).reshape(4, 3)
    closed = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    faces, _ = refine_faces(RIDGE, closed, corners, on_ridge(), np.empty(0, np.int64))
    assert (faces == closed).all()
    dart = RIDGE.copy()
    dart[1:4] = [[1, 0.1, 1], [0.3, 0.2, 0], [0.1, 1, 1]]
    faces, _ = refine_faces(dart, VALLEY, corners[:2], on_ridge(), np.empty(0, np.int64))
    assert (faces == VALLEY).all()


def wavy() -> tuple[np.ndarray, np.ndarray]:
    points, faces = grid(40, 40)
    points = points / 39.0
    points[:, 2] = 0.1 * np.sin(9 * points[:, 0] + 4 * points[:, 1])
    return points, faces


@pytest.mark.parametrize("shape", [wavy(), torus(60, 40)], ids=["wavy", "torus"])
@pytest.mark.parametrize("share", [0.5, 0.1, 0.03])
def test_refining_lowers_the_error_and_keeps_points_and_topology(shape, share):
    points, faces = shape
    results = [salcore.simplify(points, faces, ratio=share, parameters=p) for p in (CUT, None)]
    cut, refined = results
    assert (cut.indices == refined.indices).all()
    assert (cut.source == refined.source).all()
    assert refined.errors.surface.rms < cut.errors.surface.rms
    before, after = (find_edges(r.faces, len(r.indices)) for r in results)
    assert sorted(before.uses) == sorted(after.uses)
    assert (np.sort(after.forward[after.sides]) == np.sort(before.forward[before.sides])).all()
    assert (refined.indices[refined.faces] == faces.ravel()[refined.face_corners]).all()


def test_levels_of_one_analysis_nest_and_repeat():
    points, faces = wavy()
    analysis = salcore.analyze(points, faces)
    many, few, again = (analysis.simplify(ratio=r) for r in (0.3, 0.1, 0.3))
    assert set(few.indices) <= set(many.indices)
    assert (many.faces == again.faces).all()


def test_seams_stay_as_they_were_cut():
    points, faces = wavy()
    seam = np.column_stack([np.arange(20, 39 * 40, 40), np.arange(60, 40 * 40, 40)])
    results = [
        salcore.simplify(points, faces, ratio=0.1, seams=seam, parameters=p) for p in (CUT, None)
    ]
    left = []
    for result in results:
        ends = result.source[seam]
        keys = edge_key(*ends[ends[:, 0] != ends[:, 1]].T, len(result.indices))
        edges = find_edges(result.faces, len(result.indices))
        left.append(np.isin(keys, edge_key(edges.low, edges.high, len(result.indices))))
    assert (left[0] == left[1]).all()
    assert left[0].any()


def test_fewer_points_reach_a_largest_error():
    points, faces = wavy()
    bound = 0.01
    cut = salcore.simplify(points, faces, max_error=bound, parameters=CUT)
    refined = salcore.simplify(points, faces, max_error=bound)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    assert refined.errors.surface.max <= bound * diagonal
    assert len(refined.indices) <= len(cut.indices)


def test_clouds_and_thresholds_stay_as_they_are():
    points, _ = wavy()
    for target in ({"ratio": 0.1}, {"alpha": 1.0}):
        one, other = (salcore.simplify(points, parameters=p, **target) for p in (CUT, None))
        assert (one.indices == other.indices).all()
        assert other.faces is None
        assert other.face_corners is None


@pytest.mark.parametrize("name", ["fandisk.obj", "nasty/non_manif_hole.ply"])
def test_models(name):
    points, faces = load_model(name)
    for share in (0.3, 0.05):
        cut, refined = (
            salcore.simplify(points, faces, ratio=share, parameters=p)
            for p in (CUT, dataclasses.replace(CUT, refine=True))
        )
        assert refined.errors.surface.rms <= cut.errors.surface.rms
        assert len(refined.faces) == len(cut.faces)
