# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces given on both sides: both stay, with shared points or with their own."""

import numpy as np
import pytest
from shapes import grid, torus

import salcore
from salcore.input.backs import find_backs


def both_sides(points, faces, own):
    """Return a mesh with every face twice, the second turned over."""
    if own:
        return np.concatenate([points, points]), np.concatenate(
            [faces, faces[:, ::-1] + len(points)]
        )
    return points, np.concatenate([faces, faces[:, ::-1]])


def oriented(points, result):
    """Return the faces as sorted rows of places, each beginning with its least corner."""
    _, place = np.unique(points[result.indices], axis=0, return_inverse=True)
    faces = place.reshape(-1)[result.faces]
    turn = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    return {tuple(face) for face in np.take_along_axis(faces, turn, axis=1).tolist()}


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("shape", ["torus", "sheet"])
def test_both_sides_stay(shape, own):
    single = torus(40, 20) if shape == "torus" else grid(21, 21)
    points, faces = both_sides(*single, own)
    alone = salcore.analyze(*single)
    analysis = salcore.analyze(points, faces)
    for ratio in (1.0, 0.3, 0.05):
        result = analysis.simplify(ratio=ratio)
        one = alone.simplify(ratio=ratio)
        # The front is what it would be alone; the back is the front turned over.
        assert len(result.faces) == 2 * len(one.faces)
        assert len(result.indices) == (2 if own else 1) * len(one.indices)
        rows = oriented(points, result)
        assert len(rows) == len(result.faces)
        turned = {(a, c, b) for a, b, c in rows}
        assert turned == rows
        assert len(np.unique(result.faces)) == len(result.indices)
        # Corners, sources and points belong together, on each side to itself.
        corner = result.face_corners
        assert (points[faces.ravel()[corner]] == points[result.indices[result.faces]]).all()
        assert (faces.ravel()[corner] == result.indices[result.faces]).all()
        side = result.face_source >= len(single[1])
        assert side.sum() == len(one.faces)
        assert ((corner // 3 >= len(single[1])) == side[:, None]).all()
        assert (result.source[result.indices] == np.arange(len(result.indices))).all()
        report = result.make_report(errors=False)
        assert (report.faces_before, report.faces_after) == (len(faces), len(result.faces))


@pytest.mark.parametrize("own", [False, True])
def test_both_sides_move_together(own):
    points, faces = both_sides(*torus(40, 20), own)
    parameters = salcore.Parameters(placement="optimal")
    result = salcore.simplify(points, faces, parameters=parameters, faces=400)
    assert len(result.faces) == 400
    front, back = result.faces[::2], result.faces[1::2]
    sides = [np.sort(result.positions[side].round(9), axis=1) for side in (front, back)]
    assert (sides[0] == sides[1]).all()


def test_where_only_some_faces_have_backs():
    points, faces = grid(21, 21)
    some = points[faces].mean(axis=1)[:, 0] < 10
    mesh = np.concatenate([faces, faces[some][:, ::-1]])
    values = np.arange(3.0 * len(mesh)).reshape(-1, 3, 1)
    result = salcore.simplify(points, mesh, ratio=0.2)
    centre = points[result.indices][result.faces].mean(axis=1)[:, 0]
    side = result.face_source >= len(faces)
    assert side.any()
    assert (~side).sum() > side.sum()
    assert centre[side].max() < centre[~side].max()
    assert np.isin(values.ravel()[result.face_corners], values).all()
    all_of_it = salcore.simplify(points, mesh, ratio=1.0)
    assert len(all_of_it.faces) == len(mesh)


def test_backs_are_found():
    faces = np.array([[0, 1, 2], [2, 1, 3], [1, 0, 2], [1, 2, 0], [0, 2, 1], [3, 2, 1]])
    back, front = find_backs(faces, 4)
    assert back.tolist() == [2]
    assert front.tolist() == [0]
    assert len(find_backs(faces[:2], 4)[0]) == 0
    assert len(find_backs(faces[:0], 0)[0]) == 0
