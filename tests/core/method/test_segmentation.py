# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands, basins, their table, and what simplification does with them."""

import dataclasses
import json

import numpy as np
import pytest
from models import load_model
from shapes import bumpy, cube_cloud, grid, hull_mesh, sphere_cloud, torus

import salcore
from benchmarks.saliency.regions import adjusted_rand, part_faces
from benchmarks.saliency.shapes import engraved_sphere
from salcore.input.geometry import clean
from salcore.method.basins import find_basins
from salcore.method.graph import build_graph
from salcore.method.islands import find_islands
from salcore.method.merging import vertex_areas
from salcore.method.segmentation import border_lines

P = salcore.Parameters


def plate(rows=30, columns=40):
    points, faces = grid(rows, columns)
    geometry = clean(points, faces)
    graph = build_graph(geometry, P())
    return geometry, graph, vertex_areas(geometry, graph)


def islands(saliency, price, smallest=0.0):
    geometry, graph, area = plate()
    cells = np.arange(len(saliency))
    return find_islands(geometry.points, graph, cells, area, saliency, price, smallest)


def test_two_halves_are_two_islands_and_a_slope_is_not_many():
    x = np.tile(np.arange(40.0), 30)
    halves = islands((x >= 20).astype(float), 1e-3)
    assert adjusted_rand(halves, x >= 20) == 1.0
    assert len(np.unique(halves)) == 2
    slope = islands(x / 40, 1e-9)
    # Each column is alike; a chain of small steps does not join its two ends.
    assert slope[0] != slope[39]


@pytest.mark.parametrize("radius", [0.0, 20.0])
def test_equal_pairs_join_in_few_rounds(radius):
    geometry, graph, area = plate(100, 120)
    x, y = np.meshgrid(np.arange(120), np.arange(100))
    bump = np.maximum(0.0, radius - np.hypot(x - 30, y - 40)).ravel()
    saliency, cells = bump / max(radius, 1.0), np.arange(len(bump))
    rounds = []
    labels = find_islands(
        geometry.points, graph, cells, area, saliency, 1e-4, 0.0, progress=rounds.append
    )
    assert len(rounds) < 120  # thousands, where one pair joins in each
    assert len(np.unique(labels[bump == 0])) == 1


def test_a_border_has_its_price():
    x = np.tile(np.arange(40.0), 30)
    step = 0.1 * (x >= 20)
    geometry, _, _ = plate()
    width = 20 * geometry.to_unit
    # Two halves of the width w: a a / 2a · 0.1² by the length of their border is w / 2 · 0.1²; the
    # border of a lattice's graph, diagonals included, is 2 √3 / 3 or so of its length.
    assert len(np.unique(islands(step, 0.2 * 0.01 * width))) == 2
    assert len(np.unique(islands(step, 0.8 * 0.01 * width))) == 1


def test_a_speck_is_absorbed_by_its_like():
    saliency = np.repeat([0.0, 1.0], 600)
    saliency[820] = 0.4
    labels = islands(saliency, 1e-9, smallest=1e-3)
    assert len(np.unique(labels)) == 2
    assert labels[820] == labels[860]  # although nearer to the others, it only touches these


def basins(saliency, persistence, smallest=0.0):
    _, graph, area = plate()
    return find_basins(graph, np.arange(len(saliency)), area, saliency, persistence, smallest)


@pytest.mark.parametrize(("persistence", "count"), [(0.05, 4), (0.2, 3), (0.45, 2), (0.9, 1)])
def test_basins_merge_over_their_lowest_pass(persistence, count):
    # Valleys 0, 0.4, 0.1 and 0.2 deep under passes of 0.5, 0.75 and 0.6 between them.
    profile = np.interp(
        np.arange(40.0), [0, 6, 12, 18, 24, 30, 39], [0.0, 0.5, 0.4, 0.75, 0.1, 0.6, 0.2]
    )
    labels = basins(np.tile(profile, 30), persistence)
    assert len(np.unique(labels)) == count
    assert (labels.reshape(30, 40) == labels[:40]).all()


def test_a_flat_map_is_one_basin():
    assert (basins(np.zeros(1200), 0.1) == 0).all()


def test_sides_of_a_cube_are_basins_and_edges_their_borders():
    shape, _ = cube_cloud(20)
    points, faces = hull_mesh(shape - 0.5)
    analysis = salcore.analyze(points, faces, parameters=P(segmentation="basins"))
    inner = np.sort(np.abs(points), axis=1)[:, 1] < 0.4
    side = np.argmax(np.abs(points), axis=1) * 2 + (points.max(axis=1) > 0.49)
    assert adjusted_rand(analysis.regions[inner], side[inner]) == 1.0


def test_basins_are_the_faces_of_a_part():
    points, faces = load_model("fandisk.obj")
    from benchmarks.common.shapes import mesh_shape

    face, edge = part_faces(mesh_shape(points, faces))
    regions = salcore.analyze(points, faces, parameters=P(segmentation="basins")).regions
    assert adjusted_rand(regions[~edge], face[~edge]) > 0.8


@pytest.mark.parametrize("name", ["Laurana50k.ply", "bun_zipper.ply"])
def test_no_island_is_half_of_a_statue(name):
    points, faces = load_model(name)
    regions = salcore.analyze(points, faces).regions
    assert np.bincount(regions).max() < 0.4 * len(points)


def test_regions_come_by_falling_saliency_and_the_table_says_what_they_are():
    shape = engraved_sphere(8_000, "SAINT")
    for points, faces in ((shape.points + 7.0, shape.faces), (10 * bumpy(2_000), None)):
        analysis = salcore.analyze(points, faces)
        table, regions = analysis.region_table, analysis.regions
        assert len(table) == regions.max() + 1 > 1
        assert (np.diff(table.mean) <= 1e-6).all()
        for k in range(len(table)):
            inside = points[regions == k]
            assert table.points[k] == len(inside)
            assert table.low[k] == pytest.approx(inside.min(axis=0))
            assert table.high[k] == pytest.approx(inside.max(axis=0))
            assert table.largest[k] == pytest.approx(analysis.saliency[regions == k].max())
            assert (table.centre[k] >= table.low[k] - 1e-9).all()
            assert (table.centre[k] <= table.high[k] + 1e-9).all()
        rows = json.loads(json.dumps(table.as_dicts(), allow_nan=False))
        assert [row["region"] for row in rows] == list(range(len(table)))


def test_areas_are_those_of_the_surface():
    points, faces = hull_mesh(sphere_cloud(5_000))
    assert salcore.analyze(points, faces).region_table.area.sum() == pytest.approx(
        4 * np.pi, rel=0.02
    )
    cloud = salcore.analyze(points)
    assert cloud.region_table.area.sum() == pytest.approx(4 * np.pi, rel=0.1)


def test_protected_regions_stay():
    analysis = salcore.analyze(*torus(60, 30))
    inside = analysis.in_regions([0])
    light = analysis.simplify(count=int(inside.sum()) + 20, protect=inside)
    assert set(np.flatnonzero(inside)) <= set(light.indices)
    assert not analysis.in_regions([]).any()
    with pytest.raises(salcore.ParameterError, match="numbers"):
        analysis.in_regions(analysis.segmentation.count)
    with pytest.raises(salcore.ParameterError, match="numbers"):
        analysis.in_regions([0.5])


@pytest.mark.parametrize("mesh", [True, False])
def test_regions_of_interest_are_kept_denser(mesh):
    shape = engraved_sphere(10_000, "SAINT")
    faces = shape.faces if mesh else None
    plain = salcore.analyze(shape.points, faces)
    wanted = 2
    inside = plain.regions < wanted

    def density(**values):
        analysis = salcore.analyze(shape.points, faces, parameters=P(**values))
        kept = np.zeros(len(shape.points), dtype=bool)
        kept[analysis.simplify(ratio=0.05).indices] = True
        assert kept.sum() == 500
        return kept[inside].mean() / kept[~inside].mean()

    before = density()
    twice, four = (density(regions_of_interest=wanted, interest_density=d) for d in (2.0, 4.0))
    assert 1.4 * before < twice < 4 * before
    assert 1.4 * twice < four < 10 * before
    assert density(regions_of_interest=wanted, interest_density=1.0) == before


def test_border_lines_run_along_one_side():
    _, faces = grid(10, 10)
    labels = (np.tile(np.arange(10), 10) >= 5).astype(int)
    lines = border_lines(faces, labels)
    # The column of 4 is the last of the more salient region 0.
    assert (lines % 10 == 4).all()
    assert len(lines) == 9


def test_kept_regions_keep_their_borders_as_lines():
    shape = engraved_sphere(8_000, "SAINT")
    before = salcore.analyze(shape.points, shape.faces)
    line = border_lines(before.geometry.faces, before.segmentation.labels)
    on_line = np.zeros(len(shape.points), dtype=bool)
    on_line[line] = True

    def share(analysis):
        result = analysis.simplify(ratio=0.1)
        edges = result.indices[np.concatenate([result.faces[:, [k, k - 1]] for k in range(3)])]
        return on_line[edges].all(axis=1).sum()

    keeping = dataclasses.replace(before.parameters, keep_regions=True)
    after = salcore.analyze(shape.points, shape.faces, parameters=keeping)
    assert share(after) > 1.5 * share(before)


def test_regions_do_not_change_what_a_threshold_or_a_count_keeps():
    points, faces = torus(40, 30)
    points = points + 0.01 * np.random.default_rng(0).normal(size=points.shape)
    results = [
        salcore.analyze(points, faces, parameters=P(segmentation=kind, coarsest=coarsest))
        for kind in ("islands", "components")
        for coarsest in (0.0, 1.0)
    ]
    for target in ({"alpha": 20.0}, {"ratio": 0.2}):
        kept = [analysis.simplify(**target).indices for analysis in results]
        assert all((k == kept[0]).all() for k in kept)
