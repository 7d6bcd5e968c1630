# SPDX-License-Identifier: GPL-3.0-or-later
"""What is to be kept: borders, so that neighbour tiles meet, and the topology; and what is said."""

import dataclasses

import numpy as np
import pytest
from shapes import grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.arrays.edges import find_edges
from salcore.measure.topology import label_parts, measure_topology


def height(x, y):
    return 2 * np.sin(x / 4) * np.cos(y / 3) + 0.3 * np.sin(1.3 * x) * np.sin(1.7 * y)


def tiles():
    """Return two neighbour tiles of a terrain, far from the origin."""
    points, faces = grid(33, 33)
    for offset in (0, 32):
        x, y = points[:, 0] + offset, points[:, 1]
        yield np.column_stack([x + 5e5, y + 5.4e6, height(x, y)]), faces


def ring():
    """Return a tube, open at both ends, of which one is a triangle."""
    around, along = np.meshgrid(np.arange(3), np.arange(12), indexing="ij")
    angle = 2 * np.pi * around.ravel() / 3
    points = np.column_stack([np.cos(angle), np.sin(angle), along.ravel()])
    low = (along[:, :-1] + 12 * around[:, :-1]).ravel()
    right = (along[:, :-1] + 12 * ((around[:, :-1] + 1) % 3)).ravel()
    faces = [np.column_stack([low, right, right + 1]), np.column_stack([low, right + 1, low + 1])]
    return points, np.concatenate(faces)


def border_of(points, faces):
    """Return the border edges as a set of pairs of positions."""
    edges = find_edges(faces, len(points))
    single = edges.uses == 1
    pairs = np.column_stack([edges.low, edges.high])[single]
    return {frozenset((tuple(points[a]), tuple(points[b]))) for a, b in pairs}


@pytest.mark.parametrize("placement", ["original", "optimal"])
@pytest.mark.parametrize("target", [{"ratio": 0.3}, {"faces": 400}, {"ratio": 0.01}, {"alpha": 5}])
def test_neighbour_tiles_meet(target, placement):
    parameters = salcore.Parameters(placement=placement)
    for points, faces in tiles():
        result = salcore.simplify(points, faces, parameters=parameters, keep_border=True, **target)
        assert np.isin(np.flatnonzero(border_mask(points, faces)), result.indices).all()
        if "alpha" in target:
            continue
        places = points[result.indices] if result.positions is None else result.positions
        assert border_of(places, result.faces) == border_of(points, faces)
        said = "keep_border keeps 128" in " ".join(result.notes)
        assert said == (target == {"ratio": 0.01})
        assert len(result.indices) == (128 if said else 327 if "ratio" in target else 265)


def border_mask(points, faces):
    edges = find_edges(faces, len(points))
    mask = np.zeros(len(points), dtype=bool)
    mask[edges.low[edges.uses == 1]] = mask[edges.high[edges.uses == 1]] = True
    return mask


def test_a_border_stays_to_the_last_point():
    points, faces = ring()
    result = salcore.simplify(points, faces, count=1, keep_border=True)
    assert border_of(points[result.indices], result.faces) == border_of(points, faces)
    assert len(result.indices) == 6
    ranking = salcore.analyze(points, faces).ranking(keep_border=True)
    assert ranking.least == 6
    assert (np.flatnonzero(ranking.rank < 6) == result.indices).all()


SHAPES = {
    "sphere": (hull_mesh(sphere_cloud(300)), 4),
    "torus": (torus(24, 12), 20),
    "disc": (grid(12, 12), 3),
    "tube": (ring(), 6),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_the_topology_is_kept_to_the_least_count(shape):
    (points, faces), most = SHAPES[shape]
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(count=1, keep_topology=True)
    before, after = (
        measure_topology(f, np.zeros(count, dtype=np.intp), 1)
        for f, count in ((faces, len(points)), (result.faces, len(result.indices)))
    )
    assert after.handles == before.handles
    assert after.borders == before.borders
    assert 3 <= len(result.indices) <= most
    least = len(result.indices)
    assert result.notes == (f"count=1: that is 1 points, but keep_topology keeps {least}",)
    assert analysis.ranking(keep_topology=True).least == least
    assert analysis.simplify(count=least, keep_topology=True).notes == ()


def test_what_is_given_up_is_said():
    points, faces = torus(24, 12)
    analysis = salcore.analyze(points, faces)
    assert analysis.simplify(ratio=0.5).notes == ()
    assert analysis.simplify(count=6).notes[0].startswith("Topology: 1 ")
    ball = salcore.simplify(*hull_mesh(sphere_cloud(300)), count=3)
    assert ball.notes[0].startswith("Topology: 1 closed part opened; ")
    assert ball.report.notes == ball.notes


def test_a_report_without_errors():
    points, faces = grid(12, 12)
    far = np.vstack([points, points + np.array([0, 0, 9])])
    result = salcore.simplify(far, np.concatenate([faces, faces + len(points)]), ratio=0.5)
    report = result.make_report(errors=False)
    assert report.errors is None
    assert "errors" not in result.__dict__
    assert (report.parts_before, report.parts_after) == (2, 2)
    assert report.as_dict()["errors"] is None
    assert report.seconds_errors is None
    full = result.report
    assert full.seconds_errors > 0
    changes = {"errors": result.errors, "seconds_errors": full.seconds_errors}
    assert dataclasses.replace(report, **changes) == full


def test_figures_of_parts():
    ball, disc, ring_ = hull_mesh(sphere_cloud(100)), grid(4, 4), torus(9, 6)
    points, faces, count = [], [], 0
    for p, f in (ball, disc, ring_, ring()):
        points.append(p)
        faces.append(f + count)
        count += len(p)
    faces = np.concatenate(faces)
    part = label_parts(faces, count + 1)
    assert part[-1] == -1
    found = measure_topology(faces, part, 4)
    assert found.handles.tolist() == [0, 0, 1, 0]
    assert found.borders.tolist() == [0, 1, 0, 2]
    assert found.faces.tolist() == [len(f) for _, f in (ball, disc, ring_, ring())]
    fin = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert measure_topology(fin, np.zeros(5, dtype=np.intp), 1).handles.tolist() == [-1]
