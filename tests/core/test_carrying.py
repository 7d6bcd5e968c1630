# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of points and corners go along with a simplification."""

import numpy as np
from shapes import grid

import salcore


def wavy():
    """Return a wavy sheet."""
    points, faces = grid(30, 30)
    points[:, 2] = np.sin(points[:, 0] / 3) * np.cos(points[:, 1] / 4)
    return points, faces


def test_points_that_stay_keep_every_bit():
    points, faces = wavy()
    result = salcore.simplify(points, faces, ratio=0.2)
    rng = np.random.default_rng(0)
    for values in (rng.random(900), rng.integers(0, 9, (900, 2)), rng.random((900, 3)) > 0.5):
        kept = salcore.carry_points(result, values, faces)
        assert kept.dtype == values.dtype
        np.testing.assert_array_equal(kept, values[result.indices])


def test_points_that_move_take_what_the_original_has_there():
    points, faces = wavy()
    parameters = salcore.Parameters(placement="optimal")
    result = salcore.simplify(points, faces, parameters=parameters, ratio=0.1)
    east = salcore.carry_points(result, points[:, 0].astype(np.float32), faces)
    assert east.dtype == np.float32
    moved = np.abs(points[result.indices, 0] - result.positions[:, 0])
    assert np.abs(east - result.positions[:, 0]).mean() < 0.3 * moved.mean()
    colors = np.round(8 * points[:, :2]).astype(np.uint8)
    shown = salcore.carry_points(result, colors, faces)
    assert shown.dtype == np.uint8
    assert np.abs(shown / 8 - result.positions[:, :2]).mean() < 0.1
    labels = np.arange(len(points))
    np.testing.assert_array_equal(
        salcore.carry_points(result, labels, faces), labels[result.indices]
    )


def test_corners_go_along():
    points, faces = wavy()
    texture = points[faces][:, :, :2].astype(np.float32)
    stays = salcore.simplify(points, faces, ratio=0.1, corner_values=texture)
    kept = salcore.carry_corners(stays, texture)
    np.testing.assert_array_equal(kept, texture.reshape(-1, 2)[stays.face_corners])
    parameters = salcore.Parameters(placement="optimal")
    moves = salcore.simplify(points, faces, parameters=parameters, ratio=0.1)
    places = moves.positions[moves.faces][:, :, :2]
    assert np.abs(salcore.carry_corners(moves, texture) - places).mean() < 0.05
