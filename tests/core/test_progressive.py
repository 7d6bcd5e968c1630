# SPDX-License-Identifier: GPL-3.0-or-later
"""Elimination: exact counts, nested levels, surfaces that stay surfaces."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import load_model
from shapes import bumpy, cube_cloud, grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.geometry import clean
from salcore.graph import build_graph
from salcore.progress import finish
from salcore.quadrics import minimizers, monomials, plane_quadrics, vertex_quadrics
from salcore.triangles import find_edges, star_triangles

MODELS = [
    "bun_zipper.ply", "Laurana50k.ply", "fandisk.obj", "rockerArm.ply", "lato000.ply",
    "nasty/abominevole.off", "nasty/cube_40k.obj", "nasty/degtri_sliding.off",
    "nasty/non_manif_hole.ply", "nasty/planar_logo.ply", "nasty/sliver_tet.ply",
    "nasty/terrain_utm.ply", "nasty/room_scan1_duplicates.ply",
]  # fmt: skip


def test_a_quadric_is_the_squared_distance_to_its_plane():
    quadric = plane_quadrics(np.array([[0, 0.6, 0.8]]), np.array([[1, 2, 3.0]]), np.array([2.0]))
    away = np.array([[1, 2, 3], [5, 2, 3], [1, 2.6, 3.8], [1, 2, 8.0]])
    assert monomials(away) @ quadric[0] == pytest.approx([0, 0, 2, 2 * 16])


def test_the_minimum_of_three_planes_is_where_they_meet():
    corner = np.array([1.0, -2.0, 0.5])
    quadric = plane_quadrics(np.eye(3), np.tile(corner, (3, 1)), np.ones(3)).sum(axis=0)
    found = minimizers(quadric[None], np.array([[1.1, -2.1, 0.6]]))
    assert found == pytest.approx(corner[None], abs=1e-3)
    nothing = minimizers(np.zeros((1, 10)), np.array([[7.0, 8, 9]]))
    assert nothing.tolist() == [[7, 8, 9]]


def test_border_planes_hold_the_rim_of_a_plane():
    points, faces = grid(3, 3)
    quadrics, areas = finish(vertex_quadrics(points, faces, finish(find_edges(faces, 9)), 1.0))
    assert areas.sum() == pytest.approx(3 * 4)
    inwards = monomials(points + np.array([0.5, 0, 0]))
    cost = np.einsum("nk,nk->n", quadrics, inwards)
    assert cost[4] == pytest.approx(0)  # the middle slides for nothing
    assert (cost[[3, 5]] > 0.1).all()  # the sides do not
    assert cost[1] == pytest.approx(0)  # along the rim is free


def test_edges_of_two_triangles():
    edges = finish(find_edges(np.array([[0, 1, 2], [2, 1, 3]]), 4))
    pairs = list(zip(edges.low.tolist(), edges.high.tolist(), edges.uses.tolist(), strict=True))
    assert pairs == [(0, 1, 1), (0, 2, 1), (1, 2, 2), (1, 3, 1), (2, 3, 1)]
    assert edges.forward.tolist() == [True, False, True, True, False, False]


def test_the_stars_of_a_scan_make_a_surface():
    points, _ = load_model("bun_zipper.ply")
    graph = finish(build_graph(clean(points), salcore.Parameters()))
    triangles = finish(star_triangles(graph.stars))
    assert len(np.unique(triangles, axis=0)) == len(triangles)
    assert len(triangles) / len(points) == pytest.approx(2.0, abs=0.02)
    uses = finish(find_edges(triangles, len(points))).uses
    assert (uses == 2).mean() > 0.97


def check_faces(result, points, faces):
    assert result.faces.min(initial=0) >= 0
    assert result.faces.max(initial=0) < len(result.indices)
    a, b, c = result.faces.T
    assert ((a != b) & (b != c) & (c != a)).all()
    ordered = np.sort(result.faces, axis=1)
    assert len(np.unique(ordered, axis=0)) == len(ordered)
    # Corner by corner, a face is its origin with every corner at its source (or a twin of it).
    kept = points[result.indices]
    assert (kept[result.source[faces[result.face_source]]] == kept[result.faces]).all()


@pytest.mark.parametrize("name", MODELS)
def test_exact_counts_nested_levels_and_valid_faces(name):
    points, faces = load_model(name)
    analysis = salcore.analyze(points, faces)
    total = len(points)
    counts = [total, total - 1, *(total * np.array([0.7, 0.3, 0.1, 0.02])).astype(int), 9, 4]
    before = np.arange(total)
    for count in sorted({int(c) for c in counts if 4 <= c <= total}, reverse=True):
        result = analysis.simplify(count=count)
        assert len(result.indices) == count
        assert np.isin(result.indices, before).all()
        assert (result.source[result.indices] == np.arange(count)).all()
        assert result.source.min() >= 0
        if faces is not None:
            check_faces(result, points, faces)
        before = result.indices


@pytest.mark.parametrize("ratio", [0.0, 0.1, 1 / 3, 1.0])
def test_ratios(ratio):
    result = salcore.simplify(bumpy(1000), ratio=ratio)
    assert len(result.indices) == max(round(ratio * 1000), 1)


def test_duplicates_and_invalid_points_count_as_points():
    points = np.concatenate([bumpy(50), bumpy(50)[:20], np.full((5, 3), np.nan)])
    analysis = salcore.analyze(points)
    for count in (70, 60, 50, 49):
        result = analysis.simplify(count=count)
        assert len(result.indices) == count
        assert result.indices.max() < 70
        assert (result.source[result.indices] == np.arange(count)).all()
    with pytest.raises(salcore.ParameterError, match="count=71: there are 70 valid points"):
        analysis.simplify(count=71)


def test_protected_points_stay():
    points, faces = load_model("bun_zipper.ply")
    protect = points[:, 1] > 0.18
    analysis = salcore.analyze(points, faces)
    kept = int(protect.sum())
    for count in (kept, kept + 100):
        result = analysis.simplify(count=count, protect=protect)
        assert len(result.indices) == count
        assert np.isin(np.flatnonzero(protect), result.indices).all()
    by_alpha = analysis.simplify(alpha=80, protect=protect).indices
    assert np.isin(np.flatnonzero(protect), by_alpha).all()
    with pytest.raises(salcore.ParameterError, match=f"but {kept} are protected"):
        analysis.simplify(count=kept - 1, protect=protect)
    with pytest.raises(salcore.GeometryError, match=r"protect of shape \(3,\)"):
        analysis.simplify(count=kept, protect=[True, False, True])


def test_important_points_stay_longer():
    points = sphere_cloud(3000)
    above = points[:, 2] > 0
    result = salcore.simplify(points, ratio=0.1, importance=50.0 * above)
    assert above[result.indices].mean() > 0.65
    with pytest.raises(salcore.GeometryError, match="importance: -1 is the value of point"):
        salcore.simplify(points, ratio=0.1, importance=-1.0 * above)


@pytest.mark.parametrize("name", ["fandisk.obj", "nasty/non_manif_hole.ply"])
@pytest.mark.parametrize("bound", [0.0, 0.0005, 0.005])
def test_the_largest_error_is_honoured(name, bound):
    points, faces = load_model(name)
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(max_error=bound)
    errors = result.report.errors
    assert errors.surface.max <= bound * errors.diagonal
    if bound > 0.001:
        assert len(result.indices) < 0.9 * len(points)
    length = dataclasses.replace(analysis.parameters, error_unit="length")
    same = dataclasses.replace(analysis, parameters=length)
    assert (same.simplify(max_error=bound * errors.diagonal).indices == result.indices).all()


def test_every_component_keeps_a_point():
    balls = [sphere_cloud(n) + np.array([3.0 * k, 0, 0]) for k, n in enumerate((900, 400, 100))]
    points = np.concatenate(balls)
    result = salcore.simplify(points, count=3)
    assert np.unique(np.round(points[result.indices, 0] / 3)).tolist() == [0, 1, 2]
    assert len(salcore.simplify(points, count=1).indices) == 1


def test_workers_and_repeats_make_the_same_order():
    points, faces = load_model("bun_zipper.ply")
    first = salcore.simplify(points, faces, ratio=0.1)
    for workers in (1, 3):
        parameters = salcore.Parameters(workers=workers)
        again = salcore.simplify(points, faces, parameters=parameters, ratio=0.1)
        assert (again.indices == first.indices).all()
        assert (again.faces == first.faces).all()


def two_holed_torus():
    """Glue two tori along a face each."""
    points, faces = torus(24, 12)
    count = len(points)
    one, other = faces[0], faces[-1]
    far = points * [-1, 1, 1] + np.array([6.0, 0, 0])
    turned = faces[:, ::-1] + count
    opened = np.concatenate([faces[1:], turned[:-1]])
    hole, lid = one, (other[::-1] + count)[::-1]
    tube = []
    for k in range(3):
        a, b = hole[k], hole[(k + 1) % 3]
        c, d = lid[::-1][k], lid[::-1][(k + 1) % 3]
        tube += [[a, b, d], [a, d, c]]
    return np.concatenate([points, far]), np.concatenate([opened, np.array(tube)])


def characteristic(result):
    """Return Euler's number, the numbers of faces at edges, and whether all vertices are used."""
    count = len(result.indices)
    edges = finish(find_edges(result.faces, count))
    used = len(np.unique(result.faces)) == count
    return count - len(edges.low) + len(result.faces), set(edges.uses.tolist()), used


SHAPES = {
    "sphere": (hull_mesh(sphere_cloud(700)), 2, 4),
    "torus": (torus(30, 16), 0, 30),
    "two-holed torus": (two_holed_torus(), -2, 60),
    "disc": (grid(18, 18), 1, 4),
}


CACHE = {}


@settings(max_examples=15, deadline=None)
@given(st.data())
@pytest.mark.parametrize("shape", SHAPES)
def test_topology_stays(shape, data):
    (points, faces), number, least = SHAPES[shape]
    key = f"analysis of {shape}"
    if key not in CACHE:
        CACHE[key] = salcore.analyze(points + 0.01 * bumpy(len(points)), faces)
    count = data.draw(st.integers(least, len(points)))
    result = CACHE[key].simplify(count=count)
    euler, uses, used = characteristic(result)
    assert euler == number
    assert used
    assert uses == ({1, 2} if shape == "disc" and len(result.faces) > 1 else {2})


def test_orientation_stays_consistent():
    points, faces = load_model("fandisk.obj")
    result = salcore.simplify(points, faces, ratio=0.05)
    start, end = result.faces.T.ravel(), np.roll(result.faces, -1, axis=1).T.ravel()
    directed = set(zip(start.tolist(), end.tolist(), strict=True))
    assert len(directed) == len(start)
    assert all((b, a) in directed for a, b in directed)


def test_the_edges_of_a_cube_stay_straight():
    points, distance = cube_cloud(24)
    result = salcore.simplify(points, ratio=0.1)
    corners = np.flatnonzero(np.isin(points, (0.0, 1.0)).all(axis=1))
    assert np.isin(corners, result.indices).sum() >= 7
    edge = distance[result.indices] == 0
    assert edge.mean() > 2 * (distance == 0).mean()


def test_optimal_positions_lower_the_error_and_turn_no_face():
    points, faces = load_model("rockerArm.ply")
    original = salcore.simplify(points, faces, ratio=0.02)
    parameters = salcore.Parameters(placement="optimal")
    moved = salcore.simplify(points, faces, parameters=parameters, ratio=0.02)
    assert (moved.indices == original.indices).all()
    assert moved.positions.shape == (len(moved.indices), 3)
    assert original.positions is None
    assert moved.report.errors.surface.rms < 0.8 * original.report.errors.surface.rms
    assert np.isfinite(moved.positions).all()


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ({}, "no target given: give one of ratio, count, max_error, alpha"),
        ({"ratio": 0.1, "count": 5}, r"2 targets given \(ratio, count\)"),
        ({"ratio": 1.1}, "ratio=1.1: give a number from 0 to 1"),
        ({"count": 0}, "count=0"),
        ({"count": 2.5}, "count=2.5: give a whole number"),
        ({"max_error": -1}, "max_error=-1"),
        ({"rati": 0.3}, "no target 'rati'"),
    ],
)
def test_mistakes(target, message):
    with pytest.raises(salcore.ParameterError, match=message):
        salcore.simplify(bumpy(30), **target)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.integers(0, 10**6), st.booleans(), st.floats(0, 1))
def test_any_small_mesh(count, seed, flat, ratio):
    rng = np.random.default_rng(seed)
    points = np.round(rng.random((count, 3)) * 4) if flat else rng.random((count, 3))
    faces = rng.integers(0, count, (2 * count, 3))
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(ratio=ratio)
    assert len(result.indices) == max(round(ratio * count), 1)
    assert (result.source[result.indices] == np.arange(len(result.indices))).all()
    if result.faces is not None:
        check_faces(result, points, faces)
    assert np.isfinite(result.report.errors.surface.rms)
