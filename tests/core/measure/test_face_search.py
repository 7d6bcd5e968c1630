# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest face against every face looked at, and the work that it costs."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from salcore.arrays.blocks import set_workers
from salcore.errors import Cancelled
from salcore.measure import face_search
from salcore.measure.bounding_boxes import build_boxes, children, cut_long_triangles
from salcore.measure.distances import (
    Surface,
    distances,
    nearest_points,
    surface_distances,
    triangle_distances,
)
from salcore.progress import Progress


def turn(rng):
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


def fan(rng, count, height=0.0):
    """Return a fan, or with a height a cone, of triangles round one point."""
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    points = np.concatenate([[[0.0, 0.0, height]], rim]) @ turn(rng)
    spoke = np.arange(count)
    return points[np.column_stack([np.zeros(count, int), 1 + spoke, 1 + (spoke + 1) % count])]


def slivers(rng, count, aspect):
    along, across = rng.normal(size=(2, count, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    across = np.cross(along, across)
    across /= np.linalg.norm(across, axis=1)[:, None] * aspect
    start, share = rng.random((count, 3)), rng.random((count, 1))
    return np.stack([start, start + along, start + share * along + across], axis=1)


def strip(rng, count, width):
    x = np.linspace(0, 1, count + 2)
    points = np.column_stack([x, width * (np.arange(count + 2) % 2), 0 * x]) @ turn(rng)
    return points[np.arange(count)[:, None] + np.arange(3)]


def without_area(rng, count):
    corners = rng.random((count, 3, 3))
    share = rng.random((count, 1))
    corners[:, 2] = corners[:, 0] + share * (corners[:, 1] - corners[:, 0])
    corners[::3, 2] = corners[::3, 1]
    corners[::5] = corners[::5, :1]
    return corners


def doubled(rng, count):
    corners = rng.random((count, 3, 3))
    return np.concatenate([corners, corners[:, ::-1], corners])


def plate_and_scan(rng, count):
    plate = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]) @ turn(rng)
    small = rng.random((count, 1, 3)) + 0.01 * rng.normal(size=(count, 3, 3))
    return np.concatenate([plate[[[0, 1, 2], [0, 2, 3]]], small])


SHAPES = {
    "fan": lambda rng, n: fan(rng, n + 2),
    "cone": lambda rng, n: fan(rng, n + 2, rng.random()),
    "slivers": lambda rng, n: slivers(rng, n, 10.0 ** rng.integers(3, 7)),
    "strip": lambda rng, n: strip(rng, n, 10.0 ** -rng.integers(0, 7)),
    "without area": without_area,
    "doubled": doubled,
    "plate and scan": plate_and_scan,
    "any": lambda rng, n: rng.random((n, 3, 3)),
    "single": lambda rng, n: rng.random((1, 3, 3)),
}
SCALES = {"near": 1e-3, "on": 0.0, "about": 1.0, "far": 1e3}


def queries_at(rng, corners, count, away):
    weights = rng.dirichlet([1, 1, 1], count)
    there = corners[rng.integers(len(corners), size=count)]
    return np.einsum("qk,qkd->qd", weights, there) + away * rng.normal(size=(count, 3))


def by_brute_force(queries, corners):
    pairs = np.repeat(queries, len(corners), axis=0), np.tile(corners, (len(queries), 1, 1))
    return triangle_distances(*pairs).reshape(len(queries), -1).min(axis=1)


def as_surface(corners):
    return Surface(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def measured(queries, corners):
    surface = as_surface(corners)
    return surface_distances(queries, surface, nearest_points(queries, surface.points)[0])


@settings(deadline=None, max_examples=120)
@given(
    shapes=st.lists(st.sampled_from(sorted(SHAPES)), min_size=1, max_size=3),
    count=st.integers(1, 120),
    away=st.sampled_from(sorted(SCALES)),
    offset=st.sampled_from([0.0, 1e3]),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_mixture_measures_as_brute_force(shapes, count, away, offset, seed):
    rng = np.random.default_rng(seed)
    corners = offset + np.concatenate([SHAPES[name](rng, count) for name in shapes])
    queries = queries_at(rng, corners, 60, SCALES[away])
    expected = by_brute_force(queries, corners)
    # A box may leave out a face that is nearer by less than the coordinates' own rounding.
    rounding = 1e-15 * max(np.abs(corners).max(), np.abs(queries).max())
    np.testing.assert_allclose(measured(queries, corners), expected, rtol=1e-12, atol=rounding)


def exact_square(query, corners):
    """Return the squared distance of a point to a triangle in whole fractions."""

    def less(a, b):
        return [x - y for x, y in zip(a, b, strict=True)]

    def dot(a, b):
        return sum(x * y for x, y in zip(a, b, strict=True))

    def cross(a, b):
        return [a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)]

    query, corners = map(Fraction, query), [list(map(Fraction, corner)) for corner in corners]
    query = list(query)
    normal = cross(less(corners[1], corners[0]), less(corners[2], corners[0]))
    inside, squares = dot(normal, normal) > 0, []
    for k in range(3):
        edge, offset = less(corners[k - 2], corners[k]), less(query, corners[k])
        length = dot(edge, edge)
        share = min(max(dot(edge, offset) / length, 0), 1) if length else 0
        rest = less(offset, [share * x for x in edge])
        squares.append(dot(rest, rest))
        inside = inside and dot(cross(edge, offset), normal) >= 0
    if inside:
        return dot(less(query, corners[0]), normal) ** 2 / dot(normal, normal)
    return min(squares)


@pytest.mark.parametrize("aspect", [1e3, 1e6, 1e9])
@pytest.mark.parametrize("height", [0.0, 1e-3, 1.0])
def test_slivers_keep_all_digits(aspect, height):
    rng = np.random.default_rng(3)
    corners = slivers(rng, 60, aspect)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    inside = np.einsum("mk,mkd->md", rng.dirichlet([1, 1, 1], 60), corners)
    queries = inside + height * normals
    exact = [float(exact_square(*pair)) ** 0.5 for pair in zip(queries, corners, strict=True)]
    np.testing.assert_allclose(triangle_distances(queries, corners), exact, rtol=1e-12, atol=2e-15)


class Work:
    """Count the pairs of queries and boxes, and of queries and triangles, that are measured."""

    def __init__(self, monkeypatch):
        self.boxes = self.triangles = 0
        box_distances = face_search.Boxes.square_distances

        def count_boxes(boxes, points, which):
            self.boxes += len(which)
            return box_distances(boxes, points, which)

        def count_triangles(queries, corners):
            self.triangles += len(queries)
            return triangle_distances(queries, corners)

        monkeypatch.setattr(face_search.Boxes, "square_distances", count_boxes)
        monkeypatch.setattr(face_search, "triangle_distances", count_triangles)


def work_of(monkeypatch, corners, away, count=4000):
    queries = queries_at(np.random.default_rng(5), corners, count, away)
    with monkeypatch.context() as patch:
        work = Work(patch)
        with set_workers(1):  # so that no count gets lost between threads
            measured(queries, corners)
    return work.triangles / count, work.boxes / count


@pytest.mark.parametrize("height", [0.0, 0.5])
@pytest.mark.parametrize("away", [0.0, 1e-3])
def test_a_fan_of_many_triangles_costs_hardly_more_a_query(monkeypatch, height, away):
    rng = np.random.default_rng(1)
    few = work_of(monkeypatch, fan(rng, 500, height), away)
    many = work_of(monkeypatch, fan(rng, 20_000, height), away)
    assert many[0] < 8  # triangles a query, of 20 000
    assert many[1] < 5 * few[1]  # boxes a query, for forty times as many triangles


def test_a_plate_beside_a_scan_costs_no_more_than_the_scan(monkeypatch):
    corners = plate_and_scan(np.random.default_rng(1), 20_000)
    triangles, boxes = work_of(monkeypatch, corners, 1e-3)
    assert triangles < 8
    assert boxes < 200


def test_pieces_cover_their_triangles():
    rng = np.random.default_rng(4)
    corners = np.concatenate([slivers(rng, 20, 1e3), rng.random((20, 3, 3)) / 9])
    pieces, triangle = cut_long_triangles(corners, 400)
    assert 40 < len(pieces) <= 400

    def area(t):
        return np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) / 2

    np.testing.assert_allclose(np.bincount(triangle, area(pieces)), area(corners), rtol=1e-9)
    away = triangle_distances(pieces.reshape(-1, 3), np.repeat(corners[triangle], 3, axis=0))
    assert away.max() < 1e-15


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_boxes_hold_all_that_is_below_them(name):
    corners = SHAPES[name](np.random.default_rng(6), 300)
    levels = build_boxes(corners)
    assert len(levels[0].centres) == len(corners)
    assert len(levels[-1].centres) <= 8
    below = np.arange(len(corners))
    for boxes in levels:
        np.testing.assert_allclose(
            np.matmul(boxes.axes, boxes.axes.transpose(0, 2, 1)),
            np.broadcast_to(np.eye(3), boxes.axes.shape),
            atol=1e-12,
        )
        for k in range(3):
            assert boxes.square_distances(corners[:, k], below).max() == 0.0
        below = below // 8
    child, parent = children(np.array([0, 1]), 11)
    assert child.tolist() == list(range(11))
    assert parent.tolist() == [0] * 8 + [1] * 3


def test_a_cancel_answers_in_every_part():
    rng = np.random.default_rng(7)
    corners = fan(rng, 3000)
    queries, surface = queries_at(rng, corners, 40_000, 1e-2), as_surface(corners)
    told = []
    distances(queries, surface, Progress(lambda stage, share: told.append(share)))
    assert len(told) > 20
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)
    for stop in told[:: len(told) // 5]:
        with pytest.raises(Cancelled):
            distances(queries, surface, Progress(lambda stage, share, stop=stop: share < stop))
