# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of corners: seams stay as lines, and every corner keeps to its own chart."""

import numpy as np
import pytest
from shapes import box, grid, torus

import salcore


def unrolled_torus(size=60):
    """Return a bumpy torus cut open: its points, faces and texture coordinates, split at seams."""
    i, j = (k.ravel() for k in np.meshgrid(*2 * [np.arange(size + 1)], indexing="ij"))
    a, b = 2 * np.pi * (i % size) / size, 2 * np.pi * (j % size) / size
    height = np.sin(b) + 0.15 * np.sin(9 * a) * np.cos(5 * b)
    points = np.stack([(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), height], axis=1)
    x, y = (k.ravel() for k in np.meshgrid(*2 * [np.arange(size)], indexing="ij"))

    def number(x, y):
        return x * (size + 1) + y

    first = [number(x, y), number(x + 1, y), number(x + 1, y + 1)]
    second = [number(x, y), number(x + 1, y + 1), number(x, y + 1)]
    faces = np.concatenate([np.stack(first, axis=1), np.stack(second, axis=1)])
    return points, faces, np.stack([i, j], axis=1) / size


def welded(points, faces):
    """Return a mesh without copies."""
    _, first, place = np.unique(points, axis=0, return_index=True, return_inverse=True)
    return points[first], place.reshape(-1)[faces]


def torn(texture):
    """Return the number of faces (k, 3, 2) whose texture spans half of the square."""
    return np.count_nonzero(np.ptp(texture, axis=1).max(axis=1) > 0.5)


@pytest.mark.parametrize("given", [False, True])
def test_split_vertices_stay_split_and_no_face_is_torn(given):
    points, faces, texture = unrolled_torus()
    places = len(np.unique(points, axis=0))
    analysis = salcore.analyze(points, faces)
    for ratio in (0.5, 0.1, 0.02):
        result = analysis.simplify(ratio=ratio, corner_values=texture[faces] if given else None)
        kept = points[result.indices]
        assert len(np.unique(kept, axis=0)) == round(ratio * places)
        assert len(np.unique(result.faces)) == len(kept)  # no copy is loose
        assert torn(texture[result.indices][result.faces]) == 0
        corner = faces.reshape(-1)[result.face_corners]
        np.testing.assert_array_equal(corner, result.indices[result.faces])
        # Every copy goes into a copy of its own side of the seam, unless its chart has gone there.
        moved = texture[result.indices[result.source]] - texture
        assert np.median(np.abs(moved)) < 0.1


def test_wedges_and_copies_give_the_same_mesh():
    points, faces, texture = unrolled_torus()
    shared, shared_faces = welded(points, faces)
    split = salcore.simplify(points, faces, ratio=0.1)
    wedges = salcore.simplify(shared, shared_faces, ratio=0.1, corner_values=texture[faces])
    for result, given in ((split, points), (wedges, shared)):
        coordinates = texture[faces].reshape(-1, 2)[result.face_corners]
        assert torn(coordinates) == 0
        assert len(np.unique(given[result.indices], axis=0)) == round(0.1 * len(shared))
    assert len(split.faces) == len(wedges.faces)


def test_copies_without_values_are_one_point():
    points, faces, _ = unrolled_torus(24)
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(count=100, corner_values=[])
    assert len(result.indices) == len(np.unique(result.faces)) == 100
    assert len(analysis.simplify(count=100).indices) > 100  # the two are told apart


def test_all_copies_are_kept_at_ratio_one():
    points, faces, _ = unrolled_torus(12)
    result = salcore.simplify(points, faces, ratio=1.0)
    np.testing.assert_array_equal(result.indices, np.arange(len(points)))
    np.testing.assert_array_equal(result.faces, faces)
    np.testing.assert_array_equal(result.source, np.arange(len(points)))


def test_a_count_beyond_the_places_keeps_them_all():
    points, faces, _ = unrolled_torus(12)
    assert len(salcore.simplify(points, faces, count=len(points)).indices) == len(points)
    with pytest.raises(salcore.ParameterError, match="valid points"):
        salcore.simplify(points, faces, count=len(points) + 1)


def test_loose_copies_beside_a_mesh_are_points_of_their_own():
    points, faces = grid(10, 10)
    points = np.concatenate([points[:20], points, points[50:55]])  # faces use the middle
    analysis = salcore.analyze(points, faces + 20)
    for count in (125, 110, 100, 40):
        result = analysis.simplify(count=count)
        assert len(result.indices) == count
        kept = np.isin(np.arange(20, 120), result.indices).sum()
        assert kept == min(count, 100)  # those that faces use come first
        assert result.indices[result.faces].min() >= 20


def test_a_soup_of_single_triangles_is_welded():
    points, faces = torus(24, 16)
    result = salcore.simplify(points[faces].reshape(-1, 3), soup_faces(faces), ratio=0.5)
    assert len(result.indices) == round(0.5 * len(points))
    assert len(np.unique(result.faces)) == len(result.indices)
    expected = salcore.simplify(points, faces, ratio=0.5)
    assert len(result.faces) == len(expected.faces)


def soup_faces(faces):
    """Return faces of their own points each."""
    return np.arange(faces.size).reshape(-1, 3)


def test_corners_of_flat_shading_take_the_most_alike_normal():
    points, faces = torus(48, 32)
    normals = np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2)))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    of_corners = np.repeat(normals[:, None], 3, axis=1)
    soup = points[faces].reshape(-1, 3)
    result = salcore.simplify(soup, soup_faces(faces), ratio=0.3, corner_normals=of_corners)
    a, b, c = (soup[result.indices][result.faces[:, k]] for k in range(3))
    new = np.cross(b - a, c - a)
    new /= np.linalg.norm(new, axis=1)[:, None]
    chosen = of_corners.reshape(-1, 3)[result.face_corners]
    angle = np.degrees(np.arccos(np.clip((chosen * new[:, None]).sum(axis=2), -1, 1)))
    assert np.mean(angle) < 15
    assert len(np.unique(result.faces)) == len(result.indices)


def test_borders_of_materials_stay_lines():
    points, faces = grid(40, 40)
    middle = points[faces].mean(axis=1)
    red = middle[:, 1] > 20 + 8 * np.sin(middle[:, 0] / 4)
    values = np.repeat(red[:, None], 3, axis=1)[:, :, None].astype(float)
    result = salcore.simplify(points, faces, ratio=0.1, corner_values=values)
    chosen = red[result.face_corners // 3]
    assert (chosen == chosen[:, :1]).all()  # no face is of two materials
    a, b, c = (points[result.indices][result.faces[:, k]] for k in range(3))
    area = 0.5 * np.abs(np.cross(b - a, c - a)[:, 2])
    # Each face is of the material of the surface at its centre.
    centre = (a + b + c) / 3
    wrong = chosen[:, 0] != (centre[:, 1] > 20 + 8 * np.sin(centre[:, 0] / 4))
    assert area[wrong].sum() < 0.02 * area.sum()


def test_a_mirrored_texture_does_not_run_across_its_mirror():
    points, faces = grid(40, 20)
    points[:, 2] = 0.3 * np.cos(points[:, 0]) * np.cos(points[:, 1])
    texture = np.stack([np.abs(points[:, 0] - 20), points[:, 1]], axis=1)
    result = salcore.simplify(points, faces, ratio=0.1, corner_values=texture[faces])
    x = points[result.indices][result.faces][:, :, 0] - 20
    assert not ((x.min(axis=1) < 0) & (x.max(axis=1) > 0)).any()


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("ratio", [0.5, 0.1, 0.03])
def test_hard_edges_keep_the_normals_of_their_sides(split, ratio):
    points, faces = box(16)
    normals = np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2)))
    normals = np.round(normals / np.linalg.norm(normals, axis=1)[:, None])
    of_corners = np.repeat(normals[:, None], 3, axis=1)
    if split:
        both = np.concatenate([points[faces], of_corners], axis=2).reshape(-1, 6)
        unique, place = np.unique(both, axis=0, return_inverse=True)
        points, faces = unique[:, :3], place.reshape(-1, 3)
        result = salcore.simplify(points, faces, unique[:, 3:], ratio=ratio)
        chosen = unique[result.indices][result.faces][:, :, 3:]
    else:
        result = salcore.simplify(points, faces, ratio=ratio, corner_normals=of_corners)
        chosen = of_corners.reshape(-1, 3)[result.face_corners]
    a, b, c = (points[result.indices][result.faces[:, k]] for k in range(3))
    new = np.cross(b - a, c - a)
    new /= np.linalg.norm(new, axis=1)[:, None]
    assert ((chosen * new[:, None]).sum(axis=2) > 0.99).all()


def test_seams_may_go_by_choice():
    points, faces, texture = unrolled_torus()
    shared, shared_faces = welded(points, faces)
    analysis = salcore.analyze(shared, shared_faces)
    free = analysis.simplify(ratio=0.05, corner_values=texture[faces], keep_seams=False)
    none = analysis.simplify(ratio=0.05)
    np.testing.assert_array_equal(free.indices, none.indices)
    assert torn(texture[faces].reshape(-1, 2)[free.face_corners]) > 0


def test_layers_are_seams_of_their_own():
    points, faces = grid(30, 30)
    middle = points[faces].mean(axis=1)
    left = np.repeat((middle[:, 0] < 15)[:, None], 3, axis=1)
    noise = np.random.default_rng(0).random((len(faces), 3, 3))
    layers = [noise, left[:, :, None].astype(float)]
    result = salcore.simplify(points, faces, ratio=0.1, corner_values=layers)
    # The noise has no lines, but the other layer keeps its one.
    sides = left[:, 0][result.face_corners // 3]
    assert (sides == sides[:, :1]).all()
    x = points[result.indices][result.faces][:, :, 0]
    assert not ((x.min(axis=1) < 15) & (x.max(axis=1) > 15)).any()


def test_values_must_fit_the_faces():
    points, faces = grid(4, 4)
    with pytest.raises(salcore.GeometryError, match=r"corner_values of shape \(3, 3, 2\)"):
        salcore.simplify(points, faces, ratio=0.5, corner_values=np.zeros((3, 3, 2)))
    with pytest.raises(salcore.GeometryError, match="corner_normals"):
        salcore.simplify(points, faces, ratio=0.5, corner_normals=np.zeros((len(faces), 3, 2)))


def test_protected_copies_stay_and_no_twin_stands_in():
    points, faces, _ = unrolled_torus(24)
    protect = np.zeros(len(points), dtype=bool)
    corners = np.flatnonzero((points == points[0]).all(axis=1))
    assert len(corners) == 4
    protect[corners[1]] = protect[100] = True
    result = salcore.simplify(points, faces, count=30, protect=protect)
    assert protect[result.indices].sum() == 2
    np.testing.assert_array_equal(result.indices[result.source[protect]], np.flatnonzero(protect))


def test_a_cloud_keeps_exactly_its_protected_points():
    points = np.random.default_rng(0).random((200, 3))
    points = np.concatenate([points, points[:50]])
    protect = np.zeros(len(points), dtype=bool)
    protect[[3, 203, 207, 90]] = True
    for count in (4, 20, 230):
        result = salcore.simplify(points, count=count, protect=protect)
        assert len(result.indices) == count
        assert protect[result.indices].sum() == 4
        np.testing.assert_array_equal(
            result.indices[result.source[protect]], np.flatnonzero(protect)
        )
        assert 7 not in result.indices or count == 230
    with pytest.raises(salcore.ParameterError, match="4 are protected"):
        salcore.simplify(points, count=3, protect=protect)
    paper = salcore.simplify(points, alpha=500, protect=protect)
    assert protect[paper.indices].sum() == 4
