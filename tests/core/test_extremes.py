# SPDX-License-Identifier: GPL-3.0-or-later
"""Ties, extreme sizes and thresholds: what rounding must not decide, and what must not overflow."""

import dataclasses
import json

import numpy as np
import pytest
from shapes import bumpy, cube_cloud, grid, sphere_cloud, torus, turned

import salcore
from salcore.method.interest import boundary_extremities
from salcore.method.regions import Regions
from salcore.method.saliency import deviating, edge_deviation

P = salcore.Parameters


@pytest.mark.parametrize("seed", range(0, 60, 3))
def test_no_neighbour_along_an_axis_is_missing_in_a_turned_lattice(seed):
    points, _ = grid(15, 15)
    matrix = salcore.analyze(turned(points, seed)).graph.matrix().toarray()
    steps = np.abs(points[:, None] - points[None]).sum(axis=2)
    assert matrix[steps == 1].all()
    assert not matrix[np.abs(points[:, None] - points[None]).max(axis=2) > 1].any()


@pytest.mark.parametrize("steps", [6, 16])
@pytest.mark.parametrize("neighbors", [4, 5, 8, 16, 24])
def test_rotation_changes_nothing_on_a_lattice(steps, neighbors):
    points, _ = cube_cloud(steps)
    parameters = P(neighbors=neighbors)
    saliency = salcore.analyze(points, parameters=parameters).saliency
    for seed in range(3):
        other = salcore.analyze(turned(points, seed), parameters=parameters).saliency
        assert other == pytest.approx(saliency, abs=1e-6)


def test_a_point_next_to_another_does_not_turn_the_star_over():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((300, 2)), np.zeros(300)])
    twins = points[:30] + 1e-5 * np.array([1.0, 0.0, 0.0])
    graph = salcore.analyze(np.concatenate([points, twins])).graph
    assert all(graph.matrix().toarray()[range(30), range(300, 330)])


def test_equal_chains_keep_equal_bends():
    a = np.radians(60.0)
    one = np.array([[0, 0], [1, 0], [1 + np.cos(a), np.sin(a)], [1 + 2 * np.cos(a), 2 * np.sin(a)]])
    points = np.column_stack([np.tile(one, (1000, 1)), np.zeros(4000)])
    for seed in range(5):
        regions = Regions(
            np.zeros(4000, int), 1, np.ones(4000, bool), np.arange(4000),
            np.arange(0, 4001, 4), np.zeros(4000, bool),
        )  # fmt: skip
        kept = boundary_extremities(turned(points, seed), regions, 60.0).reshape(1000, 4)
        assert (kept == [True, True, False, True]).all()


@pytest.mark.parametrize("max_gap", [0, 1])
@pytest.mark.parametrize("rule", ["add", "multiply"])
def test_something_is_kept_of_something(max_gap, rule):
    parameters = P(max_gap=max_gap, alpha_rule=rule)
    for points in (sphere_cloud(500), bumpy(300), np.eye(3)[:1]):
        analysis = salcore.analyze(points, parameters=parameters)
        result = analysis.simplify(alpha=1000)
        assert len(result.indices) > 0
        assert (result.source >= 0).all()
        json.dumps(result.report.as_dict(), allow_nan=False)
    alone = salcore.simplify(sphere_cloud(500), alpha=1000, parameters=P(max_gap=0))
    saliency = salcore.analyze(sphere_cloud(500), parameters=P(coarsest=0.0)).saliency
    assert alone.indices.tolist() == [int(np.argmax(saliency))]


def figures(points, faces, **target):
    result = salcore.simplify(points, faces, **target)
    return result, np.array(dataclasses.astuple(result.report.errors.surface))


@pytest.mark.parametrize("target", [{"alpha": 10}, {"ratio": 0.3}, {"max_error": 0.02}])
@pytest.mark.parametrize("mesh", [True, False])
def test_powers_of_two_change_no_bit_of_the_report(target, mesh):
    points, faces = torus(20, 10) if mesh else (bumpy(200), None)
    one, first = figures(points, faces, **target)
    for exponent in (-1000, -600, -200, -40, 40, 180, 600, 1000):
        other, second = figures(np.ldexp(points, exponent), faces, **target)
        assert (one.indices == other.indices).all(), exponent
        assert (first == np.ldexp(second, -exponent)).all(), exponent


@pytest.mark.parametrize("unit", ["diagonal", "length"])
def test_errors_asked_for_at_any_size(unit):
    points, faces = torus(20, 10)
    bound, parameters = (0.05 if unit == "diagonal" else 0.1), P(error_unit=unit)
    one = salcore.simplify(points, faces, max_error=bound, parameters=parameters)
    assert len(one.indices) < len(points)
    for exponent in (-960, -40, 40, 960):
        same = np.ldexp(bound, exponent) if unit == "length" else bound
        sized = np.ldexp(points, exponent)
        other = salcore.simplify(sized, faces, max_error=same, parameters=parameters)
        assert (one.indices == other.indices).all(), exponent


@pytest.mark.parametrize("exponent", [-1030, -1060])
def test_extents_that_are_no_normal_doubles(exponent):
    points = np.ldexp(np.round(bumpy(200) * 2**10), exponent)
    result = salcore.simplify(points, ratio=0.5)
    assert len(result.indices) == 100
    assert result.report.welded == 0
    points, faces = torus(20, 10)
    result = salcore.simplify(np.ldexp(points, exponent), faces, ratio=0.5)
    json.dumps(result.report.as_dict(), allow_nan=False)


def test_the_least_difference_is_a_difference():
    points = np.array([[0.0, 0, 0], [5e-324, 0, 0], [0, 5e-324, 0], [0, 0, 0]])
    result = salcore.simplify(points, ratio=1.0)
    assert result.report.welded == 1
    assert result.source.tolist() == [0, 1, 2, 3]


def test_the_largest_extents():
    points = np.sign(np.random.default_rng(0).random((50, 3)) - 0.5) * 4e307
    points += np.random.default_rng(1).random((50, 3)) * 1e307
    report = salcore.simplify(points, ratio=0.5).report
    json.dumps(report.as_dict(), allow_nan=False)


def test_points_far_closer_than_their_squares_can_tell():
    tiny = np.array([[1e-200, 0, 0], [0, 1e-170, 0], [0, 0, 0], [1e-30, 1e-30, 0]])
    points = np.concatenate([bumpy(50) - 0.5, 0.5 - bumpy(50), tiny])
    result = salcore.simplify(points, ratio=0.5)
    assert len(result.indices) == 52


@pytest.mark.parametrize("factor", [1e-200, 1e-12, 1e12, 1e200])
@pytest.mark.parametrize("mesh", [True, False])
def test_compare_at_any_size(factor, mesh):
    points, faces = torus(20, 10) if mesh else (bumpy(200), None)
    other = points + 0.01 * np.sin(7 * points[:, ::-1])

    def measure(scale):
        errors = salcore.compare(
            salcore.make_surface(points * scale, faces), salcore.make_surface(other * scale, faces)
        )
        return np.array([*dataclasses.astuple(errors.surface), errors.point_back.rms]) / scale

    assert measure(factor) == pytest.approx(measure(1.0), rel=1e-6)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("target", [{"alpha": 10}, {"ratio": 0.2}, {"max_error": 0.01}])
def test_an_offset_changes_nothing_but_the_last_digits(scale, target):
    # Coordinates of few digits, so that the offset rounds nothing away.
    points = np.round(bumpy(400) * 2**20) * scale
    moved = points + 1e7 * scale * np.array([1.0, -1.0, 0.5])
    same = moved - 1e7 * scale * np.array([1.0, -1.0, 0.5])
    one, other = salcore.simplify(same, **target), salcore.simplify(moved, **target)
    assert (one.indices == other.indices).all()
    a, b = one.report.errors, other.report.errors
    assert b.surface.max == pytest.approx(a.surface.max, rel=1e-6)
    assert b.diagonal == pytest.approx(a.diagonal)


def test_a_tiny_threshold_does_not_overflow():
    for threshold in (1e-308, 5e-324):
        assert deviating(np.array([0.0, 10.0]), threshold, "ramp").tolist() == [0, 1]
    salcore.analyze(bumpy(50), parameters=P(deviation_threshold=1e-308))


def test_fitted_normals_have_no_sign_whatever_is_asked():
    points = turned(bumpy(300))
    first = salcore.analyze(points, parameters=P(angle="oriented"))
    second = salcore.analyze(points, parameters=P(angle="unoriented"))
    assert (first.saliency == second.saliency).all()


def deviations(analysis):
    edges, frames = analysis.graph.edges(0, len(analysis.saliency)), analysis.frames
    return edge_deviation(edges, frames.normals, frames.oriented, analysis.parameters)


def test_given_signs_count_where_asked_even_if_they_disagree():
    points, _ = grid(9, 9)
    normals = np.tile([0.0, 0.0, 1.0], (81, 1))
    normals[::2] *= -1.0
    asked = salcore.analyze(points, normals=normals, parameters=P(angle="oriented"))
    auto = salcore.analyze(points, normals=normals)
    assert deviations(asked).max() == 50.0
    assert deviations(auto).max() == 0.0


@pytest.mark.parametrize("target", [{"alpha": 20}, {"ratio": 0.2}, {"max_error": 0.01}])
def test_the_fraction_of_both_steps_goes_once_from_0_to_1(target):
    seen = []
    salcore.simplify(bumpy(500), **target, progress=lambda _, fraction: seen.append(fraction))
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0.0, 1.0)


def test_errors_are_measured_once():
    result = salcore.simplify(bumpy(300), ratio=0.2)
    errors = result.measure()
    assert result.measure() is result.errors is errors
    assert result.report.errors is errors


def test_twins_that_qhull_takes_for_a_lack_of_memory():
    rng = np.random.default_rng(0)
    for seed in range(100):
        points = turned(np.repeat(rng.random((3, 3)), 2, axis=0), seed)
        points[::2] += 1e-14
        result = salcore.simplify(points, alpha=0, parameters=P.preset("paper"))
        assert (result.source >= 0).all()
