# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole chains of equations followed by hand, in the printed reading and in ours."""

import dataclasses

import numpy as np
import pytest

import salcore
from salcore.input.geometry import clean
from salcore.method.graph import build_graph
from salcore.method.regions import build_regions, similar
from salcore.method.saliency import edge_deviation

# The corner of a cube cut off: O and one unit along each axis. All four are neighbours of each
# other, so a vertex's plane (2.1) (2.2) is that of the face opposite to it.
CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


@pytest.fixture
def printed():
    parameters = dataclasses.replace(salcore.Parameters.preset("paper"), deviation_threshold=20)
    return salcore.analyze(CORNER, parameters=parameters)


def test_2_1_and_2_2_planes_go_through_the_mean_of_the_neighbours(printed):
    # Spread about the vertex instead of the mean would tilt these: O lies off its plane.
    diagonal = np.full(3, 1 / np.sqrt(3))
    assert np.abs(printed.frames.normals) == pytest.approx(np.array([diagonal, *np.eye(3)]))


def test_3_2_and_3_3_as_printed(printed):
    # O to A: product 1/√3, squared 1/3, arccos 70.5°, 19.6 %, cut to 19. A to B: 90°, 25 %.
    edges, frames = printed.graph.edges(0, 4), printed.frames
    factors = edge_deviation(edges, frames.normals, frames.oriented, printed.parameters)
    assert factors.tolist() == [
        19,
        19,
        19,
        19,
        25,
        25,
        19,
        25,
        25,
        19,
        25,
        25,
    ]


def test_3_4_to_3_9_as_printed(printed):
    parts, frames = printed.saliency_map, printed.frames
    scale = printed.geometry.to_unit
    # (3.5): the farthest neighbour is 1 from O, √2 from A.
    assert frames.radius / scale == pytest.approx([1, *[np.sqrt(2)] * 3])
    # Heights over the planes give K = mean of 2h/d²: three of 2/√3, or -2, -1 and -1.
    assert np.abs(frames.curvature) * scale == pytest.approx([2 / np.sqrt(3), *[4 / 3] * 3])
    # A: each neighbour fills a cell of its own.
    assert parts.descriptor == pytest.approx([19, *[(19 + 25 + 25) / 3] * 3])
    # (3.6): above 20 are none of three, two of three; (3.7).
    entropy = -2 / 3 * np.log2(2 / 3)
    assert parts.dissimilarity == pytest.approx([0, *[entropy] * 3])
    # (3.8): O's neighbours are 1/√3 high over its plane and differ by the entropy; of A's, only O
    # differs, and is 1 high. Heights count in mean scales.
    mean_scale = (1 + 3 * np.sqrt(2)) / 4
    patch_o, patch_a = entropy / np.sqrt(3) / mean_scale, entropy / 3 / mean_scale
    assert parts.patch == pytest.approx([patch_o, *[patch_a] * 3])
    # (3.4): the descriptors differ by 4 per cent, the deviation factor is 19; (3.9).
    to_a = np.exp(-4 / 3 * np.sqrt(2) * 0.04 / 19)
    to_o = np.exp(-2 / np.sqrt(3) * 1 * 0.04 / 19)
    raw_a = (patch_o * to_o + 2 * patch_a) / 3
    assert parts.raw == pytest.approx([patch_a * to_a, *[raw_a] * 3])
    assert parts.scaled == pytest.approx([0, 1, 1, 1])


def test_3_9_weighted_mean():
    parameters = dataclasses.replace(
        salcore.Parameters.preset("paper"), deviation_threshold=20, averaging="weighted"
    )
    parts = salcore.analyze(CORNER, parameters=parameters).saliency_map
    to_o = np.exp(-2 / np.sqrt(3) * 0.04 / 19)
    patch_o, patch_a = parts.patch[:2]
    assert parts.raw[0] == pytest.approx(patch_a)  # equal neighbours: whatever the weight
    assert parts.raw[1] == pytest.approx((patch_o * to_o + 2 * patch_a) / (to_o + 2))


def test_3_1_members_of_a_cell_share_it():
    # Seen from O: A and B lie close together and share a cell of DF 0, C lies opposite, DF 25.
    points = np.array([[0, 0, 0], [1, 0.02, 0], [1, -0.02, 0], [-1, 0, 0.0]])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2]]
    normals = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0.0]])
    # An odd number of cells has a middle row, where A and B are.
    for cells, expected in ((1, 25 / 3), (3, 25 / 2), (7, 25 / 2), (31, 25 / 2)):
        parameters = salcore.Parameters(cells=cells)
        parts = salcore.analyze(points, faces, normals, parameters).saliency_map
        assert parts.descriptor[0] == pytest.approx(expected)


def path(count):
    """Return a strip of triangles: i is joined to i ± 1 and i ± 2."""
    points = np.column_stack([np.arange(float(count)), np.arange(count) % 2, np.zeros(count)])
    faces = np.arange(count - 2)[:, None] + [0, 1, 2]
    geometry = clean(points, faces)
    return geometry, build_graph(geometry, salcore.Parameters())


def test_4_1_and_4_2_similar_neighbours_and_the_regions_they_make():
    geometry, graph = path(6)
    saliency = np.array([0.10, 0.30, 0.16, 0.33, 0.90, 0.36])
    row, other = graph.rows(), graph.indices
    joined = similar(saliency[row], saliency[other], 0.0625)
    # C(0) = {2}, C(1) = {3}, C(3) = {1, 5}; 4 is like nobody.
    assert [set(other[joined & (row == i)].tolist()) for i in range(6)] == [
        {2}, {3}, {0}, {1, 5}, set(), {3},
    ]  # fmt: skip
    regions = build_regions(geometry, graph, saliency, 0.0625)
    assert regions.labels.tolist() == [0, 1, 0, 1, 2, 1]
    assert regions.boundary.all()


def test_4_1_the_tolerance_itself_is_similar():
    assert similar(np.array([0.25]), np.array([0.5]), 0.25).all()
    assert not similar(np.array([0.25]), np.array([0.5]), np.nextafter(0.25, 0)).any()


def test_4_7_on_a_flat_map_keeps_all_or_leaves_it_to_the_guard():
    # Saliency is 0 everywhere and reaches its own mean; a hair of α more, and nothing does.
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0))
    analysis = salcore.analyze(np.column_stack([x.ravel(), y.ravel(), np.zeros(81)]))
    assert len(analysis.simplify(alpha=0).indices) == 81
    few = analysis.simplify(alpha=0.001)
    assert not (few.interest.salient | few.interest.extremities | few.interest.fillers).any()
    assert 9 <= few.interest.guards.sum() == len(few.indices) <= 25
