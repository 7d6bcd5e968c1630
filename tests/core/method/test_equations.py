# SPDX-License-Identifier: GPL-3.0-or-later
"""Every numbered equation of the paper against values worked out by hand."""

import numpy as np
import pytest

import salcore
from salcore import method
from salcore.input.geometry import clean
from salcore.measure.errors import Deviation
from salcore.method.frames import build_frames, principal_directions
from salcore.method.graph import build_graph
from salcore.method.interest import (
    boundary_extremities,
    gap_fillers,
    global_mean,
    local_means,
    salient_points,
    triangle_areas,
)
from salcore.method.patches import (
    deviation_factor,
    mean_of_cells,
    normal_angle,
    patch_cells,
    patch_side,
)
from salcore.method.planes import covariance, fit_normals, mean_offset
from salcore.method.regions import Regions, similar
from salcore.method.saliency import (
    deviating,
    entropy,
    patch_saliency,
    scale_saliency,
    similarity,
    vertex_saliency,
)

X, Y, Z = np.eye(3)
BOTH = np.array([True])


def regions_of(labels, boundary=None, chains=(), offsets=(0,)):
    labels = np.asarray(labels)
    boundary = np.zeros(len(labels), bool) if boundary is None else np.asarray(boundary)
    return Regions(
        labels,
        labels.max() + 1,
        boundary,
        np.array(chains, dtype=np.intp),
        np.array(offsets, dtype=np.intp),
        np.zeros(len(labels), bool),
    )


def test_2_1_and_2_2_plane_of_a_cross():
    # Neighbours (±2, 0, 0) and (0, ±1, 0): mean 0, covariance diag(8, 2, 0).
    spread = np.diag([8.0, 2.0, 0.0])[None]
    assert np.abs(fit_normals(spread)[0]) == pytest.approx(Z)


def test_2_1_and_2_2_mean_and_covariance():
    offsets = np.array([[2.0, 0, 0], [0, 2, 0], [4, 4, 0], [1, 1, 1]])
    row, indptr = np.array([0, 0, 0, 1]), np.array([0, 3, 4, 4])
    assert mean_offset(offsets, indptr).tolist() == [[2, 2, 0], [1, 1, 1], [0, 0, 0]]
    # Offsets from the mean: (0, -2), (-2, 0), (2, 2).
    assert covariance(offsets, row, indptr)[0].tolist() == [[8, 4, 0], [4, 8, 0], [0, 0, 0]]
    assert not covariance(offsets, row, indptr)[1:].any()


def test_2_2_principal_directions_of_a_cross():
    points = np.array([[0, 0, 0], [2, 0, 0], [-2, 0, 0], [0, 1, 0], [0, -1, 0]], float)
    faces = np.array([[0, 1, 3], [0, 3, 2], [0, 2, 4], [0, 4, 1]])
    geometry = clean(points, faces)
    parameters = salcore.Parameters()
    graph = build_graph(geometry, parameters)
    frames = build_frames(geometry, graph, parameters)
    assert frames.normals[0] == pytest.approx(Z)
    edges = graph.edges(0, 1)
    offsets = geometry.points[edges.other] - geometry.points[0]
    minor, major = principal_directions(offsets, frames.normals[:1], edges.local, edges.indptr)
    assert np.abs(minor[0]) == pytest.approx(Y)
    assert np.abs(major[0]) == pytest.approx(X)
    assert frames.radius[0] / geometry.to_unit == pytest.approx(2.0)  # (3.5)


def test_2_2_collinear_neighbours_have_no_normal():
    assert not fit_normals(np.diag([5.0, 0.0, 0.0])[None]).any()


def test_3_1_side_is_twice_the_farthest_projection():
    u, v = np.array([3.0, 0.0]), np.array([4.0, 1.0])
    assert patch_side(u, v, np.array([0, 2])) == pytest.approx([10.0])


def test_3_1_lattice_of_four_cells():
    u = np.array([-1.0, 1.0, -0.2, 0.9])
    v = np.array([-1.0, -1.0, 0.2, 1.0])
    assert patch_cells(u, v, np.full(4, 2.0), 2).tolist() == [0, 1, 2, 3]


def test_3_1_descriptor_is_the_mean_of_filled_cells():
    # Two neighbours share a cell (mean 3), one fills another (8); two cells stay empty.
    mean = mean_of_cells(
        np.array([2.0, 4.0, 8.0]), np.array([0, 0, 3]), np.zeros(3, int), np.array([0, 3]), 2
    )
    assert mean == pytest.approx([5.5])


@pytest.mark.parametrize(
    ("second", "oriented", "squared", "degrees"),
    [
        (Z, True, False, 0.0),
        (X, True, False, 90.0),
        (-Z, True, False, 180.0),
        (-Z, False, False, 0.0),
        ((X + Z) / np.sqrt(2), True, False, 45.0),
        ((X + Z) / np.sqrt(2), False, True, 60.0),  # arccos of 1/2
        (0 * Z, True, False, 0.0),
    ],
)
def test_3_2_angle(second, oriented, squared, degrees):
    angle = normal_angle(Z[None], second[None], np.array([oriented]), squared=squared)
    assert angle == pytest.approx([degrees])


def test_3_2_keeps_small_angles():
    tilted = np.array([[np.sin(1e-6), 0.0, np.cos(1e-6)]])
    assert normal_angle(Z[None], tilted, BOTH) == pytest.approx([np.degrees(1e-6)])


def test_3_3_deviation_factor():
    angle = np.array([0.0, 36.0, 40.0, 180.0])
    assert deviation_factor(angle) == pytest.approx([0.0, 10.0, 100 / 9, 50.0])
    assert deviation_factor(angle, whole_percent=True).tolist() == [0, 10, 11, 50]


def test_3_4_similarity():
    def weigh(curvature, scale, difference, deviation):
        return similarity(*(np.array([v]) for v in (curvature, scale, difference, deviation)))[0]

    assert weigh(2.0, 0.5, 50.0, 10.0) == pytest.approx(np.exp(-0.05))
    assert weigh(-2.0, 0.5, -50.0, 10.0) == pytest.approx(np.exp(-0.05))
    assert weigh(2.0, 0.5, 50.0, 0.0) == pytest.approx(np.exp(-0.5))  # no 0/0 for equal normals
    assert weigh(2.0, 0.0, 50.0, 10.0) == 1.0


def test_3_6_share_of_deviating_neighbours():
    factors = np.array([0.0, 4.5, 9.0, 12.0])
    assert deviating(factors, 9.0, "step").tolist() == [0, 0, 0, 1]
    assert deviating(factors, 9.0, "ramp").tolist() == [0, 0.5, 1, 1]
    assert deviating(factors, 0.0, "ramp").tolist() == [0, 1, 1, 1]


def test_3_7_entropy():
    assert entropy(np.array([0.0, 0.25, 0.5, 1.0])) == pytest.approx([0.0, 0.5, 0.5, 0.0])


def test_3_8_and_3_9_on_a_roof():
    # A star of four: one neighbour deviates by 90 degrees, DF = 25, so each share is known.
    points = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0.0]])
    faces = np.array([[0, 1, 3], [0, 3, 2], [0, 2, 4], [0, 4, 1]])
    normals = np.array([Z, X, Z, Z, Z])
    parameters = salcore.Parameters(scaling="range", averaging="plain")
    parts = salcore.analyze(points, faces, normals, parameters).saliency_map
    # Vertex 0: one of four. Vertex 1 (neighbours 0, 3, 4): all. Vertex 2 (0, 3, 4): none.
    # Vertices 3 and 4 (neighbours 0, 1, 2): one of three.
    share = np.array([1 / 4, 1, 0, 1 / 3, 1 / 3])
    assert parts.dissimilarity == pytest.approx(share)
    patch = [
        (share[1] + share[2] + share[3] + share[4]) / 4,
        (share[0] + share[3] + share[4]) / 3,
        (share[0] + share[3] + share[4]) / 3,
        (share[0] + share[1] + share[2]) / 3,
        (share[0] + share[1] + share[2]) / 3,
    ]
    assert parts.patch == pytest.approx(patch)
    # Only at vertex 1 do neighbours leave the plane of the normal: heights -1 at distances 1, √2
    # and √2 give K = -(2 + 1 + 1)/3. Descriptors: A_1 = 25, A_0 = 25/4, A_3 = A_4 = 25/3.
    product = 4 / 3 * np.sqrt(2)
    to_0 = np.exp(-product * (25 - 25 / 4) / 100 / 25)
    to_3 = np.exp(-product * (25 - 25 / 3) / 100 / 25)
    raw = [
        (to_0 * patch[1] + patch[2] + patch[3] + patch[4]) / 4,
        (patch[0] + patch[3] + patch[4]) / 3,
        (patch[0] + patch[3] + patch[4]) / 3,
        (patch[0] + to_3 * patch[1] + patch[2]) / 3,
        (patch[0] + to_3 * patch[1] + patch[2]) / 3,
    ]
    assert parts.raw == pytest.approx(raw)


def test_3_8_as_printed_weighs_by_height():
    # The apex is 1 above the plane z = 0 in which its neighbours' normals lie along z.
    points = np.array([[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0.0]])
    faces = np.array([[0, 1, 3], [0, 3, 2], [0, 2, 4], [0, 4, 1]])
    normals = np.array([Z, X, X, X, X])
    parameters = salcore.Parameters(
        contrast="difference", counting="step", scaling="range", averaging="plain"
    )
    analysis = salcore.analyze(points, faces, normals, parameters)
    parts, scale = analysis.saliency_map, analysis.frames.radius.mean()
    # Shares: the apex sees 4 of 4 deviate; each other vertex sees only the apex, 1 of 3.
    assert parts.dissimilarity == pytest.approx([1, 1 / 3, 1 / 3, 1 / 3, 1 / 3])
    height = 1.0 * analysis.geometry.to_unit / scale
    assert parts.patch[0] == pytest.approx((1 - 1 / 3) * height)


def test_3_8_level_and_difference():
    own, other = np.array([0.5, 0.5, 0.0]), np.array([0.25, 1.0, 0.5])
    indptr = np.array([0, 2, 3, 3])
    assert patch_saliency(own, other, indptr).tolist() == [0.625, 0.5, 0.0]
    height = np.array([1.0, 2.0, 4.0])
    # (0.25 · 1 + 0.5 · 2) / 2 and 0.5 · 4, in units of 2.
    assert patch_saliency(own, other, indptr, height, 2.0).tolist() == [0.3125, 1.0, 0.0]


def test_3_9_weighted_and_plain():
    patch, weight = np.array([1.0, 2.0, 3.0]), np.array([0.5, 1.0, 0.0])
    indptr = np.array([0, 2, 3, 3])
    assert vertex_saliency(patch, weight, indptr, "plain").tolist() == [1.25, 0.0, 0.0]
    weighted = vertex_saliency(patch, weight, indptr, "weighted")
    assert weighted == pytest.approx([2.5 / 1.5, 0.0, 0.0])


def test_every_equation_has_a_function_that_names_it():
    numbers = [f"2.{k}" for k in (1, 2)] + [f"3.{k}" for k in range(1, 10)]
    assert list(method.EQUATIONS) == numbers + [f"4.{k}" for k in range(1, 8)]
    for number, function in method.EQUATIONS.items():
        assert f"({number})" in function.__doc__, function
        assert f"({number})" in method.__doc__
        assert f".{function.__name__}`" in method.__doc__


def test_3_9_scaling():
    assert scale_saliency(np.array([2.0, 3.0, 4.0]), "range").tolist() == [0, 0.5, 1]
    assert scale_saliency(np.array([2.0, 2.0]), "range").tolist() == [0, 0]
    values = np.linspace(0.0, 1.0, 101)
    assert scale_saliency(values, "percentile")[[0, 1, 50, 99, 100]] == pytest.approx(
        [0, 0, 0.5, 1, 1]
    )
    # Hardly anything stands out: the spread is not stretched.
    assert scale_saliency(0.01 * values, "percentile").max() == pytest.approx(0.0396)


def test_4_1_similar():
    assert similar(np.array([0.1, 0.1]), np.array([0.2, 0.3]), 0.15).tolist() == [True, False]


def test_4_3_and_4_4_areas():
    a, b = np.zeros((2, 3)), np.array([[4.0, 0, 0], [1, 1, 1]])
    c = np.array([[0, 3.0, 0], [2, 2, 2]])
    assert triangle_areas(a, b, c).tolist() == [6.0, 0.0]


def test_4_4_extremities_of_a_bent_chain():
    points = np.array([[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 2.0]])
    points = np.column_stack([points, np.zeros(6)])
    regions = regions_of([0] * 6, [True] * 6, range(6), [0, 6])
    for angle in (0.0, 30.0, 60.0):
        keep = boundary_extremities(points, regions, angle)
        assert keep.tolist() == [True, False, False, True, False, True]
    keep = boundary_extremities(points, regions, 120.0)
    assert keep.tolist() == [True] + 4 * [False] + [True]


def test_4_4_a_slow_bend_keeps_a_vertex_for_every_tolerance():
    angle = np.radians(np.arange(0.0, 181.0, 5.0))
    points = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    regions = regions_of([0] * 37, [True] * 37, range(37), [0, 37])
    kept = np.flatnonzero(boundary_extremities(points, regions, 30.0))
    assert kept[0] == 0
    assert kept[-1] == 36
    assert np.diff(kept).max() <= 7
    assert len(kept) <= 8


def test_4_5_and_4_6_means():
    saliency = np.array([0.0, 0.2, 0.4, 0.8])
    assert local_means(saliency, regions_of([0, 0, 1, 1])) == pytest.approx([0.1, 0.6])
    assert global_mean(saliency) == pytest.approx(0.35)


def test_4_7_interest():
    saliency = np.array([0.0, 0.2, 0.4, 0.8])
    regions = regions_of([0, 0, 1, 1])  # thresholds at alpha 0: 0.1 and 0.35
    assert salient_points(saliency, regions, 0.0, "add").tolist() == [False, True, True, True]
    assert salient_points(saliency, regions, 15.0, "add").tolist() == [False, False, False, True]
    # Multiplied by 2.2: 0.22 and 0.77.
    assert salient_points(saliency, regions, 120.0, "multiply").tolist() == 3 * [False] + [True]


def test_4_7_equal_saliency_is_not_below_its_own_mean():
    saliency = np.full(7, 0.1)
    assert salient_points(saliency, regions_of([0] * 7), 0.0, "add").all()


def test_gap_rule_keeps_the_low_point_nearest_to_the_midpoint():
    # Region 0: salient point at x = 8, boundary point at x = 0, so the midpoint is x = 4.
    # The low point of region 1 is nearer, but of another region.
    x = np.array([0.0, 8.0, 3.0, 6.0, 4.1])
    points = np.column_stack([x, 0 * x, 0 * x]) / 16
    regions = regions_of([0, 0, 0, 0, 1])
    edge = np.array([True, False, False, False, False])
    salient = np.array([False, True, False, False, False])
    fillers = gap_fillers(points, regions, edge, salient)
    assert fillers.tolist() == [False, False, True, False, False]


def test_gap_rule_without_salient_points_uses_the_region():
    x = np.array([0.0, 2.0, 4.0, 10.0])  # mean 4, midpoint 2
    points = np.column_stack([x, 0 * x, 0 * x]) / 16
    edge = np.array([True, False, False, False])
    fillers = gap_fillers(points, regions_of([0, 0, 0, 0]), edge, np.zeros(4, bool))
    assert fillers.tolist() == [False, True, False, False]


def test_5_1_and_5_2_errors():
    deviation = Deviation.of(np.array([0.0, 3.0, 4.0, 1.0]))
    assert (deviation.max, deviation.mean) == (4.0, 2.0)
    assert deviation.rms == pytest.approx(np.sqrt(26 / 4))
