# SPDX-License-Identifier: GPL-3.0-or-later
"""What is salient on shapes where it is known, and what must not change the answer."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import load_crop, load_model
from scipy.sparse.csgraph import dijkstra
from shapes import bumpy, cube_cloud, grid, hull_mesh, sphere_cloud, turned

import salcore

PRESETS = [salcore.Parameters.preset(name) for name in salcore.PRESETS]


@pytest.mark.parametrize("parameters", PRESETS, ids=salcore.PRESETS)
@pytest.mark.parametrize("with_faces", [True, False])
def test_a_plane_has_no_saliency(parameters, with_faces):
    points, faces = grid(15, 20)
    points = turned(points)
    analysis = salcore.analyze(points, faces if with_faces else None, parameters=parameters)
    assert not analysis.saliency.any()
    assert (analysis.regions == 0).all()


def test_the_edges_of_a_cube_are_most_salient():
    points, distance = cube_cloud(20)
    saliency = salcore.analyze(points).saliency
    means = [saliency[distance == d].mean() for d in range(5)]
    assert means == sorted(means, reverse=True)
    assert saliency[distance == 0].min() > saliency[distance >= 2].max() * 0.9
    assert means[0] > 0.75
    assert saliency[distance >= 5].max() < 0.03
    corners = np.isin(points, (0.0, 1.0)).all(axis=1)
    assert (saliency[corners] == 1.0).all()


@pytest.mark.parametrize("count", [500, 2000, 20000])
def test_the_map_of_a_sphere_is_flat(count):
    points = sphere_cloud(count)
    assert np.ptp(salcore.analyze(points).saliency) < 0.1
    assert np.ptp(salcore.analyze(*hull_mesh(points)).saliency) < 0.12


def moved(points):
    yield "rotated", turned(points), 1e-6
    yield "scaled", 37.3 * points, 1e-6
    yield "scaled by 1024", 1024 * points, 0.0
    yield "moved by 1e6", points + 1e6 * np.ptp(points, axis=0).max() * np.array([1, -1, 0.5]), 1e-6


def same_result(first, second, tolerance):
    assert second.saliency == pytest.approx(first.saliency, abs=max(tolerance, 1e-15))
    assert (first.regions == second.regions).all()
    for alpha in (0.0, 30.0):
        a, b = first.simplify(alpha=alpha), second.simplify(alpha=alpha)
        assert (a.indices == b.indices).all()
        assert (a.source == b.source).all()


@pytest.mark.parametrize("parameters", PRESETS, ids=salcore.PRESETS)
def test_rotation_scale_and_offset_change_nothing(parameters):
    points = bumpy()
    first = salcore.analyze(points, parameters=parameters)
    for _name, other, tolerance in moved(points):
        same_result(first, salcore.analyze(other, parameters=parameters), tolerance)


def test_rotation_scale_and_offset_change_nothing_on_a_scan():
    points, faces = load_model("Laurana50k.ply")
    first = salcore.analyze(points, faces)
    used = np.zeros(len(points), bool)
    used[faces] = True
    for name, other, _ in moved(points):
        second = salcore.analyze(other, faces)
        # An offset of a million extents costs ten digits of the input itself.
        assert second.saliency[used] == pytest.approx(first.saliency[used], abs=1e-3), name
        # The loose points lie on a lattice: which of two equally near ones is a neighbour, is
        # decided by rounding.
        assert (np.abs(second.saliency - first.saliency) > 1e-3).mean() < 0.02, name
        a, b = (one.simplify(alpha=30.0).indices for one in (first, second))
        differing = len(np.setxor1d(a, b)) / len(a)
        assert differing < 0.01, name


def test_vertex_order_permutes_the_result():
    points = bumpy()
    order = np.random.default_rng(0).permutation(len(points))
    # At several scales, the order of the points decides which cells they make.
    one = salcore.Parameters(coarsest=0.0, segmentation="components")
    first, second = (salcore.analyze(p, parameters=one) for p in (points, points[order]))
    assert second.saliency == pytest.approx(first.saliency[order], abs=1e-9)
    pairs = np.unique(np.column_stack([first.regions[order], second.regions]), axis=0)
    assert len(pairs) == len(np.unique(first.regions)) == len(np.unique(second.regions))


def test_workers_and_repeats_change_nothing():
    points, _ = load_crop("bun_zipper.ply", 20_000)
    first = salcore.analyze(points)
    for workers in (1, 3):
        parameters = salcore.Parameters(workers=workers)
        other = salcore.analyze(points, parameters=parameters)
        assert (other.saliency == first.saliency).all()
        assert (other.simplify(alpha=20).indices == first.simplify(alpha=20).indices).all()


def check_result(analysis, result):
    count = analysis.geometry.input_count
    indices, source = result.indices, result.source
    assert (np.diff(indices) > 0).all()
    assert len(indices) == 0 or (indices[0] >= 0 and indices[-1] < count)
    finite = analysis.geometry.vertex_of >= 0
    assert (source[~finite] == -1).all()
    if len(indices):
        assert (source[finite] >= 0).all()
        assert (source[indices] == np.arange(len(indices))).all()
    assert np.isfinite(analysis.saliency).all()
    assert analysis.saliency.min(initial=0) >= 0
    assert analysis.saliency.max(initial=0) <= 1


def check_guard(analysis, result, max_gap):
    """Count rings by an independent search, and from each vertex to its own source."""
    kept = np.flatnonzero(result.interest.kept)
    rings = dijkstra(
        analysis.graph.matrix().astype(float), indices=kept, unweighted=True, min_only=True
    )
    assert rings.max() <= max_gap


@pytest.mark.parametrize("mesh", [True, False])
def test_the_guard_leaves_no_gap(mesh):
    points, faces = load_crop("Laurana50k.ply", 12_000)
    known = salcore.analyze(points, faces if mesh else None)
    for max_gap in (1, 2, 4):
        parameters = salcore.Parameters(max_gap=max_gap)
        analysis = dataclasses.replace(known, parameters=parameters)
        for alpha in (0.0, 40.0, 1000.0):
            result = analysis.simplify(alpha=alpha)
            check_result(analysis, result)
            check_guard(analysis, result, max_gap)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 120),
    st.integers(0, 10**6),
    st.floats(0, 200),
    st.sampled_from(salcore.PRESETS),
    st.booleans(),
)
def test_any_small_cloud(count, seed, alpha, preset, coarse):
    points = np.random.default_rng(seed).random((count, 3))
    if coarse:  # many duplicates, lines and planes
        points = np.round(points * 3)
    analysis = salcore.analyze(points, parameters=salcore.Parameters.preset(preset))
    result = analysis.simplify(alpha=alpha)
    check_result(analysis, result)
    if preset == "default":
        check_guard(analysis, result, 1)
    assert result.report.points_after == len(result.indices)


@pytest.mark.parametrize("preset", salcore.PRESETS)
@pytest.mark.parametrize("name", ["bun_zipper.ply", "Laurana50k.ply"])
def test_more_alpha_keeps_fewer_points(name, preset):
    points, faces = load_crop(name, 12_000)
    analysis = salcore.analyze(points, faces, parameters=salcore.Parameters.preset(preset))
    counts = [len(analysis.simplify(alpha=alpha).indices) for alpha in (0, 10, 30, 50, 80)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_paper_reaches_the_printed_counts_of_laurana():
    paper = salcore.Parameters.preset("paper")
    points, faces = load_model("Laurana50k.ply")
    analysis = salcore.analyze(points, faces, parameters=paper)
    for alpha, printed in ((0, 18819), (30, 17492), (50, 16241)):
        assert len(analysis.simplify(alpha=alpha).indices) == pytest.approx(printed, rel=0.05)
    kept = {paper.deviation_threshold: len(analysis.simplify(alpha=0).indices)}
    for x in {0, 5, 9, 13} - set(kept):
        changed = dataclasses.replace(paper, deviation_threshold=x)
        kept[x] = len(salcore.simplify(points, faces, parameters=changed, alpha=0).indices)
    counts = [kept[x] for x in sorted(kept)]
    assert counts == sorted(counts)
