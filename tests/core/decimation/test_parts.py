# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of many parts: parts go whole where points do not feed them all; the others stay whole."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import box, grid, hull_mesh, sphere_cloud, torus

import salcore
from salcore.arrays.edges import find_edges
from salcore.measure.topology import count_parts, label_parts


def join(*meshes):
    """Put meshes into one."""
    offset = np.cumsum([0, *(len(points) for points, _ in meshes)])
    faces = [faces + start for (_, faces), start in zip(meshes, offset, strict=False)]
    return np.concatenate([points for points, _ in meshes]), np.concatenate(faces)


def foliage():
    """Return a bumpy trunk and 400 leaf cards round it."""
    rng = np.random.default_rng(3)
    points, faces = torus(60, 20)
    points = points * (1 + 0.03 * np.sin(9 * points[:, :1]))
    card = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.08
    turns = Rotation.random(400, random_state=1).as_matrix()
    places = rng.normal(size=(400, 1, 3))
    places *= rng.uniform(2, 3, (400, 1, 1)) / np.linalg.norm(places, axis=2, keepdims=True)
    square = np.array([[0, 1, 2], [0, 2, 3]])
    cards = [((card @ turn.T) + place, square) for turn, place in zip(turns, places, strict=True)]
    return join((points, faces), *cards)


def scan():
    """Return a closed surface with thirty closed crumbs round it."""
    rng = np.random.default_rng(5)
    crumb = hull_mesh(sphere_cloud(30, radius=0.02))
    shift = [rng.normal(size=3) * 2 for _ in range(30)]
    return join(hull_mesh(sphere_cloud(1500)), *((crumb[0] + s, crumb[1]) for s in shift))


def spheres():
    """Return two spheres of very different size."""
    small = hull_mesh(sphere_cloud(400, radius=0.05))
    return join(hull_mesh(sphere_cloud(600)), (small[0] + 2.0, small[1]))


def bolted():
    """Return a box with sixteen bolts in its sides, each a closed part."""
    bolt = torus(12, 6, radius=0.03, tube=0.015)
    spots = [np.array([x, y, z]) for x in (0, 1) for y in (0.2, 0.4, 0.6, 0.8) for z in (0.3, 0.7)]
    return join(box(12), *((bolt[0] + spot, bolt[1]) for spot in spots))


def hair():
    """Return 300 strips of eight faces, all alike, without anything else."""
    points, faces = grid(2, 5)
    strip = points * [0.1, 0.02, 0]
    places = [np.array([0.5 * (k % 20), 0.2 * (k // 20), 0]) for k in range(300)]
    return join(*((strip + place, faces) for place in places))


MESHES = {f.__name__: f for f in (foliage, scan, spheres, bolted, hair)}
CLOSED = {"scan", "spheres", "bolted"}


@pytest.mark.parametrize("name", MESHES)
def test_parts_stay_whole_or_go_whole(name):
    points, faces = MESHES[name]()
    analysis = salcore.analyze(points, faces)
    part = label_parts(faces, len(points))
    before = np.arange(len(points))
    for ratio in (1.0, 0.6, 0.3, 0.1, 0.03, 0.01, 0.004):
        count = max(round(ratio * len(points)), 1)
        result = analysis.simplify(ratio=ratio)
        kept = result.indices
        assert count - 32 < len(kept) <= count
        if len(kept) < count:
            assert any("parts go whole" in note for note in result.notes)
        assert np.isin(kept, before).all()
        before = kept
        assert (np.flatnonzero(analysis.ranking().rank < count) == kept).all()
        if count < 8:
            continue
        # No loose points, and what is closed stays closed.
        assert len(np.unique(result.faces)) == len(kept)
        edges = find_edges(result.faces, len(kept))
        assert edges.uses.max() <= 2
        assert name not in CLOSED or edges.uses.min() == 2
        # Every face joins points of one part; what went is counted.
        assert (np.ptp(part[kept][result.faces], axis=1) == 0).all()
        report = result.make_report(errors=False)
        assert report.parts_before == part.max() + 1
        assert report.parts_after == count_parts(result.faces, len(kept))
        gone = report.parts_before - report.parts_after
        said = f"{gone} of {report.parts_before} parts went whole, those that matter least"
        assert (said in result.notes) == (gone > 0)


def test_leaves_stay_whole():
    points, faces = foliage()
    for ratio in (0.6, 0.3):
        result = salcore.simplify(points, faces, ratio=ratio)
        part = label_parts(result.faces, len(result.indices))
        sizes = np.bincount(part)[1:]
        assert (sizes == 4).all()  # no half leaves
        assert len(sizes) > 0.9 * (len(result.indices) - 200) / 4


def test_the_smallest_parts_go_first():
    points, faces = scan()
    result = salcore.simplify(points, faces, count=100)
    assert (np.linalg.norm(points[result.indices], axis=1) < 1.001).mean() > 0.5
    points, faces = spheres()
    result = salcore.simplify(points, faces, count=6)
    assert (result.indices < 600).all()
    assert result.notes[0] == "1 of 2 parts went whole, those that matter least"
    assert len(salcore.simplify(points, faces, count=8).report.notes) <= 1


def test_equal_parts_go_from_all_over():
    points, faces = hair()
    result = salcore.simplify(points, faces, ratio=0.15)
    kept = np.unique(result.indices // 10)
    assert 50 < len(kept) < 250
    for half in (kept < 150, kept % 20 < 10):
        assert 0.35 < half.mean() < 0.65


def test_protected_and_important_parts_stay():
    points, faces = foliage()
    part = label_parts(faces, len(points))
    mine = np.isin(part, [7, 100, 399])
    one = np.zeros(len(points), dtype=bool)
    one[np.unique(part, return_index=True)[1][[7, 100, 399]]] = True
    for changes in ({"protect": one}, {"importance": 1e6 * mine}):
        result = salcore.simplify(points, faces, count=60, **changes)
        assert {7, 100, 399} <= set(part[result.indices])
        assert len(np.unique(result.faces)) == len(result.indices)


def test_all_parts_stay_with_the_topology():
    points, faces = bolted()
    result = salcore.simplify(points, faces, count=1, keep_topology=True)
    report = result.make_report(errors=False)
    assert report.parts_after == report.parts_before == 17
    assert "keep_topology keeps" in result.notes[0]
    assert len(result.indices) < 17 * 14


def test_the_largest_error_of_many_parts():
    points, faces = foliage()
    result = salcore.simplify(points, faces, max_error=0.01)
    assert len(result.indices) < 0.9 * len(points)
    assert result.errors.surface.max <= 0.01 * result.errors.diagonal
    assert result.make_report(errors=False).parts_after == 401
