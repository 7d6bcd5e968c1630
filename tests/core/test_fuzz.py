# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawn input of every kind: it works, and what comes back holds together.

A modest number of examples runs with all tests. The long campaign is one command::

    SALIENT_FUZZ=long pytest tests/core/test_fuzz.py

and ``SALIENT_FUZZ=5000`` asks for so many examples of each test.
"""

import dataclasses
import json
import os

import numpy as np
import pytest
import strategies
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import salcore

ASKED = os.environ.get("SALIENT_FUZZ", "40")
drawn = settings(
    max_examples=2000 if ASKED == "long" else int(ASKED),
    deadline=None,
    derandomize=ASKED == "40",
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    print_blob=True,
)


def as_floats(shape):
    return np.asarray(shape.points, dtype=np.float64).reshape(-1, 3)


def same_arrays(one, other, names):
    for name in names.split():
        a, b = getattr(one, name), getattr(other, name)
        assert (a is None) == (b is None), name
        assert a is None or np.array_equal(a, b, equal_nan=True), name


def check_analysis(analysis, points):
    finite = np.isfinite(points).all(axis=1)
    assert analysis.saliency.shape == analysis.regions.shape == (len(points),)
    assert np.isfinite(analysis.saliency).all()
    assert analysis.saliency.min(initial=0) >= 0
    assert analysis.saliency.max(initial=0) <= 1
    assert ((analysis.regions >= 0) == finite).all()
    assert not analysis.saliency[~finite].any()
    length = np.linalg.norm(analysis.normals, axis=1)
    assert (np.isclose(length, 1) | (length == 0)).all()


def count_points(geometry, indices):
    """Count points as a target does: those equal ones once that faces use."""
    loose = geometry.loose[indices]
    return len(np.unique(geometry.vertex_of[indices[~loose]])) + np.count_nonzero(loose)


def check_count(result, geometry, count):
    """Check that a count is met, or that parts of the mesh went whole, and that this is said."""
    kept = count_points(geometry, result.indices)
    whole = [note for note in result.notes if note.endswith("parts go whole")]
    assert kept == count or (kept < count and len(whole) == 1)


def check_result(result, analysis, points, faces):
    """Check all that holds for whatever was asked."""
    finite = np.isfinite(points).all(axis=1)
    indices, source = result.indices, result.source
    assert indices.dtype == source.dtype == np.int64
    assert (np.diff(indices) > 0).all()
    assert finite[indices].all()
    assert (len(indices) > 0) == finite.any()
    assert ((source >= 0) == finite).all()
    assert (source[indices] == np.arange(len(indices))).all()
    if result.faces is not None:
        ordered = np.sort(result.faces, axis=1)
        assert (ordered[:, :-1] < ordered[:, 1:]).all()
        assert len(np.unique(ordered, axis=0)) == len(ordered)
        assert ordered.min(initial=0) >= 0
        assert ordered.max(initial=-1) < len(indices)
        # Copies of one point may stay: each face names one of them.
        vertex = analysis.geometry.vertex_of
        corners = source[np.asarray(faces).ravel()[result.corner_origin]]
        assert (vertex[indices[corners]] == vertex[indices[result.faces]]).all()
    if result.positions is not None:
        assert result.positions.shape == (len(indices), 3)
        assert np.isfinite(result.positions).all()
    report = json.loads(json.dumps(result.report.as_dict(), allow_nan=False))
    assert report["points_after"] == len(indices)
    assert report["points_before"] == len(points)
    assert report["dropped"] == np.count_nonzero(~finite)
    errors = result.report.errors
    assert errors.surface.rms <= errors.surface.max * (1 + 1e-9)
    assert errors.point.max <= 2 * errors.diagonal or result.positions is not None


def check_target(result, analysis, target):
    """Check what only this target promises."""
    name, value = target
    if name == "ratio":
        geometry = analysis.geometry
        total = geometry.available
        check_count(result, geometry, max(round(value * total), min(1, total)))
    if name == "max_error" and len(result.indices) < len(analysis.geometry.points):
        bound = value
        if analysis.parameters.error_unit == "diagonal":
            bound *= result.report.errors.diagonal
        assert result.report.errors.surface.max <= bound * (1 + 1e-9)


@drawn
@given(strategies.shapes(), strategies.parameters, strategies.targets)
def test_anything_works_and_holds_together(shape, parameters, target):
    points = as_floats(shape)
    before = [np.array(a) if a is not None else None
              for a in (shape.points, shape.faces, shape.normals)]  # fmt: skip
    if parameters.invalid == "refuse" and not np.isfinite(points).all():
        with pytest.raises(salcore.GeometryError, match=r"NaN or infinite .* invalid='drop'"):
            salcore.analyze(shape.points, shape.faces, shape.normals, parameters)
        return
    analysis = salcore.analyze(shape.points, shape.faces, shape.normals, parameters)
    check_analysis(analysis, points)
    result = analysis.simplify(**dict([target]))
    check_result(result, analysis, points, shape.faces)
    check_target(result, analysis, target)
    other = dataclasses.replace(parameters, workers=1 + parameters.workers)
    again = salcore.analyze(shape.points, shape.faces, shape.normals, other)
    same_arrays(analysis, again, "saliency regions normals")
    same_arrays(
        result,
        again.simplify(**dict([target])),
        "indices source faces face_source corner_origin positions",
    )
    for array, old in zip((shape.points, shape.faces, shape.normals), before, strict=True):
        assert old is None or np.array_equal(np.array(array), old, equal_nan=True)


@drawn
@given(strategies.shapes(), st.sampled_from(salcore.PRESETS), st.data())
def test_counts_constraints_and_ranking(shape, preset, data):
    points = as_floats(shape)
    analysis = salcore.analyze(
        shape.points, shape.faces, shape.normals, salcore.Parameters.preset(preset)
    )
    finite = np.isfinite(points).all(axis=1)
    rng = np.random.default_rng(data.draw(st.integers(0, 999), label="constraints"))
    total, available = len(points), int(finite.sum())
    protect = rng.random(total) < data.draw(st.sampled_from([0.0, 0.1, 1.0]), label="protected")
    constraints = {
        "protect": data.draw(st.sampled_from([None, protect]), label="protect"),
        "importance": data.draw(
            st.sampled_from([None, np.zeros(total), rng.random(total) * 1e100]), label="importance"
        ),
    }
    if total and data.draw(st.booleans(), label="seams"):
        constraints["seams"] = rng.integers(0, total, (total // 2, 2))
    if not available:
        assert len(analysis.simplify(ratio=0.5, **constraints).indices) == 0
        return
    count = data.draw(st.integers(1, available), label="count")
    geometry = analysis.geometry
    held = count_points(geometry, np.flatnonzero(protect & finite))
    if constraints["protect"] is not None and count < held:
        with pytest.raises(salcore.ParameterError, match=f"but {held} are protected; give more"):
            analysis.simplify(count=count, **constraints)
        count = available
    result = analysis.simplify(count=count, **constraints)
    check_count(result, geometry, min(count, geometry.available))
    check_result(result, analysis, points, shape.faces)
    if constraints["protect"] is not None:
        held = np.flatnonzero(protect & finite)
        assert (result.indices[result.source[held]] == held).all()
    ranking = analysis.ranking(**constraints)
    whole = analysis._order.elimination.part_ranks
    if not len(whole):
        assert sorted(ranking.rank) == list(range(total))
    ranked = np.flatnonzero(ranking.rank < min(count, geometry.available))
    assert np.isin(ranked, result.indices).all() or geometry.corner_points is not None
    assert set(geometry.vertex_of[ranked]) == set(geometry.vertex_of[result.indices])
    child = np.flatnonzero(ranking.parent >= 0)
    assert (ranking.rank[ranking.parent[child]] < ranking.rank[child]).all()
    if result.faces is not None:
        check_corners(result, np.asarray(shape.faces), rng)


def check_corners(result, faces, rng):
    charts = rng.random((len(faces), 3, 2)).round(1)
    seams = salcore.find_seams(faces, charts)
    corners = result.corner_source(faces, charts)
    assert corners.shape == result.faces.shape
    assert ((corners >= 0) & (corners < faces.size)).all()
    edges = np.concatenate([result.faces[:, :2], result.faces[:, 1:]])
    found = result.edge_source(seams, edges)
    assert ((found >= -1) & (found < len(seams))).all()


@drawn
@given(strategies.shapes(mesh=True), st.sampled_from([-1, -(2**31), 2**40, None]), st.data())
def test_faces_out_of_range_are_named(shape, bad, data):
    faces = np.array(shape.faces, dtype=np.int64)
    if not len(faces):
        return
    bad = len(shape.points) if bad is None else bad
    faces[data.draw(st.integers(0, len(faces) - 1)), data.draw(st.integers(0, 2))] = bad
    with pytest.raises(salcore.GeometryError, match=f"faces: index {bad} is out of range"):
        salcore.analyze(shape.points, faces)


@drawn
@given(strategies.shapes(), strategies.shapes(), st.integers(-900, 900))
def test_any_two_shapes_can_be_compared(one, other, exponent):
    surfaces = []
    for shape in (one, other):
        points = np.ldexp(as_floats(shape), exponent)
        surfaces.append(salcore.make_surface(points, shape.faces, shape.normals))
    if bool(len(surfaces[0].points)) != bool(len(surfaces[1].points)):
        with pytest.raises(salcore.GeometryError, match="no valid points"):
            salcore.compare(*surfaces)
        return
    there, back = salcore.compare(*surfaces), salcore.compare(*surfaces[::-1])
    json.dumps(there.as_dict(), allow_nan=False)
    assert there.point == back.point_back
    assert there.surface.max <= there.point.max * (1 + 1e-9)
    assert salcore.compare(surfaces[0], surfaces[0]).surface.max <= 1e-9 * there.diagonal


@drawn
@given(strategies.shapes(), st.integers(-900, 900), strategies.targets)
def test_powers_of_two_change_nothing(shape, exponent, target):
    if target[0] == "max_error":
        target = ("max_error", min(target[1], 2.0))
    points = as_floats(shape)
    one = salcore.simplify(points, shape.faces, shape.normals, **dict([target]))
    other = salcore.simplify(
        np.ldexp(points, exponent), shape.faces, shape.normals, **dict([target])
    )
    same_arrays(one, other, "indices source faces face_source corner_origin")
    assert other.report.errors.surface.max == np.ldexp(one.report.errors.surface.max, exponent)
