# SPDX-License-Identifier: GPL-3.0-or-later
"""Saliency at every scale, on shapes where it is known what stands out, and on hardly anything."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from models import load_model
from scipy.spatial import cKDTree
from scipy.stats import spearmanr
from shapes import bumpy, grid, hull_mesh, sphere_cloud, torus, turned

import salcore
from benchmarks.saliency.exact import auc
from benchmarks.saliency.shapes import RADII, engraved_sphere, fillets, with_noise
from salcore.method.contraction import build_levels
from salcore.method.noise import normal_noise
from salcore.method.scales import size_of


def levels_of(analysis):
    coarsest = 0.01 * size_of(analysis.geometry.points)
    return build_levels(analysis.geometry, analysis.graph, analysis.frames, coarsest)


@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.001])
@pytest.mark.parametrize("count", [8_000, 16_000, 32_000])
def test_an_engraved_word_stands_out(count, noise):
    shape = engraved_sphere(count, "SAINT")
    saliency = salcore.analyze(with_noise(shape, noise), shape.faces).saliency
    for letter in range(5):
        assert auc(saliency, shape.part == letter, shape.off) > 0.95


def test_an_engraved_word_stands_out_on_a_cloud():
    shape = engraved_sphere(20_000, "SAINT")
    saliency = salcore.analyze(with_noise(shape, 0.0005)).saliency
    for letter in range(5):
        assert auc(saliency, shape.part == letter, shape.off) > 0.95


def test_noise_on_one_half_is_no_feature():
    shape = engraved_sphere(16_000, "SAINT")
    points = with_noise(shape, 0.001, half=True)
    every = salcore.analyze(points, shape.faces)
    one = salcore.analyze(points, shape.faces, parameters=salcore.Parameters(coarsest=0.0))
    values = [auc(a.saliency, shape.feature, shape.off) for a in (every, one)]
    assert values[0] > 0.95 > values[1]


@pytest.mark.parametrize("count", [10_000, 40_000])
def test_fillets_of_all_radii_stand_out(count):
    shape = fillets(count)
    saliency = salcore.analyze(shape.points, shape.faces).saliency
    noisy = salcore.analyze(with_noise(shape, 0.001), shape.faces).saliency
    for radius in range(len(RADII)):
        assert auc(saliency, shape.part == radius, shape.off) > 0.97, radius
        assert auc(noisy, shape.part == radius, shape.off) > 0.9, radius


def test_sampling_hardly_matters():
    dense, thin = fillets(40_000), fillets(10_000)
    near = cKDTree(dense.points).query(thin.points)[1]

    def agreement(**values):
        maps = [
            salcore.analyze(s.points, s.faces, parameters=salcore.Parameters(**values)).saliency
            for s in (dense, thin)
        ]
        return spearmanr(maps[0][near], maps[1]).statistic

    assert agreement() > agreement(coarsest=0.0) + 0.1


@pytest.mark.parametrize(
    ("name", "least"), [("Laurana50k.ply", 0.9), ("rockerArm.ply", 0.85)], ids=["bust", "part"]
)
def test_noise_hardly_moves_a_scan(name, least):
    points, faces = load_model(name)
    analysis = salcore.analyze(points, faces)
    size = np.linalg.norm(np.ptp(points, axis=0))
    noise = np.random.default_rng(0).normal(size=(len(points), 1)) * 0.001 * size
    noisy = salcore.analyze(points + noise * analysis.normals, faces)
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    assert spearmanr(analysis.saliency[used], noisy.saliency[used]).statistic > least


@pytest.mark.parametrize("mesh", [True, False])
def test_turning_moving_and_scaling_change_nothing(mesh):
    shape = engraved_sphere(6_000, "SAINT")
    faces = shape.faces if mesh else None
    first = salcore.analyze(shape.points, faces)
    for seed, factor, offset in ((1, 1.0, 0.0), (2, 1e-3, 0.0), (3, 1e5, 1e6)):
        moved = factor * turned(shape.points, seed) + offset
        second = salcore.analyze(moved, faces)
        assert second.saliency == pytest.approx(first.saliency, abs=1e-5)
        assert (second.regions == first.regions).mean() > 0.999


def test_workers_and_repeats_change_no_bit():
    points = engraved_sphere(20_000).points
    first = salcore.analyze(points, parameters=salcore.Parameters(workers=1))
    second = salcore.analyze(points, parameters=salcore.Parameters(workers=3))
    assert (first.saliency == second.saliency).all()
    assert (first.regions == second.regions).all()


def test_the_order_of_the_points_hardly_matters():
    shape = engraved_sphere(10_000)
    order = np.random.default_rng(0).permutation(len(shape.points))
    first = salcore.analyze(shape.points, shape.faces)
    second = salcore.analyze(shape.points[order], np.argsort(order)[shape.faces])
    assert spearmanr(first.saliency[order], second.saliency).statistic > 0.95


def test_one_level_alone_is_the_paper_s_own():
    points, faces = torus(40, 20)
    analysis = salcore.analyze(points, faces, parameters=salcore.Parameters(coarsest=0.0))
    assert (analysis.saliency == analysis.saliency_map.scaled).all()
    assert analysis.scales.scales == ()


def test_lengths_say_the_same_as_shares():
    points, faces = hull_mesh(sphere_cloud(8_000, 3.0))
    share = salcore.analyze(points, faces)
    coarsest = 0.01 * size_of(points)
    length = dataclasses.replace(
        share.parameters, scale_unit="length", coarsest=coarsest, finest=coarsest / 8
    )
    other = salcore.analyze(points, faces, parameters=length)
    assert other.saliency == pytest.approx(share.saliency, abs=1e-9)


def test_scales_are_physical_lengths_up_to_the_coarsest():
    points = sphere_cloud(30_000)
    analysis = salcore.analyze(points)
    size = size_of(analysis.geometry.points)
    lengths = np.array([scale.length for scale in analysis.scales.scales]) / size
    assert lengths == pytest.approx([0.0, 0.01])
    for scale in analysis.scales.scales:
        assert scale.cells.shape == (30_000,)
        assert scale.cells.max() + 1 == len(scale.saliency) == len(scale.noise)


def test_cells_are_within_reach_and_cover_all():
    analysis = salcore.analyze(bumpy(5_000))
    levels = levels_of(analysis)
    assert len(levels) > 1
    for finer, level in pairwise(levels):
        assert level.members.sum() == 5_000
        assert level.area.sum() == pytest.approx(levels[0].area.sum())
        assert (np.bincount(level.cell, minlength=len(level.points)) > 0).all()
        joined = finer.number != level.number[level.cell]
        centre = np.empty(5_000, dtype=int)
        centre[finer.number] = np.arange(len(finer.points))
        to = centre[level.number[level.cell[joined]]]
        distance = np.linalg.norm(finer.points[joined] - finer.points[to], axis=1)
        assert distance.max() <= level.length * (1 + 1e-6)


def test_chosen_cells_are_no_neighbours_within_the_length():
    analysis = salcore.analyze(bumpy(3_000))
    base, level = levels_of(analysis)[:2]
    chosen = np.zeros(3_000, dtype=bool)
    chosen[level.number] = True  # a cloud this small is in the order of the input
    row, other = base.graph.rows(), base.graph.indices
    near = np.linalg.norm(base.points[row] - base.points[other], axis=1) <= level.length
    assert not (chosen[row] & chosen[other] & near).any()


@pytest.mark.parametrize("strength", [0.0, 0.1, 0.3])
def test_noise_of_a_plane_is_what_it_is(strength):
    points, faces = grid(100, 100)
    points[:, 2] = strength * np.random.default_rng(0).normal(size=len(points))
    analysis = salcore.analyze(points, faces)
    true = np.mean(np.arccos(np.clip(np.abs(analysis.normals[:, 2]), 0.0, 1.0)) ** 2)
    estimate = normal_noise(levels_of(analysis))[0].mean()
    assert 0.5 * true - 1e-9 <= estimate <= 1.2 * true + 1e-9


def test_a_crease_is_no_noise():
    points, faces = grid(80, 80)
    points[:, 2] = np.abs(points[:, 0] - 39.5)
    assert np.quantile(salcore.analyze(points, faces).scales.noise, 0.99) < 0.5


@pytest.mark.parametrize("count", range(11))
@pytest.mark.parametrize("kind", ["islands", "basins", "components"])
def test_hardly_any_points(count, kind):
    points = np.random.default_rng(count).random((count, 3))
    analysis = salcore.analyze(points, parameters=salcore.Parameters(segmentation=kind))
    assert analysis.saliency.shape == analysis.regions.shape == (count,)
    assert np.isfinite(analysis.saliency).all()
    assert len(analysis.region_table) == len(np.unique(analysis.regions))


@pytest.mark.parametrize("kind", ["islands", "basins", "components"])
def test_equal_points_and_lines_and_parts(kind):
    parameters = salcore.Parameters(segmentation=kind)
    same = salcore.analyze(np.ones((7, 3)), parameters=parameters)
    assert same.regions.tolist() == [0] * 7
    line = np.column_stack([np.arange(50.0), np.zeros((50, 2))])
    assert (salcore.analyze(line, parameters=parameters).saliency == 0.0).all()
    points, faces = torus(30, 15)
    two = np.concatenate([points, points + np.array([5.0, 0.0, 0.0])])
    parts = salcore.analyze(
        two, np.concatenate([faces, faces + len(points)]), parameters=parameters
    )
    assert not set(parts.regions[: len(points)]) & set(parts.regions[len(points) :])


def test_duplicates_share_their_saliency():
    points = bumpy(600)
    twice = salcore.analyze(np.concatenate([points, points[::-1]]))
    assert (twice.saliency[:600] == twice.saliency[600:][::-1]).all()
    assert (twice.regions[:600] == twice.regions[600:][::-1]).all()


def test_loose_points_beside_a_mesh():
    points, faces = torus(40, 20)
    loose = sphere_cloud(300, 0.2) + np.array([0.0, 0.0, 3.0])
    analysis = salcore.analyze(np.concatenate([points, loose]), faces)
    assert np.isfinite(analysis.saliency).all()
    assert not set(analysis.regions[: len(points)]) & set(analysis.regions[len(points) :])


def test_a_stray_point_does_not_spoil_the_scales():
    shape = engraved_sphere(10_000)
    stray = np.concatenate([shape.points, [[300.0, 0.0, 0.0]]])
    saliency = salcore.analyze(stray, shape.faces).saliency[:-1]
    assert auc(saliency, shape.feature, shape.off) > 0.95


def test_prepare_tells_its_stages_and_can_be_cancelled():
    analysis = salcore.analyze(engraved_sphere(6_000).points)
    told = []
    with pytest.raises(salcore.Cancelled):
        analysis.prepare(progress=lambda stage, share: share < 0.3)
    assert "scales" not in vars(analysis)
    analysis.prepare(regions=True, progress=lambda stage, share: told.append((stage, share)))
    assert {stage for stage, _ in told} == {"Scales", "Regions"}
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert {"scales", "segmentation"} <= set(vars(analysis))


def test_a_count_alone_does_not_ask_for_scales():
    analysis = salcore.analyze(bumpy(500))
    analysis.simplify(count=100)
    assert "scales" not in vars(analysis)
    assert "segmentation" not in vars(analysis)


@pytest.mark.parametrize("factor", [1e-250, 1.0, 1e250])
@pytest.mark.parametrize(
    "values",
    [
        {"coarsest": 1e300},
        {"coarsest": 1e300, "finest": 1e300, "scale_unit": "length"},
        {"coarsest": 1e-300},
        {"coarsest": 5e-324, "scale_unit": "length"},
        {"finest": 0.0},
        {"deviation_threshold": 0.0},
        {"dissimilarity": "entropy", "contrast": "difference", "averaging": "plain"},
        {"angle": "squared", "whole_percent": True, "counting": "step"},
        {"level": 3, "region_contrast": 0.0, "region_size": 0.0},
        {"segmentation": "basins", "persistence": 1.0},
        {"segmentation": "components", "tolerance": 1.0},
    ],
)
def test_extreme_values_give_finite_maps(values, factor):
    points = factor * np.random.default_rng(0).random((60, 3))
    analysis = salcore.analyze(points, parameters=salcore.Parameters(**values))
    assert ((analysis.saliency >= 0.0) & (analysis.saliency <= 1.0)).all()
    table = analysis.region_table
    assert table.points.sum() == 60
    assert (table.low <= table.high).all()
