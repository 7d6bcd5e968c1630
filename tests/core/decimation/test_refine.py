# SPDX-License-Identifier: GPL-3.0-or-later
"""Edge flips after the cut."""

import dataclasses

import numpy as np
import pytest
from models import load_model
from shapes import grid, torus

import salcore
from salcore.arrays.edges import edge_key, find_edges
from salcore.arrays.vectors import face_normals
from salcore.decimation.flips import FlipMesh, independent
from salcore.decimation.nearest_faces import Assignment, Triangles
from salcore.decimation.overshoot import REACH, pull_back
from salcore.decimation.refine import fixed_edges, flip_edges
from salcore.decimation.samples import Samples

CUT = salcore.Parameters(refine=False)
OPTIMAL = {"placement": "optimal"}
# A square whose ridge runs from 1 to 3, cut along the other diagonal; point 4 is on the ridge.
RIDGE = np.array([[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1], [0.5, 0.5, 1]], dtype=float)
VALLEY = np.array([[0, 1, 2], [0, 2, 3]])
NOTHING = np.empty((0, 2), dtype=np.int32)
FREE = np.zeros(5, dtype=bool)


def flipped(faces, fixed=None, points=RIDGE):
    """Return the faces after flips, for a sample above point 4, and their corners."""
    fixed = np.empty(0, np.int64) if fixed is None else fixed
    mesh = FlipMesh.of(faces, np.arange(faces.size).reshape(-1, 3), len(points), fixed)
    sample = Samples(points[4:].T, np.array([[0.0, 0.0, 1.0]]).T, np.ones(1), np.array([0]), 1)
    flip_edges(mesh, points, sample, Assignment.of(sample, points, faces), 5)
    return mesh.faces, mesh.corners


def test_distances_to_triangles_by_hand():
    triangles = Triangles.of(np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]]), np.array([[0, 1, 2]]))
    queries = np.array([[1, 1, 3], [-3, -4, 0], [2, -2, 0], [3, 3, 0], [-1, 2, 1], [9, 0, 0.0]]).T
    first = np.zeros(6, dtype=int)
    square = triangles.square_distances(queries, first)
    np.testing.assert_allclose(square, [9, 25, 4, 2, 2, 25], atol=1e-12)
    share, inside = triangles.project(queries, first)
    nearest = [[2, 1, 1], [4, 0, 0], [2, 2, 0], [0, 2, 2], [2, 0, 2], [0, 4, 0]]
    np.testing.assert_allclose(4 * share.T, nearest, atol=1e-12)
    assert inside.tolist() == [True] + 5 * [False]
    line = Triangles.of(np.array([[0, 0, 0], [4, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]))
    assert line.square_distances(queries[:, :1], first[:1]) == [10]
    assert triangles.areas() == [8]
    assert line.areas() == [0]


def test_a_sample_walks_to_its_nearest_face():
    points, faces = grid(3, 20)
    queries = np.array([[15.3, 1.4, 0.5], [18.9, 0.2, -1.0]])
    samples = Samples(queries.T, np.zeros((3, 2)), np.ones(2), np.array([12, 54]), 2)
    at = Assignment.of(samples, points, faces)
    np.testing.assert_allclose(at.square, [0.25, 1.0])
    low, high = points[faces[at.face]].min(axis=1), points[faces[at.face]].max(axis=1)
    assert ((low <= queries) & (queries <= high))[:, :2].all()


def test_a_vertex_far_from_the_original_comes_back():
    points, faces = grid(8, 8)
    moved = points.copy()
    moved[20, 2] += 3.0  # far above its faces
    moved[28, 2] += 0.5  # within reach
    moved[30, 2] += 1.0  # no sample near it: back onto the surface
    farthest = np.full(len(points), 0.2)
    farthest[30] = 0.0
    near = pull_back(moved, np.array([20, 28, 30]), farthest, points, faces)
    np.testing.assert_allclose(near[20] - points[20], [0, 0, REACH * 0.2**0.5], atol=1e-12)
    np.testing.assert_array_equal(near[28], moved[28])
    np.testing.assert_allclose(near[30], points[30], atol=1e-12)
    others = np.setdiff1d(np.arange(len(points)), [20, 28, 30])
    np.testing.assert_array_equal(near[others], moved[others])


def test_an_edge_is_flipped_onto_the_ridge_with_its_corners():
    before = VALLEY.copy()
    faces, corners = flipped(VALLEY)
    assert {frozenset(face) for face in faces.tolist()} == {
        frozenset({0, 1, 3}),
        frozenset({1, 2, 3}),
    }
    assert (VALLEY.ravel()[corners] == faces).all()
    assert (before == VALLEY).all()


def test_fixed_edges_stay():
    source = np.array([0, 1, 2, 3, 0])
    seam = fixed_edges(VALLEY, source, np.array([[2, 4]], dtype=np.int32), FREE)
    assert seam.tolist() == [2]  # 4 went into 0: the key of edge 0-2 of five points
    held = FREE.copy()
    held[[0, 2]] = True
    for fixed in (seam, fixed_edges(VALLEY, source, NOTHING, held)):
        assert (flipped(VALLEY, fixed)[0] == VALLEY).all()


def test_no_edge_twice_and_no_face_turned():
    # A tetrahedron has all edges already; a dart's other diagonal lies outside.
    closed = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    assert (flipped(closed)[0] == closed).all()
    dart = RIDGE.copy()
    dart[1:4] = [[1, 0.1, 1], [0.3, 0.2, 0], [0.1, 1, 1]]
    assert (flipped(VALLEY, points=dart)[0] == VALLEY).all()


def test_sides_beyond_edges_follow_flips():
    points, faces = wavy()
    mesh = FlipMesh.of(faces, faces, len(points), np.empty(0, np.int64))
    for seed in range(5):
        quads = mesh.quads(mesh.sides_of(np.ones(len(faces), dtype=bool)))
        quads = quads.take(mesh.legal(quads, points))
        gain = np.random.default_rng(seed).random(len(quads.left))
        chosen = independent(quads, gain, len(points))
        assert len(np.unique(quads.corners[:, chosen])) == 4 * len(chosen) > 0
        mesh.flip(quads.take(chosen))
        again = FlipMesh.of(mesh.faces, mesh.corners, len(points), np.empty(0, np.int64))
        assert (mesh.twins == again.twins).all()
        assert (mesh.corners == mesh.faces).all()
        assert np.isin(again.keys, mesh.keys).all()


def wavy() -> tuple[np.ndarray, np.ndarray]:
    points, faces = grid(40, 40)
    points = points / 39.0
    points[:, 2] = 0.1 * np.sin(9 * points[:, 0] + 4 * points[:, 1])
    return points, faces


@pytest.mark.parametrize("shape", [wavy(), torus(60, 40)], ids=["wavy", "torus"])
def test_refining_lowers_the_error_and_keeps_points_and_topology(shape):
    points, faces = shape
    analyses = [salcore.analyze(points, faces, parameters=p) for p in (CUT, None)]
    for share in (0.5, 0.1, 0.03):
        cut, refined = results = [analysis.simplify(ratio=share) for analysis in analyses]
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
    analyses = [
        salcore.analyze(points, faces, parameters=p)
        for p in (CUT, dataclasses.replace(CUT, refine=True))
    ]
    for share in (0.3, 0.05):
        cut, refined = (analysis.simplify(ratio=share) for analysis in analyses)
        assert refined.errors.surface.rms <= cut.errors.surface.rms
        assert len(refined.faces) == len(cut.faces)


@pytest.mark.parametrize("shape", [wavy(), torus(60, 40)], ids=["wavy", "torus"])
def test_fitting_halves_the_error_and_keeps_topology(shape):
    points, faces = shape
    results = [
        salcore.simplify(points, faces, ratio=0.1, parameters=dataclasses.replace(p, **OPTIMAL))
        for p in (CUT, salcore.Parameters())
    ]
    cut, fitted = results
    assert (cut.indices == fitted.indices).all()
    assert fitted.errors.surface.rms < 0.75 * cut.errors.surface.rms
    before, after = (find_edges(r.faces, len(r.indices)) for r in results)
    assert sorted(before.uses) == sorted(after.uses)
    normals = face_normals(fitted.positions, fitted.faces)
    assert (normals.any(axis=1)).all()


def test_fitting_leaves_protected_points_and_what_fits_already():
    points, faces = wavy()
    protect = np.zeros(len(points), dtype=bool)
    protect[::97] = True
    parameters = salcore.Parameters(**OPTIMAL)
    result = salcore.simplify(points, faces, ratio=0.1, protect=protect, parameters=parameters)
    held = protect[result.indices]
    assert held.sum() == protect.sum()
    np.testing.assert_allclose(result.positions[held], points[result.indices][held], atol=1e-12)
    assert not np.allclose(result.positions[~held], points[result.indices][~held])
    whole = salcore.simplify(points, faces, ratio=1.0, parameters=parameters)
    assert np.abs(whole.positions - points).max() < 1e-3


def test_a_flat_sheet_stays_flat_with_its_border():
    points, faces = grid(20, 20)
    for share in (0.5, 0.1):
        result = salcore.simplify(
            points, faces, ratio=share, parameters=salcore.Parameters(**OPTIMAL)
        )
        assert np.abs(result.positions[:, 2]).max() < 1e-9
        double = face_normals(result.positions, result.faces)
        assert (double[:, 2] > 0).all()
        assert 0.5 * double[:, 2].sum() == pytest.approx(19 * 19, rel=0.01)
