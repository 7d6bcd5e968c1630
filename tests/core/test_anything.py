# SPDX-License-Identifier: GPL-3.0-or-later
"""Anything that may come in: drawn shapes, arrays and parameters; cancelled runs; wrong calls."""

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import bumpy, cube_cloud, grid, hull_mesh, sphere_cloud, torus, turned
from strategies import any_parameters, targets

import salcore


def draw_shape(rng):
    """Return points, and faces or None, of a random kind."""
    count = int(rng.integers(0, 150))
    sides = rng.integers(3, 10, 2)
    makers = [
        lambda: (rng.random((count, 3)), None),
        lambda: (np.round(rng.random((count, 3)) * rng.integers(1, 6)), None),  # few distinct
        lambda: grid(*sides),
        lambda: torus(*sides),
        lambda: hull_mesh(sphere_cloud(count + 6)),
        lambda: (np.outer(rng.random(count), rng.normal(size=3)), None),  # a line
        lambda: (rng.random((count, 2)) @ rng.normal(size=(2, 3)), None),  # a plane
        # Two clusters, far apart and of very different density.
        lambda: (np.concatenate([rng.random((count, 3)), 1e-4 * rng.random((count, 3)) + 9]), None),
        lambda: (cube_cloud(int(sides[0]) // 2)[0], None),
    ]
    points, faces = makers[rng.integers(len(makers))]()
    if rng.random() < 0.2 and len(points) > 2:  # a soup of faces
        faces = rng.integers(0, len(points), (int(rng.integers(1, 2 * len(points))), 3))
    return np.array(points, dtype=float), faces


def draw_geometry(seed):
    """Return points, faces and normals with random defects."""
    rng = np.random.default_rng(seed)
    points, faces = draw_shape(rng)
    turn, scale, move, copy, spoil, with_normals = rng.random(6) < 0.25
    if turn and len(points):
        points = turned(points, int(rng.integers(99)))
    if scale:
        points *= 10.0 ** rng.integers(-12, 13)
    if move:
        points += 1e7
    if copy and len(points):
        points = np.concatenate([points, points[rng.integers(0, len(points), len(points))]])
    if spoil:
        bad = rng.random(len(points)) < 0.1
        points[bad, rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf])
    normals = None
    if with_normals:
        normals = rng.normal(size=points.shape) * (rng.random((len(points), 1)) < 0.8)
    return points, faces, normals


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.integers(0, 10**9), any_parameters, targets)
def test_anything_works_or_is_refused(seed, parameters, target):
    points, faces, normals = draw_geometry(seed)
    finite = np.isfinite(points).all(axis=1)
    if parameters.invalid == "refuse" and not finite.all():
        with pytest.raises(salcore.GeometryError, match=r"NaN or infinite .* invalid='drop'"):
            salcore.analyze(points, faces, normals, parameters)
        return
    analysis = salcore.analyze(points, faces, normals, parameters)
    count = len(points)
    assert analysis.saliency.shape == analysis.regions.shape == (count,)
    assert np.isfinite(analysis.saliency).all()
    assert analysis.saliency.min(initial=0) >= 0
    assert analysis.saliency.max(initial=0) <= 1
    assert ((analysis.regions >= 0) == finite).all()
    result = analysis.simplify(**dict([target]))
    indices, source = result.indices, result.source
    assert indices.dtype == source.dtype == np.int64
    assert (np.diff(indices) > 0).all()
    assert finite[indices].all()
    assert (len(indices) > 0) == finite.any()
    assert ((source >= 0) == finite).all()
    assert (source[indices] == np.arange(len(indices))).all()
    report = json.loads(json.dumps(result.report.as_dict(), allow_nan=False))
    assert report["points_after"] == len(indices)
    assert report["dropped"] == np.count_nonzero(~finite)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("level", [1, 8])
def test_few_points_at_every_level(count, level):
    for preset in salcore.PRESETS:
        parameters = dataclasses.replace(salcore.Parameters.preset(preset), level=level)
        for points in (np.eye(5, 3)[:count] + bumpy(count), np.outer(np.arange(count), [1, 2, 3])):
            result = salcore.simplify(points, alpha=0, parameters=parameters)
            assert 1 <= len(result.indices) <= count


@pytest.mark.parametrize("level", [1, 2, 8])
@pytest.mark.parametrize("graph", ["surface", "delaunay"])
def test_no_points_at_every_level(level, graph):
    parameters = salcore.Parameters(level=level, graph=graph)
    for target in ({"alpha": 1}, {"ratio": 0.5}, {"max_error": 0.1}):
        result = salcore.simplify(np.zeros((0, 3)), [], parameters=parameters, **target)
        assert (len(result.indices), len(result.source)) == (0, 0)
        json.dumps(result.report.as_dict(), allow_nan=False)


def test_nothing_but_invalid_points():
    analysis = salcore.analyze(np.full((6, 3), np.nan), [[0, 1, 2]], np.ones((6, 3)))
    result = analysis.simplify(alpha=0)
    assert analysis.saliency.tolist() == [0] * 6
    assert analysis.regions.tolist() == [-1] * 6
    assert (len(result.indices), result.source.tolist()) == (0, [-1] * 6)
    assert result.report.dropped == 6


def test_a_wrong_face_is_named_before_any_work():
    seen = []
    with pytest.raises(salcore.GeometryError, match="faces: index 99"):
        salcore.analyze(bumpy(50), [[0, 1, 99]], progress=lambda stage, _: seen.append(stage))
    assert seen == ["Input"]


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int32, np.uint64, np.int64])
def test_faces_of_any_integers(dtype):
    points, faces = grid(6, 7)
    expected = salcore.analyze(points, faces)
    given_faces = np.asfortranarray(faces.astype(dtype))
    given_faces.setflags(write=False)
    assert (salcore.analyze(points, given_faces).graph.indices == expected.graph.indices).all()


def test_inputs_are_left_alone():
    points, faces = torus(12, 8)
    normals = 3.0 * points
    before = [array.copy() for array in (points, faces, normals)]
    salcore.simplify(points, faces, normals, alpha=20)
    for array, old in zip((points, faces, normals), before, strict=True):
        assert (array == old).all()


def test_results_are_the_callers_own():
    analysis = salcore.analyze(bumpy(200))
    saliency = analysis.saliency.copy()
    analysis.saliency[:] = 7
    analysis.regions[:] = 7
    analysis.simplify(alpha=10).indices[:] = 0
    assert (analysis.saliency == saliency).all()
    assert analysis.regions.max() < 200


def test_replace_checks_too():
    parameters = salcore.Parameters()
    with pytest.raises(salcore.ParameterError, match=r"cells=0: give a whole number from 1 to 32"):
        dataclasses.replace(parameters, cells=0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        parameters.cells = 3
    assert dataclasses.replace(parameters, cells=np.int64(4)).cells == 4
    assert type(dataclasses.replace(parameters, cells=4.0).cells) is int


@pytest.mark.parametrize(
    "row", [row for row in salcore.TABLE if row.type is str], ids=lambda row: row.name
)
def test_every_choice_is_taken_and_others_name_them_all(row):
    for choice in row.choices:
        assert getattr(salcore.Parameters(**{row.name: choice}), row.name) == choice
    for bad in ("", "no such", None, 3, row.choices[0].upper()):
        with pytest.raises(salcore.ParameterError) as caught:
            salcore.Parameters(**{row.name: bad})
        for part in (row.name, repr(bad), *row.choices):
            assert part in str(caught.value)


def test_every_bound_is_taken():
    for row in salcore.TABLE:
        if row.type in (int, float):
            for bound in (row.minimum, row.maximum):
                assert getattr(salcore.Parameters(**{row.name: bound}), row.name) == bound


@pytest.mark.parametrize("target", [{"alpha": 20}, {"ratio": 0.2}, {"max_error": 0.01}])
def test_cancelled_simplifications_leave_nothing_behind(target):
    points = bumpy(600)
    seen = []
    analysis = salcore.analyze(points)
    expected = analysis.simplify(**target, progress=lambda *at: seen.append(at))
    steps = len(seen)
    for stop in sorted({*range(min(steps, 4)), steps // 3, steps // 2, steps - 1}):
        analysis = salcore.analyze(points)
        left = [False] + [True] * stop  # popped from its end
        with pytest.raises(salcore.Cancelled):
            analysis.simplify(**target, progress=lambda *_, left=left: left.pop())
        result = analysis.simplify(**target)
        assert (result.indices == expected.indices).all()
        assert (result.source == expected.source).all()


@pytest.mark.parametrize("target", [{"alpha": 20}, {"ratio": 0.2}, {"max_error": 0.01}])
def test_fractions_of_a_simplification_never_fall(target):
    seen = []
    salcore.analyze(bumpy(1500)).simplify(**target, progress=lambda _, f: seen.append(f))
    assert seen == sorted(seen)
    assert seen[0] >= 0
    assert seen[-1] <= 1
