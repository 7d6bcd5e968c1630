# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands for each point: sources against an independent search, and copies of points."""

from collections import deque

import numpy as np
import pytest
from models import load_model
from shapes import bumpy, grid

import salcore


def rings_to_source(graph, source):
    """Count rings from each vertex to its own source, and to the nearest source of all."""
    count = len(source)
    around = [graph.indices[graph.indptr[i] : graph.indptr[i + 1]].tolist() for i in range(count)]
    followers = {}
    for vertex, of in enumerate(source.tolist()):
        followers.setdefault(of, set()).add(vertex)
    own, best = [-1] * count, [10**9] * count
    for start, waiting in followers.items():
        seen, front = {start: 0}, deque([start])
        while front and waiting:
            i = front.popleft()
            best[i] = min(best[i], seen[i])
            if i in waiting:
                waiting.discard(i)
                own[i] = seen[i]
            for j in around[i]:
                if j not in seen:
                    seen[j] = seen[i] + 1
                    front.append(j)
    return np.array(own), np.array(best)


def vertex_sources(analysis, result):
    """Return the kept vertex that stands for each vertex."""
    geometry = analysis.geometry
    return geometry.vertex_of[result.indices[result.source[geometry.input_of]]]


@pytest.mark.parametrize("level", [1, 2])
@pytest.mark.parametrize("max_gap", [1, 2, 4])
def test_sources_are_the_fewest_rings_away(max_gap, level):
    parameters = salcore.Parameters(max_gap=max_gap, level=level)
    analysis = salcore.analyze(bumpy(900), parameters=parameters)
    for alpha in (0, 25, 1000):
        own, best = rings_to_source(
            analysis.graph, vertex_sources(analysis, analysis.simplify(alpha=alpha))
        )
        assert own.min() >= 0
        assert own.max() <= max_gap
        assert (own == best).all()


def test_sources_of_a_scan_are_within_the_gap():
    points, faces = load_model("Laurana50k.ply")
    analysis = salcore.analyze(points, faces)
    own, _ = rings_to_source(analysis.graph, vertex_sources(analysis, analysis.simplify(alpha=30)))
    assert own.min() >= 0
    assert own.max() <= 1


def test_one_ring_away_the_source_is_the_nearest_kept_neighbour():
    points = bumpy(900)
    analysis = salcore.analyze(points)
    result = analysis.simplify(alpha=20)
    kept = set(result.indices.tolist())
    for vertex in range(len(points)):
        if vertex in kept:
            continue
        near = analysis.graph.indices[
            analysis.graph.indptr[vertex] : analysis.graph.indptr[vertex + 1]
        ]
        near = [j for j in near.tolist() if j in kept]
        nearest = min(near, key=lambda j: np.linalg.norm(points[j] - points[vertex]))
        assert result.indices[result.source[vertex]] == nearest


@pytest.mark.parametrize("preset", salcore.PRESETS)
def test_copies_of_points_change_nothing(preset):
    points, rng = bumpy(500), np.random.default_rng(4)
    parameters = salcore.Parameters.preset(preset)
    doubled = np.concatenate([points, points[rng.integers(0, 500, 700)]])
    first = salcore.analyze(points, parameters=parameters)
    second = salcore.analyze(doubled, parameters=parameters)
    vertex = second.geometry.vertex_of
    assert (second.saliency == first.saliency[vertex]).all()
    assert (second.regions == first.regions[vertex]).all()
    a, b = first.simplify(alpha=20), second.simplify(alpha=20)
    assert (a.indices == b.indices).all()
    assert (b.source == a.source[vertex]).all()
    assert b.report.welded == 700


def test_all_points_equal():
    result = salcore.simplify(np.full((20, 3), 7.5), alpha=50)
    assert result.indices.tolist() == [0]
    assert result.source.tolist() == [0] * 20
    assert result.report.welded == 19


def test_unreferenced_vertices_are_points_too():
    points, faces = grid(10, 10)
    loose = np.random.default_rng(1).random((80, 3)) + 20
    analysis = salcore.analyze(np.concatenate([loose, points]), faces + 80)
    result = analysis.simplify(alpha=1000)
    assert (result.indices < 80).any()
    # No source crosses from the mesh to the loose points.
    assert (result.indices[result.source[:80]] < 80).all()
    assert (result.indices[result.source[80:]] >= 80).all()
