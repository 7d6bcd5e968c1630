# SPDX-License-Identifier: GPL-3.0-or-later
"""What a surface can bear, kind by kind."""

import numpy as np
import pytest

from salcore.arrays.edges import find_edges
from salcore.decimation.legality import (
    BORDER,
    COMPLEX,
    KINDS,
    LINKED,
    MANIFOLD,
    MANY,
    classify,
    conflicting,
    legal,
    seam_factors,
    turned_over,
    would_break_seam,
)
from salcore.decimation.one_rings import OneRings

HEXAGON = np.array([[np.cos(a), np.sin(a), 0] for a in np.arange(6) * np.pi / 3])
WHEEL = np.concatenate([np.zeros((1, 3)), HEXAGON]), [(0, k + 1, (k + 1) % 6 + 1) for k in range(6)]
TETRAHEDRON = np.eye(4)[:, :3], [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]
BOOK = (  # three pages along edge 0-1
    np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1.0]]),
    [(0, 1, 2), (1, 0, 3), (0, 1, 4)],
)


def surface(faces, links=()):
    """Return the sources of half-edges, the corners, the degrees, and the number of vertices."""
    faces = np.array(faces, dtype=np.int32).reshape(-1, 3)
    count = int(max(faces.max(initial=0), *(end for link in links for end in link), 0)) + 1
    edges = find_edges(faces, count)
    links = np.array(links, dtype=np.int32).reshape(-1, 2)
    low, high = np.append(edges.low, links[:, 0]), np.append(edges.high, links[:, 1])
    source = np.concatenate([low, high])
    corners = [np.ascontiguousarray(corner) for corner in faces.T]
    return source, corners, np.bincount(source), count


def rings_of(faces, *pairs, links=()):
    """Return the one-rings of collapses between pairs of vertices, and the degrees."""
    source, corners, degree, count = surface(faces, links)
    target = np.roll(source, len(source) // 2)
    half = [int(np.flatnonzero((source == a) & (target == b))[0]) for a, b in pairs]
    return OneRings.find(np.array(half), source, corners, count), degree


def may(shape, pair, links=()):
    points, faces = shape
    rings, degree = rings_of(faces, pair, links=links)
    return bool(legal(rings, points, degree)[0])


@pytest.mark.parametrize(
    ("faces", "links", "pair", "kind"),
    [
        (WHEEL[1], [], (0, 1), MANIFOLD),
        (WHEEL[1], [], (1, 2), BORDER),
        (BOOK[1], [], (0, 1), BORDER),
        ([*BOOK[1], (0, 3, 4)], [], (0, 1), MANIFOLD),
        ([(0, 1, 2), (0, 3, 4)], [], (0, 1), COMPLEX),
        ([], [(0, 1), (0, 2)], (0, 1), LINKED),
        ([], [(0, 1)], (0, 1), BORDER),
    ],
)
def test_kinds(faces, links, pair, kind):
    assert classify(rings_of(faces, pair, links=links)[0]).tolist() == [kind]


def test_the_table_of_kinds():
    assert KINDS[MANIFOLD].tolist() == [2, 2, 3]
    assert KINDS[BORDER].tolist() == [1, 1, 2]
    assert KINDS[LINKED].tolist() == [0, 0, 0]
    assert KINDS[COMPLEX].tolist() == [1, MANY, 0]


def test_inner_vertices_go_anywhere_and_border_vertices_along_the_border():
    assert may(WHEEL, (0, 1))
    assert may(WHEEL, (1, 2))
    assert not may(WHEEL, (1, 0))  # off the border


def test_a_border_is_not_pinched():
    # A strip of two squares: 1-4 joins its two borders.
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.0]])
    strip = points, [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)]
    assert not may(strip, (1, 4))
    assert may(strip, (1, 2))


def test_the_smallest_surfaces_stay():
    assert not may(TETRAHEDRON, (0, 1))
    assert not may((TETRAHEDRON[0], [(0, 1, 2)]), (0, 1))


def test_a_tunnel_is_not_closed():
    # A tube of three sides: its ring 0 1 2 is no face, so vertex 0 shares 2 neighbours too many.
    angle = np.arange(3) * 2 * np.pi / 3
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([np.column_stack([ring, np.full(3, z)]) for z in (0.0, 1.0, 2.0)])
    faces = []
    for low in (0, 3):
        for k in range(3):
            a, b = low + k, low + (k + 1) % 3
            faces += [(a, b, b + 3), (a, b + 3, a + 3)]
    assert not may((points, faces), (3, 4))
    assert not may((points, faces), (0, 1))


def test_no_link_where_faces_hold_and_any_link_elsewhere():
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    assert may((points, []), (1, 0), links=[(0, 1), (1, 2)])
    far = np.concatenate([WHEEL[0], [[9.0, 0, 0]]])
    assert not may((far, WHEEL[1]), (0, 7), links=[(0, 7)])


@pytest.mark.parametrize(("degrees", "over"), [(0, False), (77, False), (79, True), (180, True)])
def test_a_face_turns_over_at_78_degrees(degrees, over):
    a = np.radians(degrees)
    before, after = np.array([[2.0, 0, 0]]), np.array([[0.3 * np.cos(a), 0.3 * np.sin(a), 0]])
    assert turned_over(before, after).tolist() == [over]
    assert turned_over(before, 0 * after).tolist() == [True]


def test_no_face_is_turned_over():
    points, faces = WHEEL[0].copy(), WHEEL[1]
    points[2] = [0.1, 0.1, 0]  # the rim is dented: face 0 2 3 would turn over at 1, not at 4
    assert not may((points, faces), (0, 1))
    assert may((points, faces), (0, 4))


def test_a_face_of_no_area_may_grow():
    points, faces = WHEEL[0].copy(), WHEEL[1]
    points[0] = (points[1] + points[2]) / 2  # face 0 1 2 has no area
    assert may((points, faces), (0, 4))
    assert may((points, faces), (0, 1))


def test_conflicts_leave_the_cheapest():
    # Vertices 0, 1 and 2 lie between 3 and 4 each; all go into 3, and would make edge 3-4.
    faces = [(0, 3, 5), (0, 5, 4), (1, 3, 6), (1, 6, 4), (2, 3, 7), (2, 7, 4)]
    rings, _ = rings_of(faces, (2, 3), (0, 3), (1, 3))
    assert conflicting(rings, np.array([True, True, True])).tolist() == [False, True, True]
    assert conflicting(rings, np.array([False, True, True])).tolist() == [False, False, True]
    assert not conflicting(rings, np.array([False, False, True])).any()


def test_a_hole_of_three_is_not_closed_from_both_sides():
    # Two tetrahedra glued along the triangle 1 2 3, which is no face: tops 0 and 4.
    faces = [(0, 1, 2), (0, 2, 3), (0, 3, 1), (4, 2, 1), (4, 3, 2), (4, 1, 3)]
    rings, _ = rings_of(faces, (0, 1), (4, 2))
    assert conflicting(rings, np.array([True, True])).tolist() == [False, True]


def test_seams_are_not_laid_upon_edges():
    rings, _ = rings_of(WHEEL[1], (0, 1))
    edges = find_edges(np.array(WHEEL[1]), 7)
    pairs = list(zip(edges.low.tolist(), edges.high.tolist(), strict=True))
    for pair, broken in (((0, 2), True), ((0, 6), True), ((0, 1), False), ((0, 4), False)):
        seam = np.array([pair == other for other in pairs])
        assert would_break_seam(rings, seam).tolist() == [broken]


def test_factors_on_seams():
    seams = np.array([0, 0, 1, 1, 2, 2, 3, 3])
    along = np.array([False, True] * 4)
    assert seam_factors(seams, along).tolist() == [1, 1, 10, 10, 10, 1, 10, 10]
