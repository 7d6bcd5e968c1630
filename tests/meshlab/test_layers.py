# SPDX-License-Identifier: GPL-3.0-or-later
"""A MeshSet keeps its layers, their order and the current one, also when a filter fails."""

import tempfile

import numpy as np
import pymeshlab
import pytest
from shapes import bumpy, torus

import meshlab_filter as mf
import salcore
from meshlab_filter.cli import demo

ARRAYS = (
    "vertex_matrix", "face_matrix", "vertex_normal_matrix", "vertex_color_matrix",
    "vertex_scalar_array", "vertex_selection_array", "transform_matrix",
)  # fmt: skip
ANALYSES = [
    "compute_scalar_by_saliency_per_vertex",
    "compute_scalar_by_saliency_region_per_vertex",
]
SIMPLIFICATIONS = [
    "compute_selection_by_interest_points_per_vertex",
    "generate_simplified_point_cloud_by_saliency",
    "meshing_decimation_by_saliency",
]
TARGET = {name: {"ratio": 0.5} for name in SIMPLIFICATIONS}


@pytest.fixture
def meshes():
    """Three layers, of which the one in the middle is current, and one is hidden."""
    result = pymeshlab.MeshSet(verbose=False)
    result.add_mesh(pymeshlab.Mesh(bumpy()), "cloud")
    points, faces = torus(30, 15)
    colors = np.random.default_rng(0).integers(0, 256, (len(points), 4)) / 255
    result.add_mesh(pymeshlab.Mesh(points, faces, v_color_matrix=colors), "ring")
    result.add_mesh(pymeshlab.Mesh(2.0 * points, faces), "large")
    result.set_current_mesh(0)
    result.set_current_mesh_visibility(False)
    result.set_current_mesh(1)
    result.set_matrix(transformmatrix=np.diag([2.0, 2, 2, 1]), freeze=False)
    result.compute_selection_by_condition_per_vertex(condselect="(x > 0)")
    return result


def about(mesh):
    """Return all there is to know about a layer."""
    fixed = (mesh.id(), mesh.label(), mesh.is_visible())
    return fixed, [np.array(getattr(mesh, name)()) for name in ARRAYS]


def state(mesh_set):
    return mesh_set.current_mesh_id(), [about(mesh) for mesh in mesh_set]


def assert_same(before, after):
    assert before[0] == after[0]
    assert len(before[1]) == len(after[1])
    for (fixed, arrays), (fixed_after, arrays_after) in zip(before[1], after[1], strict=True):
        assert fixed == fixed_after
        for name, one, other in zip(ARRAYS, arrays, arrays_after, strict=True):
            assert np.array_equal(one, other), name


@pytest.mark.parametrize("name", ANALYSES + SIMPLIFICATIONS)
def test_a_cancelled_filter_leaves_all_as_it_was(name):
    def make_set():
        result = pymeshlab.MeshSet(verbose=False)
        for mesh in (pymeshlab.Mesh(bumpy()), pymeshlab.Mesh(*torus(30, 15))):
            result.add_mesh(mesh)
        result.set_current_mesh(1)
        return result

    calls = []
    mf.apply(make_set(), name, progress=lambda *told: calls.append(told), **TARGET.get(name, {}))
    assert len(calls) > 3
    for stop in sorted({1, 2, len(calls) // 2, len(calls) - 1, len(calls)}):
        fresh = make_set()
        before = state(fresh)
        told = []

        def progress(*what, told=told, stop=stop):
            told.append(what)
            return len(told) < stop

        with pytest.raises(salcore.Cancelled):
            mf.apply(fresh, name, progress=progress, **TARGET.get(name, {}))
        assert_same(before, state(fresh))


@pytest.mark.parametrize("name", ANALYSES + SIMPLIFICATIONS)
def test_a_filter_whose_callback_raises_leaves_all_as_it_was(meshes, name):
    before = state(meshes)

    def progress(stage, fraction):
        raise RuntimeError("the caller's own")

    with pytest.raises(RuntimeError, match="the caller's own"):
        mf.apply(meshes, name, progress=progress, **TARGET.get(name, {}))
    assert_same(before, state(meshes))


@pytest.mark.parametrize(
    ("name", "parameters"),
    [(name, {"cells": 0} | TARGET.get(name, {})) for name in ANALYSES + SIMPLIFICATIONS]
    + [(name, {"nonsense": 1} | TARGET.get(name, {})) for name in ANALYSES + SIMPLIFICATIONS]
    + [(name, parameters) for name in SIMPLIFICATIONS for parameters in (
        {}, {"ratio": 2.0}, {"ratio": float("nan")}, {"count": 0}, {"ratio": 0.5, "count": 3},
        {"max_error": -1.0}, {"ratio": "half"},
    )]
    + [(name, {"ratio": 0.5, "customattributes": "none"}) for name in SIMPLIFICATIONS[1:]]
    + [("get_simplification_error", {"simplifiedmesh": 7})],
)  # fmt: skip
def test_a_mistake_leaves_all_as_it_was(meshes, name, parameters):
    before = state(meshes)
    with pytest.raises(salcore.SalcoreError):
        mf.apply(meshes, name, **parameters)
    assert_same(before, state(meshes))


@pytest.mark.parametrize("name", SIMPLIFICATIONS[1:])
def test_a_layer_that_cannot_be_finished_is_taken_back(name, tmp_path, monkeypatch):
    """A texture goes by way of a temporary file, for which there may be no room."""
    mesh_set = pymeshlab.MeshSet(verbose=False)
    mesh_set.add_mesh(pymeshlab.Mesh(bumpy()), "cloud")
    mesh_set.load_new_mesh(str(demo.sample("bunny10k_textured.obj")))
    mesh_set.set_current_mesh(1)
    before = state(mesh_set)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    if name == SIMPLIFICATIONS[1]:  # a cloud has no texture
        mf.apply(mesh_set, name, count=500)
        return
    with pytest.raises(FileNotFoundError):
        mf.apply(mesh_set, name, count=500)
    assert_same(before, state(mesh_set))


@pytest.mark.parametrize("name", [*ANALYSES, SIMPLIFICATIONS[0], "get_simplification_error"])
def test_filters_that_compute_keep_all_layers(meshes, name):
    current, before = state(meshes)
    mf.apply(meshes, name, **TARGET.get(name, {}))
    now, after = state(meshes)
    assert now == current
    assert [fixed for fixed, _ in after] == [fixed for fixed, _ in before]
    for number in (0, 2):
        assert_same((0, [before[number]]), (0, [after[number]]))


def test_a_filter_that_generates_adds_one_layer_at_the_end(meshes):
    _, before = state(meshes)
    mf.generate_simplified_point_cloud_by_saliency(meshes, ratio=0.5)
    now, after = state(meshes)
    assert_same((0, before), (0, after[:3]))
    assert len(after) == 4
    assert now == after[3][0][0]


def test_decimation_replaces_its_layer(meshes):
    """pymeshlab can neither exchange a layer's mesh nor move a layer: the new one comes last."""
    _, before = state(meshes)
    mf.meshing_decimation_by_saliency(meshes, ratio=0.5)
    now, after = state(meshes)
    assert_same((0, [before[0], before[2]]), (0, after[:2]))
    assert [fixed[1] for fixed, _ in after] == ["cloud", "large", "ring"]
    assert now == after[2][0][0]
    assert after[2][0][2] == before[1][0][2]


def test_attributes_that_filters_leave_behind_do_no_harm(meshes, tmp_path):
    """They cannot be removed; they are neither saved nor in the way of MeshLab's own filters."""
    for _ in range(3):
        mf.compute_scalar_by_saliency_per_vertex(meshes, colorize=True)
        mf.compute_scalar_by_saliency_region_per_vertex(meshes, colorize=True)
        mf.compute_selection_by_interest_points_per_vertex(meshes, ratio=0.5)
    clean = pymeshlab.MeshSet(verbose=False)
    mesh = meshes.current_mesh()
    clean.add_mesh(pymeshlab.Mesh(mesh.vertex_matrix(), mesh.face_matrix(),
        v_color_matrix=mesh.vertex_color_matrix(), v_scalar_array=mesh.vertex_scalar_array(),
        v_normals_matrix=mesh.vertex_normal_matrix()))  # fmt: skip
    for mesh_set, name in ((meshes, "used.ply"), (clean, "clean.ply")):
        mesh_set.save_current_mesh(str(tmp_path / name))
    assert (tmp_path / "used.ply").stat().st_size == (tmp_path / "clean.ply").stat().st_size
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=300)
    meshes.meshing_remove_unreferenced_vertices()
    mf.compute_scalar_by_saliency_per_vertex(meshes)
    meshes.load_new_mesh(str(tmp_path / "used.ply"))
    assert meshes.current_mesh().vertex_number() == 450
