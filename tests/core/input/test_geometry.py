# SPDX-License-Identifier: GPL-3.0-or-later
"""The door: what comes in, what is refused, and with which words."""

import json

import numpy as np
import pytest
from models import load_crop
from shapes import bumpy, grid

import salcore
from salcore.input.geometry import clean, unit

NASTY = [
    "abominevole.off", "cube_40k.obj", "degtri_sliding.off", "kinect_nan.ply",
    "non_manif_hole.ply", "planar_logo.ply", "room_scan1_duplicates.ply", "sliver_tet.ply",
    "terrain_utm.ply",
]  # fmt: skip


def test_points_are_centred_and_scaled_by_a_power_of_two():
    points = bumpy() * 1000 + 5e5
    geometry = clean(points)
    diagonal = np.linalg.norm(np.ptp(geometry.points, axis=0))
    assert 0.5 <= diagonal < 1
    assert np.frexp(geometry.to_unit)[0] == 0.5
    back = geometry.points / geometry.to_unit
    assert back - back[0] == pytest.approx(points - points[0], abs=1e-9)
    whole = np.linalg.norm(np.ptp(points, axis=0))
    assert geometry.unit_diagonal / geometry.to_unit == pytest.approx(whole)


def test_duplicates_are_welded_to_the_first():
    points = np.array([[1, 2, 3], [0, 0, 0], [1, 2, 3], [-0.0, 0, 0], [5, 5, 5.0]])
    geometry = clean(points)
    assert geometry.input_of.tolist() == [0, 1, 4]
    assert geometry.vertex_of.tolist() == [0, 1, 0, 1, 2]


def test_welding_agrees_with_numpy():
    points = np.random.default_rng(0).integers(0, 6, (3000, 3)) / 7
    geometry = clean(points)
    unique, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    assert len(geometry.points) == len(unique)
    assert sorted(geometry.input_of.tolist()) == sorted(first.tolist())
    assert (first[inverse.ravel()] == geometry.input_of[geometry.vertex_of]).all()


def test_invalid_points_are_dropped_and_mapped():
    points = np.array([[0, 0, 0], [np.nan, 0, 0], [1, 0, 0], [0, np.inf, 0], [0, 1, 0], [1, 1, 0]])
    analysis = salcore.analyze(points)
    result = analysis.simplify(alpha=0)
    assert not np.isin(result.indices, [1, 3]).any()
    assert result.source[[1, 3]].tolist() == [-1, -1]
    assert analysis.saliency[[1, 3]].tolist() == [0, 0]
    assert analysis.regions[[1, 3]].tolist() == [-1, -1]
    assert result.report.dropped == 2


def test_invalid_points_are_refused_by_choice():
    points = np.array([[0, 0, 0], [np.nan, 0, 0], [1, 0, 0.0]])
    with pytest.raises(salcore.GeometryError, match=r"points: 1 of 3 .* number 1.*invalid='drop'"):
        salcore.analyze(points, parameters=salcore.Parameters(invalid="refuse"))


def test_faces_that_lost_or_repeat_a_corner_go():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0], [1, 0, 0.0]])
    faces = [[0, 1, 2], [0, 1, 3], [0, 1, 4], [2, 2, 0]]
    assert clean(points, faces).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("points", "faces", "normals", "message"),
    [
        (np.zeros((4, 2)), None, None, r"points of shape \(4, 2\): give .* \(N, 3\)"),
        (np.zeros(6), None, None, r"points of shape \(6,\)"),
        ([["a", "b", "c"]], None, None, r"points of type .*: give real numbers"),
        (np.zeros((4, 3)), [[0, 1, 4]], None, r"faces: index 4 .* 4 points; .* 0 to 3"),
        (np.zeros((4, 3)), [[0, -1, 2]], None, r"faces: index -1 is out of range"),
        (np.zeros((4, 3)), [[0, 1, 2, 3]], None, r"faces of shape \(1, 4\): give triangles"),
        (np.zeros((4, 3)), [[0.0, 1.0, 2.0]], None, r"faces of type float64: give integers"),
        (np.zeros((4, 3)), None, np.zeros((3, 3)), r"normals: 3 rows for 4 points"),
        (np.zeros((4, 3)), None, np.zeros((4, 2)), r"normals of shape \(4, 2\)"),
    ],
)
def test_arrays_that_cannot_be_understood(points, faces, normals, message):
    with pytest.raises(salcore.GeometryError, match=message):
        salcore.analyze(points, faces, normals)


def test_unusable_normals_count_as_absent():
    points, _ = grid(8, 8)
    normals = np.tile([0.0, 0.0, 3.0], (64, 1))
    normals[5], normals[9], normals[12] = 0.0, np.nan, [np.inf, 0, 0]
    frames = salcore.analyze(points, normals=normals).frames
    assert np.abs(frames.normals[:, 2]) == pytest.approx(np.ones(64))


def test_unit_survives_tiny_and_huge_vectors():
    vectors = np.array([[1e-200, 0, 0], [3e200, 4e200, 0], [0, 0, 0]])
    assert unit(vectors) == pytest.approx(np.array([[1, 0, 0], [0.6, 0.8, 0], [0, 0, 0]]))


@pytest.mark.parametrize(
    "convert",
    [
        lambda p: p.astype(np.float32).astype(np.float64).astype(np.float32),
        np.asfortranarray,
        lambda p: np.repeat(p, 2, axis=0)[::2],
        lambda p: p.tolist(),
    ],
)
def test_array_kinds(convert):
    points = np.round(bumpy(300), 3).astype(np.float32).astype(np.float64)
    expected = salcore.simplify(points, alpha=20)
    given = convert(points)
    if isinstance(given, np.ndarray):
        given.setflags(write=False)
    result = salcore.simplify(given, alpha=20)
    assert (result.indices == expected.indices).all()


def test_integer_points_and_input_left_alone():
    points = np.random.default_rng(0).integers(0, 50, (200, 3))
    before = points.copy()
    salcore.simplify(points, alpha=10)
    assert (points == before).all()


@pytest.mark.parametrize("preset", salcore.PRESETS)
@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.ones((9, 3)),
        np.column_stack([np.arange(50.0), np.zeros((50, 2))]),
        grid(12, 9)[0],
        *(bumpy(n) for n in range(1, 6)),
        bumpy(400) * 1e-12,
        bumpy(400) * 1e12,
        bumpy(400) * 1e-300,
        bumpy(400) + 1e7,
        np.concatenate([bumpy(200), bumpy(200) * 1e-4 + 9]),
    ],
    ids=lambda p: f"{len(p)}",
)
def test_odd_clouds_work(points, preset):
    analysis = salcore.analyze(points, parameters=salcore.Parameters.preset(preset))
    result = analysis.simplify(alpha=10)
    assert analysis.saliency.shape == (len(points),)
    assert np.isfinite(analysis.saliency).all()
    assert len(result.indices) > 0 or len(points) == 0
    assert (result.source >= 0).all()
    errors = result.report.errors
    assert np.isfinite([errors.point.max, errors.surface.rms, errors.diagonal]).all()


TARGETS = {"alpha": 30.0, "ratio": 0.1, "count": 3, "max_error": 0.02}


@pytest.mark.parametrize("name", NASTY)
@pytest.mark.parametrize("preset", salcore.PRESETS)
def test_nasty_models_with_every_target(name, preset):
    points, faces = load_crop(f"nasty/{name}", 1_500)  # its size is no defect
    analysis = salcore.analyze(points, faces, parameters=salcore.Parameters.preset(preset))
    assert np.isfinite(analysis.saliency).all()
    valid = analysis.geometry.vertex_of >= 0
    for target, value in TARGETS.items():
        result = analysis.simplify(**{target: value})
        assert 0 < len(result.indices) <= len(points)
        assert ((result.source >= 0) == valid).all()
        assert len(result.indices) == 3 or target != "count"
        errors = result.report.errors
        json.dumps(errors.as_dict(), allow_nan=False)
        if target == "max_error":
            assert errors.surface.max <= value * errors.diagonal * (1 + 1e-9)


@pytest.mark.parametrize("preset", salcore.PRESETS)
def test_the_order_in_memory_changes_no_result(monkeypatch, preset):
    points = np.concatenate([bumpy(900), bumpy(900)[:40], [[np.nan, 0, 0]]])
    parameters = salcore.Parameters.preset(preset)
    expected = salcore.analyze(points, parameters=parameters)
    monkeypatch.setattr("salcore.input.geometry.SCATTERED", 1)
    analysis = salcore.analyze(points, parameters=parameters)
    assert (np.diff(analysis.geometry.number) != 1).any()
    assert (analysis.geometry.number == np.argsort(np.argsort(analysis.geometry.input_of))).all()
    assert analysis.saliency == pytest.approx(expected.saliency, abs=1e-12)
    assert (analysis.regions == expected.regions).all()
    order, wanted = analysis.ranking(), expected.ranking()
    assert (order.rank == wanted.rank).all()
    assert (order.parent == wanted.parent).all()
    for target in ({"alpha": 0.0}, {"alpha": 30.0}, {"ratio": 0.2}, {"count": 905}):
        result, other = analysis.simplify(**target), expected.simplify(**target)
        assert (result.indices == other.indices).all()
        assert (result.source == other.source).all()
