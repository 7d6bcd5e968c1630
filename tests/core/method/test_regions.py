# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions, their boundaries and chains, and the coverage guard, against slow references."""

from collections import deque
from itertools import pairwise

import numpy as np
import pytest
from shapes import bumpy, grid

import salcore
from salcore.input.geometry import clean
from salcore.method.coverage import close_gaps
from salcore.method.graph import build_graph
from salcore.method.regions import border_vertices, build_regions


def labelled_by_the_algorithm(graph, saliency, tolerance):
    """Algorithm 1 of the paper, word by word, adding v_j where the print says v_i."""
    label = np.full(len(saliency), -1)
    current = 0
    for start in range(len(saliency)):
        if label[start] >= 0:
            continue
        label[start] = current
        front = deque([start])
        while front:
            i = front.popleft()
            for j in graph.indices[graph.indptr[i] : graph.indptr[i + 1]]:
                if label[j] < 0 and abs(saliency[i] - saliency[j]) <= tolerance:
                    label[j] = current
                    front.append(j)
        current += 1
    return label


@pytest.fixture
def scene():
    points = bumpy(700)
    geometry = clean(points)
    graph = build_graph(geometry, salcore.Parameters())
    return geometry, graph, np.random.default_rng(7).random(700)


@pytest.mark.parametrize("tolerance", [0.0, 0.05, 0.2, 1.0])
def test_regions_are_those_of_algorithm_1(scene, tolerance):
    geometry, graph, saliency = scene
    regions = build_regions(geometry, graph, saliency, tolerance)
    assert (regions.labels == labelled_by_the_algorithm(graph, saliency, tolerance)).all()
    assert regions.count == regions.labels.max() + 1


def test_boundary_vertices_see_another_region(scene):
    geometry, graph, saliency = scene
    regions = build_regions(geometry, graph, saliency, 0.1)
    for i in range(len(saliency)):
        around = graph.indices[graph.indptr[i] : graph.indptr[i + 1]]
        assert regions.boundary[i] == (regions.labels[around] != regions.labels[i]).any()


def test_chains_follow_edges_within_a_region_and_cover_the_boundary(scene):
    geometry, graph, saliency = scene
    regions = build_regions(geometry, graph, saliency, 0.1)
    matrix = graph.matrix()
    covered = regions.branching.copy()
    assert not covered[regions.chains].any()
    covered[regions.chains] = True
    assert (covered == regions.boundary).all()
    assert len(np.unique(regions.chains)) == len(regions.chains)
    for begin, end in zip(regions.offsets[:-1], regions.offsets[1:], strict=True):
        chain = regions.chains[begin:end]
        assert len(np.unique(regions.labels[chain])) == 1
        for a, b in pairwise(chain):
            assert matrix[a, b]


def test_the_border_of_a_mesh_is_a_boundary():
    points, faces = grid(4, 5)
    rim = np.isin(points[:, 0], (0, 4)) | np.isin(points[:, 1], (0, 3))
    assert border_vertices(faces, len(points)).tolist() == np.flatnonzero(rim).tolist()
    assert (salcore.analyze(points, faces).segmentation.boundary == rim).all()


def test_isolated_vertices_are_boundaries():
    analysis = salcore.analyze(np.array([[1.0, 2.0, 3.0]]))
    assert analysis.segmentation.boundary.tolist() == [True]


def path_graph(count):
    points = np.column_stack([np.arange(float(count)), np.zeros((count, 2))])
    faces = np.column_stack([np.arange(count - 2), np.arange(1, count - 1), np.arange(2, count)])
    geometry = clean(points, faces)
    return geometry, build_graph(geometry, salcore.Parameters())


def test_guard_adds_nothing_where_nothing_is_missing():
    geometry, graph = path_graph(9)  # each vertex is joined to those at most two away
    kept = np.zeros(9, bool)
    kept[[2, 6]] = True
    added, source = close_gaps(geometry, graph, kept, 1)
    assert not added.any()
    assert source.tolist() == [2, 2, 2, 2, 2, 6, 6, 6, 6] or source.tolist() == [
        2,
        2,
        2,
        2,
        6,
        6,
        6,
        6,
        6,
    ]


@pytest.mark.parametrize("max_gap", [1, 2, 3])
def test_added_points_are_apart_and_close_every_gap(max_gap):
    geometry, graph = path_graph(60)
    kept = np.zeros(60, bool)
    kept[0] = True
    added, source = close_gaps(geometry, graph, kept, max_gap)
    living = np.flatnonzero(added | kept)
    steps = -(-np.diff(living) // 2)  # two vertices a ring
    assert steps.min() > max_gap
    distance = np.abs(np.arange(60)[:, None] - living).min(axis=1)
    assert (-(-distance // 2)).max() <= max_gap
    assert np.isin(source, living).all()


def test_without_guard_sources_reach_across_components():
    points = np.concatenate([bumpy(50), bumpy(50, seed=1) + 100])
    geometry = clean(points)
    graph = build_graph(geometry, salcore.Parameters())
    kept = np.zeros(100, bool)
    kept[3] = True
    added, source = close_gaps(geometry, graph, kept, 0)
    assert not added.any()
    assert (source == 3).all()
    assert (close_gaps(geometry, graph, np.zeros(100, bool), 0)[1] == -1).all()
