# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps: fractions never fall, and work that is closed anywhere leaves nothing behind."""

import dataclasses
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from shapes import bumpy, grid, torus

import salcore
from salcore import sorting, triangles
from salcore.progress import finish, run, staged

TARGETS = [{"ratio": 0.1}, {"max_error": 0.01}, {"alpha": 10.0}]
PRESETS = [salcore.Parameters.preset(name) for name in salcore.PRESETS]


def scene(kind, count):
    if kind == "cloud":
        return bumpy(count), None
    points, faces = torus(max(count // 12, 4), 6)
    return (points, faces) if kind == "mesh" else (points, faces[: len(faces) // 2])


KINDS = ["cloud", "mesh", "mesh and loose points"]


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
    assert 0.0 <= seen[0] <= seen[-1] <= 1.0


def test_a_rest_stays_at_the_fraction():
    def work():
        yield None
        yield 0.5
        yield None
        return "done"

    seen = []
    steps = staged("Stage", 0.0, 0.5, work())
    assert run(steps, lambda *at: seen.append(at)) == "done"
    assert seen == [("Stage", at) for at in (0.0, 0.0, 0.25, 0.25)]


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("indices", "source", "faces", "positions")
        if getattr(other, name) is not None
    )


def closed_after(steps, count):
    for _ in range(count):
        next(steps)
    steps.close()
    assert threading.active_count() == 1


@pytest.mark.parametrize("kind", KINDS)
def test_an_analysis_closed_at_any_yield_leaves_nothing(kind):
    points, faces = scene(kind, 60)
    before = points.copy()
    for stop in range(1, 1 + len(list(salcore.analysis_steps(points, faces)))):
        closed_after(salcore.analysis_steps(points, faces), stop)
    assert (points == before).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("target", TARGETS, ids=lambda target: next(iter(target)))
def test_a_simplification_closed_at_many_yields_leaves_nothing(kind, target):
    parameters = salcore.Parameters(placement="optimal")
    analysis = salcore.analyze(*scene(kind, 48), parameters=parameters)
    expected = dataclasses.replace(analysis).simplify(**target)
    count = len(list(dataclasses.replace(analysis).simplify_steps(**target)))
    fresh = dataclasses.replace(analysis)  # has no order of elimination yet
    for stop in range(1, count + 1, 1 + count // 50):
        closed_after(dataclasses.replace(analysis).simplify_steps(**target), stop)
        if fresh.rounds == ():
            closed_after(fresh.simplify_steps(**target), stop)
    assert same(fresh.simplify(**target), expected)


def tiny_scene(kind):
    """Return a scene so small that every single yield can be tried."""
    points, faces = grid(2, 3)
    points[4, 2] = 0.5
    if kind == "cloud":
        return bumpy(6), None
    return (points, faces) if kind == "mesh" else (np.concatenate([points, bumpy(2)]), faces)


# The search for an error runs the same cuts again and again: one kind is enough for it.
@pytest.mark.parametrize(
    ("kind", "target"),
    [(kind, target) for kind in KINDS for target in TARGETS
     if kind == "cloud" or "max_error" not in target],
)  # fmt: skip
def test_work_cancelled_at_every_yield_leaves_nothing(kind, target):
    parameters = salcore.Parameters(placement="optimal", workers=1)
    points, faces = tiny_scene(kind)
    seen = []
    expected = salcore.simplify(
        points, faces, parameters=parameters, **target, progress=lambda *at: seen.append(at)
    )
    first = len(list(salcore.analysis_steps(points, faces, parameters=parameters)))
    # One analysis for all: whatever a closed run leaves behind would stay until the end.
    analysis = salcore.analyze(points, faces, parameters=parameters)
    for stop in range(len(seen)):
        if stop < first:
            left = [False] + [True] * stop  # popped from its end
            with pytest.raises(salcore.Cancelled, match=f"during {seen[stop][0]}"):
                salcore.simplify(
                    points, faces, parameters=parameters, **target,
                    progress=lambda *_, n=left: n.pop(),
                )  # fmt: skip
        else:
            if analysis.rounds != ():  # the order of elimination is made: forget it
                assert same(analysis.simplify(**target), expected)
                analysis = dataclasses.replace(analysis)
            closed_after(analysis.simplify_steps(**target), stop - first + 1)
    assert same(analysis.simplify(**target), expected)
    assert same(salcore.simplify(points, faces, parameters=parameters, **target), expected)


def test_rankings_and_errors_closed_at_every_yield_leave_nothing():
    analysis = salcore.analyze(*tiny_scene("cloud"), parameters=salcore.Parameters(workers=1))
    expected = run(dataclasses.replace(analysis).ranking_steps())
    for stop in range(1, 1 + len(list(dataclasses.replace(analysis).ranking_steps()))):
        closed_after(analysis.ranking_steps(), stop)
    assert (run(analysis.ranking_steps()).rank == expected.rank).all()
    errors = analysis.simplify(ratio=0.3).report.errors
    for stop in range(1, 1 + len(list(analysis.simplify(ratio=0.3).errors_steps()))):
        result = analysis.simplify(ratio=0.3)
        closed_after(result.errors_steps(), stop)
        assert finish(result.errors_steps()) == errors


@pytest.mark.parametrize("stop", range(0, 40, 3))
def test_other_wishes_cancelled_leave_the_order_of_the_first(stop):
    analysis = salcore.analyze(bumpy(40))
    expected = analysis.simplify(ratio=0.3)
    closed_after(analysis.simplify_steps(ratio=0.3, importance=np.arange(40.0)), stop)
    assert same(analysis.simplify(ratio=0.3), expected)


def test_no_thread_outlives_a_stage_that_is_closed():
    points = bumpy(40000)
    steps = salcore.analysis_steps(points)
    stages = {}
    for number, at in enumerate(steps):
        stages.setdefault(at.stage, []).append(number)
    for numbers in stages.values():
        closed_after(salcore.analysis_steps(points), numbers[len(numbers) // 2] + 1)


NUMBERS = st.one_of(
    arrays(np.int64, st.integers(0, 60), elements=st.integers(-(2**40), 2**40)),
    arrays(np.int64, st.integers(0, 60), elements=st.integers(0, 5)),
    arrays(np.float64, st.integers(0, 60), elements=st.floats(-1e100, 1e100)),
)


@given(keys=NUMBERS)
def test_sorting_by_drawers(keys):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sorting, "DRAWER", 5)
        patch.setattr(sorting, "SHUFFLED", 7)
        order, ordered = finish(sorting.sort(keys, stable=True))
        _, again = finish(sorting.sort(keys, workers=1))
    assert (order == np.argsort(keys, kind="stable")).all()
    assert (ordered == np.sort(keys)).all()
    assert (again == ordered).all()


@pytest.mark.parametrize("largest", [0, triangles.LARGEST_KEY])
@given(rows=arrays(np.int32, st.tuples(st.integers(0, 40), st.just(3)), elements=st.integers(0, 4)))
def test_sorting_rows(largest, rows):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sorting, "DRAWER", 5)
        patch.setattr(triangles, "LARGEST_KEY", largest)
        order, equal = finish(triangles.sort_rows(rows, 5))
    assert (order == np.lexsort(rows.T[::-1])).all()
    ordered = rows[order]
    assert (equal == (ordered[1:] == ordered[:-1]).all(axis=1)).all()
