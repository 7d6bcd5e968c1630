# SPDX-License-Identifier: GPL-3.0-or-later
"""What each pixel of a picture sees."""

import numpy as np
import pytest

from meshlab_filter.cli import raster
from meshlab_filter.cli.picture import shaded
from meshlab_filter.cli.raster import visible

SQUARE = np.array([[0, 0, 1], [8, 0, 1], [8, 6, 1], [0, 6, 1]], dtype=float)
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def test_two_faces_cover_a_rectangle_without_a_gap():
    seen, weights = visible(SQUARE, TWO, (8, 10))
    assert (seen[:6, :8] >= 0).all()
    assert (seen[6:] == -1).all()
    assert (seen[:, 8:] == -1).all()
    assert seen[0, 7] == 0
    assert seen[5, 0] == 1
    corners = SQUARE[TWO[seen[:6, :8]]]
    places = np.einsum("ijk,ijkd->ijd", weights[:6, :8], corners)
    rows, columns = np.mgrid[:6, :8] + 0.5
    np.testing.assert_allclose(places[..., 0], columns)
    np.testing.assert_allclose(places[..., 1], rows)


def test_the_nearer_face_is_seen_whatever_the_order_and_where_they_cross():
    far = SQUARE - [0, 0, 3]
    slope = SQUARE + np.array([0, 0, 1]) * np.array([[-2], [2], [2], [-2]])
    points = np.concatenate([far, SQUARE, slope])
    for order in (np.arange(6), np.arange(6)[::-1]):
        faces = np.concatenate([TWO, TWO + 4, TWO + 8])[order]
        seen, _ = visible(points, faces, (6, 8))
        layer = order[seen] // 2
        assert (layer[:, :4] == 1).all()
        assert (layer[:, 4:] == 2).all()


def test_blocks_do_not_matter(monkeypatch):
    rng = np.random.default_rng(0)
    points = rng.uniform(-10, 50, (300, 3))
    faces = rng.integers(0, 300, (400, 3))
    whole = visible(points, faces, (40, 40))
    monkeypatch.setattr(raster, "BLOCK", 500)
    parts = visible(points, faces, (40, 40))
    np.testing.assert_array_equal(whole[0], parts[0])
    np.testing.assert_array_equal(whole[1], parts[1])


@pytest.mark.parametrize("faces", [np.empty((0, 3), int), [[0, 0, 1]], [[0, 1, 1]]])
def test_faces_without_area_are_not_seen(faces):
    assert (visible(SQUARE, np.array(faces), (6, 8))[0] == -1).all()


def test_a_mesh_is_as_bright_from_behind_and_its_edges_are_darker():
    grey = np.full((4, 3), 0.5)
    front = shaded(SQUARE * 10, TWO, grey, (60, 80))
    np.testing.assert_allclose(front, shaded(SQUARE * 10, TWO[:, ::-1], grey, (60, 80)))
    edged = shaded(SQUARE * 10, TWO, grey, (60, 80), edges=True)
    assert edged[0, 40].sum() < front[0, 40].sum()
    np.testing.assert_allclose(edged[10, 40], front[10, 40])
