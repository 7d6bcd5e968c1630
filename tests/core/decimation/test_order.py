# SPDX-License-Identifier: GPL-3.0-or-later
"""Elimination: exact counts, nested levels, surfaces that stay surfaces."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import load_crop, load_model
from shapes import bumpy, cube_cloud, grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.arrays.edges import find_edges
from salcore.decimation.costs import Weights
from salcore.decimation.order import eliminate

MODELS = [
    "bun_zipper.ply", "Laurana50k.ply", "fandisk.obj", "rockerArm.ply", "lato000.ply",
    "nasty/abominevole.off", "nasty/cube_40k.obj", "nasty/degtri_sliding.off",
    "nasty/non_manif_hole.ply", "nasty/planar_logo.ply", "nasty/sliver_tet.ply",
    "nasty/terrain_utm.ply", "nasty/room_scan1_duplicates.ply",
]  # fmt: skip


def check_faces(result, points, faces):
    assert result.faces.min(initial=0) >= 0
    assert result.faces.max(initial=0) < len(result.indices)
    a, b, c = result.faces.T
    assert ((a != b) & (b != c) & (c != a)).all()
    # No face twice, unless one is the back of the other.
    turn = (result.faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    ordered = np.take_along_axis(result.faces, turn, axis=1)
    assert len(np.unique(ordered, axis=0)) == len(ordered)
    # Every corner comes from one that went into its point (or a twin of it).
    kept = points[result.indices]
    origin = faces.ravel()[result.corner_origin]
    assert (kept[result.source[origin]] == kept[result.faces]).all()


@pytest.mark.parametrize("name", MODELS)
def test_exact_counts_nested_levels_and_valid_faces(name):
    points, faces = load_crop(name, 2_500)
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


def test_every_component_keeps_a_point():
    balls = [sphere_cloud(n) + np.array([3.0 * k, 0, 0]) for k, n in enumerate((900, 400, 100))]
    points = np.concatenate(balls)
    result = salcore.simplify(points, count=3)
    assert np.unique(np.round(points[result.indices, 0] / 3)).tolist() == [0, 1, 2]
    assert len(salcore.simplify(points, count=1).indices) == 1


def test_workers_and_repeats_make_the_same_order():
    points, faces = load_crop("bun_zipper.ply", 20_000)
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
    edges = find_edges(result.faces, count)
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


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 60), st.integers(0, 10**6), st.booleans(), st.floats(1e-3, 1))
def test_any_small_mesh(count, seed, flat, ratio):
    rng = np.random.default_rng(seed)
    points = np.round(rng.random((count, 3)) * 4) if flat else rng.random((count, 3))
    faces = rng.integers(0, count, (2 * count, 3))
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(ratio=ratio)
    geometry = analysis.geometry
    used = geometry.vertex_of[result.indices[~geometry.loose[result.indices]]]
    kept = len(np.unique(used)) + geometry.loose[result.indices].sum()
    assert kept == max(round(ratio * geometry.available), 1)
    assert (result.source[result.indices] == np.arange(len(result.indices))).all()
    if result.faces is not None:
        check_faces(result, points, faces)
    assert np.isfinite(result.report.errors.surface.rms)


def weights(count, **changes):
    """Return weights of a surface that is known, on which nothing is dear."""
    nothing = np.zeros(count)
    ready = {"factor": nothing + 1, "evenness": nothing, "guessed_surface": nothing > 0}
    return Weights(**{**ready, "protected": nothing > 0, "border": 1.0, **changes})


NO_LINKS = (np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int32))


def test_the_middle_of_a_square_goes_first_and_costs_nothing():
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1.1, 1, 0]])
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    order = eliminate(points, faces, NO_LINKS, weights(5))
    assert order.rank[4] == 4
    assert order.parent[4] == 3  # all cost nothing: the last edge counts
    assert order.error[4] == 0.0
    assert order.rounds[0] == (4, 1, 0.0)
    assert (np.diff(order.error[np.argsort(order.rank)]) <= 0).all()
    assert order.error.max() > 0.1


def test_links_lead_where_no_face_does():
    points = np.array([[0, 0, 0], [1, 0, 0], [1.5, 0, 0.0]])
    links = np.array([0, 1], dtype=np.int32), np.array([1, 2], dtype=np.int32)
    loose = {"evenness": np.full(3, 0.1), "guessed_surface": np.ones(3, dtype=bool)}
    order = eliminate(points, np.empty((0, 3), dtype=np.int32), links, weights(3, **loose))
    assert sorted(order.rank.tolist()) == [0, 1, 2]
    assert order.parent[np.argmax(order.rank)] >= 0
    alone = eliminate(points, np.empty((0, 3), dtype=np.int32), NO_LINKS, weights(3))
    assert alone.parent.tolist() == [-1, 0, 0]  # components go into the first, at no error
    assert alone.error.tolist() == [0, 0, 0]


def test_protected_vertices_outlast_all_others():
    points, faces = grid(9, 9)
    protected = np.arange(81) % 7 == 0
    order = eliminate(points, faces, NO_LINKS, weights(81, protected=protected))
    assert (order.rank[protected] < protected.sum()).all()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("shape", ["grid", "torus", "scan"])
def test_renumbered_vertices_go_in_the_same_order(shape, seed):
    points, faces = {
        "grid": lambda: grid(21, 17),  # full of ties
        "torus": lambda: torus(40, 20),
        "scan": lambda: load_model("nasty/non_manif_hole.ply"),
    }[shape]()
    count = len(points)
    seams = faces[:30, :2] if seed % 2 else None
    order = eliminate(points, faces, NO_LINKS, weights(count), seams)
    old = np.random.default_rng(seed).permutation(count)
    new = np.argsort(old)
    moved = None if seams is None else new[seams]
    again = eliminate(points[old], new[faces], NO_LINKS, weights(count), moved, priority=old)
    assert (again.rank == order.rank[old]).all()
    assert (again.error == order.error[old]).all()
    assert (np.where(again.parent < 0, -1, old[again.parent]) == order.parent[old]).all()


@pytest.mark.parametrize("order", ["C", "F"])
def test_the_input_is_left_alone(order):
    points, faces = grid(9, 9)
    faces, weight = np.array(faces, dtype=np.int32, order=order), weights(81, evenness=np.ones(81))
    before = points.copy(), faces.copy()
    first = eliminate(points, faces, NO_LINKS, weight)
    assert (points == before[0]).all()
    assert (faces == before[1]).all()
    assert (eliminate(points, faces, NO_LINKS, weight).rank == first.rank).all()


def test_progress_grows_and_cancels():
    points, faces = torus(40, 20)
    shares = []
    work = salcore.progress.Progress(lambda stage, share: shares.append(share), "Elimination")
    eliminate(points, faces, NO_LINKS, weights(len(points)), progress=work)
    assert (np.diff(shares) >= 0).all()
    assert 0.99 < shares[-1] <= 1.0
    assert len(shares) > 10
    stop = salcore.progress.Progress(lambda stage, share: share < 0.5, "Elimination")
    with pytest.raises(salcore.Cancelled, match="cancelled during Elimination"):
        eliminate(points, faces, NO_LINKS, weights(len(points)), progress=stop)
