# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be asked for, and how many points it comes to."""

import dataclasses

import numpy as np
import pytest
from models import load_crop
from shapes import box, bumpy, grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.decimation.targets import (
    CLOSE,
    count_for,
    count_for_faces,
    count_within,
    one_target,
)
from salcore.progress import Progress


@pytest.mark.parametrize("ratio", [1e-9, 0.1, 1 / 3, 1.0])
def test_ratios(ratio):
    result = salcore.simplify(bumpy(1000), ratio=ratio)
    assert len(result.indices) == max(round(ratio * 1000), 1)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ({}, "no target given: give one of ratio, count, faces, max_error, alpha"),
        ({"ratio": 0.1, "count": 5}, r"2 targets given \(ratio, count\)"),
        ({"ratio": 1.1}, "ratio=1.1: give a number above 0 to 1"),
        ({"count": 0}, "count=0"),
        ({"ratio": 0}, "ratio=0: give a number above 0 to 1"),
        ({"faces": 10}, "faces=10: there are no faces; give count or ratio"),
        ({"count": 2.5}, "count=2.5: give a whole number"),
        ({"max_error": -1}, "max_error=-1"),
        ({"rati": 0.3}, "no target 'rati'"),
    ],
)
def test_mistakes(target, message):
    with pytest.raises(salcore.ParameterError, match=message):
        salcore.analyze(bumpy(30)).simplify(**target)


@pytest.mark.parametrize("name", ["fandisk.obj", "nasty/non_manif_hole.ply"])
def test_the_largest_error_is_honoured(name):
    points, faces = load_crop(name, 2_500)
    analysis = salcore.analyze(points, faces)
    length = dataclasses.replace(analysis.parameters, error_unit="length")
    same = dataclasses.replace(analysis, parameters=length)
    for bound in (0.0, 0.0005, 0.005):
        result = analysis.simplify(max_error=bound)
        errors = result.report.errors
        assert errors.surface.max <= bound * errors.diagonal
        if bound > 0.001:
            assert len(result.indices) < 0.9 * len(points)
        assert (same.simplify(max_error=bound * errors.diagonal).indices == result.indices).all()


def test_one_target_is_checked():
    assert one_target({"ratio": None, "count": 7}) == ("count", 7)
    assert one_target({"alpha": 30}) == ("alpha", 30.0)


def test_counts_of_ratios():
    assert count_for("ratio", 0.5, 101, 0) == 50
    assert count_for("ratio", 0.0, 101, 0) == 1
    assert count_for("ratio", 0.0, 0, 0) == 0
    assert count_for("count", 101, 101, 101) == 101
    with pytest.raises(salcore.ParameterError, match="count=5: that is 5 points, but 6 are prot"):
        count_for("count", 5, 101, 6)


@pytest.mark.parametrize("fewest", [1, 4, 37, 900, 1000])
@pytest.mark.parametrize("guess", [1, 30, 800, 1000])
@pytest.mark.parametrize("least", [1, 50])
def test_the_fewest_points_within_an_error(fewest, guess, least):
    """The error falls below the bound at `fewest`; the estimate says at `guess`."""
    trials, shares = [], []

    def measure(count):
        trials.append(count)
        return 0.5 if count >= fewest else 2.0

    work = Progress(lambda stage, share: shares.append(share))
    count = count_within(1.0, guess, 1000, measure, least, work)
    assert count >= max(fewest, least)
    assert count <= max(fewest * (1 + CLOSE) + 1, least)
    assert len(trials) <= 30
    assert (np.diff(shares) > 0).all()
    assert len(shares) in (len(trials), len(trials) - 1)


def test_no_points_at_all():
    assert count_within(1.0, 0, 0, lambda count: 0.0, 1) == 0


def spheres():
    """Return two spheres of very different size."""
    large, faces = hull_mesh(sphere_cloud(900))
    small, others = hull_mesh(sphere_cloud(200, radius=0.1))
    return np.concatenate([large, small + 3.0]), np.concatenate([faces, others + len(large)])


@pytest.mark.parametrize("shape", ["grid", "torus", "box", "spheres"])
def test_a_number_of_faces_or_the_nearest_below(shape):
    points, faces = {
        "grid": lambda: grid(31, 25),
        "torus": lambda: torus(40, 24),
        "box": lambda: box(14),
        "spheres": spheres,
    }[shape]()
    analysis = salcore.analyze(points, faces)
    for wanted in (len(faces), 1001, 500, 333, 100, 64):
        result = analysis.simplify(faces=wanted)
        left = len(result.faces)
        assert wanted - 2 <= left <= wanted
        if left < wanted:
            more = analysis.simplify(count=len(result.indices) + 1)
            assert len(more.faces) > wanted
            assert result.notes[0].startswith(f"faces={wanted}: {left} faces are kept")
        else:
            assert not any("faces=" in note for note in result.notes)
    with pytest.raises(salcore.ParameterError, match=f"there are {len(faces)} valid faces"):
        analysis.simplify(faces=len(faces) + 1)


def test_faces_and_protected_points():
    points, faces = grid(21, 21)
    protect = points[:, 0] == 0
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(faces=100, protect=protect)
    assert len(result.faces) in (99, 100)
    assert np.isin(np.flatnonzero(protect), result.indices).all()
    with pytest.raises(salcore.ParameterError, match="faces=3: 21 protected points make"):
        analysis.simplify(faces=3, protect=protect)


def test_counts_of_faces():
    for step in (1, 2, 7):
        for wanted in (0, 1, 6, 50, 139, 1000):
            trials = []

            def measure(count, step=step, trials=trials):
                trials.append(count)
                return 0 if count < 30 else step * (count - 29)

            count = count_for_faces(wanted, measure, 100)
            assert measure(count) <= wanted
            assert count == 100 or measure(count + 1) > wanted
            assert len(trials) < 20


def test_faces_are_an_array_or_a_number():
    points, faces = grid(9, 9)
    one = salcore.simplify(points, faces=faces, ratio=0.5)
    assert (one.faces == salcore.simplify(points, faces, ratio=0.5).faces).all()
    assert len(salcore.simplify(points, faces, faces=60).faces) == 60
    with pytest.raises(salcore.ParameterError, match="2 targets given"):
        salcore.simplify(points, faces, ratio=0.5, faces=60)
    with pytest.raises(salcore.ParameterError, match="faces: give the number of faces to keep"):
        salcore.simplify(points, faces, faces=faces)
