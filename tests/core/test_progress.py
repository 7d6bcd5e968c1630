# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress never falls, and work that is cancelled anywhere leaves nothing behind."""

import dataclasses
import threading

import numpy as np
import pytest
from shapes import bumpy, grid, torus

import salcore
from salcore.progress import SILENT, Progress

TARGETS = [{"ratio": 0.1}, {"max_error": 0.01}, {"alpha": 10.0}]
PRESETS = [salcore.Parameters.preset(name) for name in salcore.PRESETS]
KINDS = ["cloud", "mesh", "mesh and loose points"]


def scene(kind, count):
    if kind == "cloud":
        return bumpy(count), None
    points, faces = torus(max(count // 12, 4), 6)
    return (points, faces) if kind == "mesh" else (points, faces[: len(faces) // 2])


def tiny_scene(kind):
    """Return a scene so small that a cancel can be tried at every single call."""
    points, faces = grid(2, 3)
    points[4, 2] = 0.5
    if kind == "cloud":
        return bumpy(6), None
    return (points, faces) if kind == "mesh" else (np.concatenate([points, bumpy(2)]), faces)


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("indices", "source", "faces", "positions")
        if getattr(other, name) is not None
    )


def cancels_at(call):
    """Return a callback that cancels at a call of this number, counted from 0."""
    left = [False] + [True] * call  # popped from its end
    return lambda *_: left.pop()


def test_parts_lie_in_the_whole():
    seen = []
    whole = Progress(lambda *at: seen.append(at))
    part = whole.part(0.25, 0.75, "Stage")
    part(0.5)
    part.part(0.5, 1.0)(0.5)
    part.portion(0.0, 0.5)("Work of its own", 1.0)
    assert seen == [
        ("Stage", 0.25), ("Stage", 0.5), ("Stage", 0.625), ("Work of its own", 0.5),
    ]  # fmt: skip
    assert SILENT.portion(0.0, 1.0) is None


def test_a_callback_that_returns_false_cancels():
    with pytest.raises(salcore.Cancelled, match="cancelled during Stage"):
        Progress(lambda *_: False).part(0.0, 1.0, "Stage")
    Progress(lambda *_: None)(0.5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("target", TARGETS, ids=lambda target: next(iter(target)))
@pytest.mark.parametrize("parameters", PRESETS, ids=salcore.PRESETS)
def test_fractions_never_fall(kind, target, parameters):
    seen = []
    analysis = salcore.analyze(
        *scene(kind, 400), parameters=parameters, progress=lambda _, at: seen.append(at)
    )
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0.0, 1.0)
    seen.clear()
    analysis.simplify(**target, progress=lambda _, at: seen.append(at))
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0.0, 1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_an_analysis_cancelled_at_any_call_leaves_nothing(kind):
    points, faces = scene(kind, 60)
    before, seen = points.copy(), []
    salcore.analyze(points, faces, progress=lambda *at: seen.append(at))
    for call, (stage, _) in enumerate(seen):
        with pytest.raises(salcore.Cancelled, match=f"during {stage}"):
            salcore.analyze(points, faces, progress=cancels_at(call))
        assert threading.active_count() == 1
    assert (points == before).all()


# The search for an error runs the same cuts again and again: one kind is enough for it.
@pytest.mark.parametrize(
    ("kind", "target"),
    [(kind, target) for kind in KINDS for target in TARGETS
     if kind == "cloud" or "max_error" not in target],
)  # fmt: skip
def test_work_cancelled_at_every_call_leaves_nothing(kind, target):
    parameters = salcore.Parameters(placement="optimal", workers=1)
    points, faces = tiny_scene(kind)
    seen, later = [], []
    expected = salcore.simplify(
        points, faces, parameters=parameters, **target, progress=lambda *at: seen.append(at)
    )
    for call, (stage, _) in enumerate(seen):
        with pytest.raises(salcore.Cancelled, match=f"during {stage}"):
            salcore.simplify(
                points, faces, parameters=parameters, **target, progress=cancels_at(call)
            )
    # One analysis for all: whatever a cancelled call leaves behind would stay until the end.
    analysis = salcore.analyze(points, faces, parameters=parameters)
    dataclasses.replace(analysis).simplify(**target, progress=lambda *at: later.append(at))
    for call in range(len(later)):
        with pytest.raises(salcore.Cancelled):
            dataclasses.replace(analysis).simplify(**target, progress=cancels_at(call))
    for call in range(len(later)):
        if analysis.rounds == ():
            with pytest.raises(salcore.Cancelled):
                analysis.simplify(**target, progress=cancels_at(call))
    assert same(analysis.simplify(**target), expected)


def test_rankings_and_errors_cancelled_at_every_call_leave_nothing():
    analysis = salcore.analyze(*tiny_scene("cloud"), parameters=salcore.Parameters(workers=1))
    seen = []
    expected = dataclasses.replace(analysis).ranking(progress=lambda *at: seen.append(at))
    for call in range(len(seen)):
        with pytest.raises(salcore.Cancelled):
            dataclasses.replace(analysis).ranking(progress=cancels_at(call))
    assert (analysis.ranking().rank == expected.rank).all()
    errors, seen = analysis.simplify(ratio=0.3).report.errors, []
    analysis.simplify(ratio=0.3).measure(lambda *at: seen.append(at))
    assert seen
    for call in range(len(seen)):
        result = analysis.simplify(ratio=0.3)
        with pytest.raises(salcore.Cancelled):
            result.measure(cancels_at(call))
        assert result.measure() == errors


def test_other_constraints_cancelled_leave_the_order_of_the_first():
    analysis = salcore.analyze(bumpy(40))
    expected, seen = analysis.simplify(ratio=0.3), []
    other = {"ratio": 0.3, "importance": np.arange(40.0)}
    dataclasses.replace(analysis).simplify(**other, progress=lambda *at: seen.append(at))
    for call in range(0, len(seen) - 1, 3):
        with pytest.raises(salcore.Cancelled):
            analysis.simplify(**other, progress=cancels_at(call))
        assert same(analysis.simplify(ratio=0.3), expected)


def test_no_thread_outlives_a_stage_that_is_cancelled():
    points = bumpy(40000)
    seen, stages = [], {}
    salcore.analyze(points, progress=lambda *at: seen.append(at))
    for call, (stage, _) in enumerate(seen):
        stages.setdefault(stage, []).append(call)
    for calls in stages.values():
        with pytest.raises(salcore.Cancelled):
            salcore.analyze(points, progress=cancels_at(calls[len(calls) // 2]))
        assert threading.active_count() == 1
