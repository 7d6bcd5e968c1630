# SPDX-License-Identifier: GPL-3.0-or-later
"""The filters on a real MeshSet."""

import numpy as np
import pymeshlab
import pytest
from models import model_path
from shapes import bumpy, grid

import meshlab_filter as mf
import salcore
from meshlab_filter.cli import demo


def set_of(*meshes):
    result = pymeshlab.MeshSet(verbose=False)
    for number, mesh in enumerate(meshes):
        result.add_mesh(mesh, f"layer {number}")
    return result


def rich_mesh(faces=True):
    """Return a mesh with every array that MeshLab keeps on vertices, and two loose points."""
    points, triangles = grid(12, 15)
    points[:, 2] = np.abs(points[:, 0] - 7)
    points = np.concatenate([points, [[30.0, 0, 0], [31, 0, 0]]])
    rng = np.random.default_rng(0)
    arrays = {
        "v_normals_matrix": rng.normal(size=points.shape),
        "v_color_matrix": rng.integers(0, 256, (len(points), 4)) / 255,
        "v_scalar_array": rng.random(len(points)),
        "v_tex_coords_matrix": rng.random((len(points), 2)),
    }
    if faces:
        return pymeshlab.Mesh(points, triangles, **arrays)
    return pymeshlab.Mesh(points, **arrays)


def layers(mesh_set):
    return [(m.id(), m.label(), m.vertex_number(), m.face_number()) for m in mesh_set]


def test_filter_list_and_parameters():
    assert mf.filter_list() == [
        "compute_scalar_by_saliency_per_vertex",
        "compute_scalar_by_saliency_region_per_vertex",
        "compute_selection_by_interest_points_per_vertex",
        "generate_simplified_point_cloud_by_saliency",
        "get_simplification_error",
        "meshing_decimation_by_saliency",
    ]
    values = mf.filter_parameter_values("generate_simplified_point_cloud_by_saliency")
    for row in salcore.TABLE:
        assert values[row.name.replace("_", "")] == row.default
    for row in salcore.TARGETS:
        assert values[row.name.replace("_", "")] is None
    assert values["preset"] == "default"
    for name in mf.filter_list():
        assert callable(getattr(mf, name))


def test_saliency_becomes_the_quality():
    meshes = set_of(rich_mesh())
    before = layers(meshes)
    mesh = meshes.current_mesh()
    expected = salcore.analyze(mesh.vertex_matrix(), mesh.face_matrix()).saliency
    colors = mesh.vertex_color_matrix()
    mf.compute_scalar_by_saliency_per_vertex(meshes)
    assert mesh.vertex_scalar_array() == pytest.approx(expected)
    assert mesh.vertex_custom_scalar_attribute_array("saliency") == pytest.approx(expected)
    assert (mesh.vertex_color_matrix() == colors).all()
    mf.apply(meshes, "compute_scalar_by_saliency_per_vertex", level=2, colorize=True)
    again = mesh.vertex_scalar_array()
    assert np.abs(again - expected).max() > 0.01
    colors = mesh.vertex_color_matrix()
    assert colors[again.argmin()].tolist() == [0, 0, 1, 1]
    assert colors[again.argmax()].tolist() == [1, 0, 0, 1]
    assert layers(meshes) == before


def test_regions_become_the_quality():
    meshes = set_of(pymeshlab.Mesh(bumpy()))
    expected = salcore.analyze(bumpy(), parameters=salcore.Parameters(tolerance=0.02))
    done = mf.compute_scalar_by_saliency_region_per_vertex(meshes, tolerance=0.02, colorize=True)
    mesh = meshes.current_mesh()
    assert (mesh.vertex_scalar_array() == expected.regions).all()
    assert done["regions"] == expected.segmentation.count > 3
    assert len(np.unique(mesh.vertex_color_matrix(), axis=0)) > 3


def test_interest_points_are_selected():
    meshes = set_of(rich_mesh())
    mesh = meshes.current_mesh()
    result = salcore.simplify(mesh.vertex_matrix(), mesh.face_matrix(), alpha=20)
    done = mf.compute_selection_by_interest_points_per_vertex(meshes, alpha=20)
    assert np.flatnonzero(mesh.vertex_selection_array()).tolist() == result.indices.tolist()
    assert done["selected"] == len(result.indices)
    mf.compute_selection_by_interest_points_per_vertex(meshes, alpha=200)
    assert mesh.selected_vertex_number() < done["selected"]


@pytest.mark.parametrize("faces", [True, False])
def test_the_simplified_layer_has_all_that_the_source_had(faces):
    meshes = set_of(rich_mesh(), rich_mesh(faces))
    source = meshes.current_mesh()
    source.add_vertex_custom_scalar_attribute(np.arange(182.0) ** 2, "mine")
    meshes.compute_selection_by_condition_per_vertex(condselect="(x > 4)")
    meshes.set_matrix(transformmatrix=np.diag([2.0, 2, 2, 1]), freeze=False)
    before = layers(meshes)
    normals = None if faces else source.vertex_normal_matrix()
    triangles = source.face_matrix() if faces else None
    kept = salcore.simplify(source.vertex_matrix(), triangles, normals, alpha=10).indices
    report = mf.generate_simplified_point_cloud_by_saliency(
        meshes, alpha=10, customattributes=("mine",)
    )
    assert layers(meshes)[:2] == before
    light = meshes.current_mesh()
    assert light.id() == 2
    assert light.label() == "layer 1 simplified"
    assert light.face_number() == 0
    assert report["points_after"] == len(kept) == light.vertex_number() < 182
    for name in (
        "vertex_matrix", "vertex_normal_matrix", "vertex_color_matrix", "vertex_scalar_array",
        "vertex_tex_coord_matrix", "vertex_selection_array",
    ):  # fmt: skip
        assert (getattr(light, name)() == getattr(source, name)()[kept]).all(), name
    assert (light.vertex_custom_scalar_attribute_array("mine") == kept.astype(float) ** 2).all()
    assert (light.transform_matrix() == source.transform_matrix()).all()
    assert not np.allclose(source.transform_matrix(), np.eye(4))


def test_loose_points_are_kept():
    meshes = set_of(rich_mesh())
    mf.generate_simplified_point_cloud_by_saliency(meshes, alpha=50)
    assert meshes.current_mesh().vertex_matrix()[:, 0].max() >= 30


def test_absent_arrays_stay_absent():
    meshes = set_of(pymeshlab.Mesh(bumpy()))
    mf.apply(meshes, "generate_simplified_point_cloud_by_saliency", alpha=10)
    light = meshes.current_mesh()
    assert not light.has_vertex_tex_coord()
    assert not light.vertex_normal_matrix().any()
    assert light.is_point_cloud()


def test_error_between_layers():
    meshes = set_of(rich_mesh())
    mf.generate_simplified_point_cloud_by_saliency(meshes, alpha=30)
    errors = mf.get_simplification_error(meshes, originalmesh=0, simplifiedmesh=1)
    theirs = meshes.get_hausdorff_distance(
        sampledmesh=0, targetmesh=1, samplenum=10000, maxdist=pymeshlab.PureValue(100)
    )
    assert errors["point"]["max"] == pytest.approx(theirs["max"], rel=1e-5)
    assert errors["point_back"]["max"] == 0


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("compute_saliency", {}, "no filter 'compute_saliency'"),
        ("compute_scalar_by_saliency_per_vertx", {}, "did you mean compute_scalar_by_saliency_per"),
        ("compute_scalar_by_saliency_per_vertex", {"tolerence": 1}, "did you mean tolerance"),
        ("compute_scalar_by_saliency_per_vertex", {"cells": 0}, "cells=0: give a whole number"),
        ("compute_scalar_by_saliency_per_vertex", {"preset": "x"}, "preset='x'"),
        ("generate_simplified_point_cloud_by_saliency", {}, "no target given: give one of"),
        ("get_simplification_error", {"simplifiedmesh": 9}, "simplifiedmesh=9: there is no such"),
    ],
)
def test_mistakes(name, parameters, message):
    meshes = set_of(rich_mesh())
    before = layers(meshes)
    with pytest.raises(salcore.SalcoreError, match=message):
        mf.apply(meshes, name, **parameters)
    assert layers(meshes) == before


def test_an_empty_set_is_a_mistake():
    with pytest.raises(salcore.SalcoreError, match="no layer"):
        mf.compute_scalar_by_saliency_per_vertex(pymeshlab.MeshSet(verbose=False))


def test_parameters_by_either_name():
    meshes = set_of(pymeshlab.Mesh(bumpy()))
    first = mf.compute_scalar_by_saliency_per_vertex(meshes, deviationthreshold=3)
    second = mf.compute_scalar_by_saliency_per_vertex(meshes, deviation_threshold=3)
    assert first["mean_saliency"] == second["mean_saliency"]


def test_a_scan():
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(model_path("Laurana50k.ply")))
    colors = meshes.current_mesh().vertex_color_matrix()
    report = mf.apply(meshes, "generate_simplified_point_cloud_by_saliency", alpha=30)
    light = meshes.current_mesh()
    assert light.vertex_number() == report["points_after"]
    points = meshes.mesh(0).vertex_matrix()
    kept = salcore.simplify(points, meshes.mesh(0).face_matrix(), alpha=30).indices
    assert (light.vertex_color_matrix() == colors[kept]).all()


def test_decimation_stays_a_mesh_and_keeps_its_place():
    meshes = set_of(rich_mesh(), rich_mesh())
    meshes.set_matrix(transformmatrix=np.diag([2.0, 2, 2, 1]), freeze=False)
    source = meshes.current_mesh()
    points, faces = source.vertex_matrix(), source.face_matrix()
    colors, scalars = source.vertex_color_matrix(), source.vertex_scalar_array()
    expected = salcore.simplify(points, faces, ratio=0.4, point_values=colors[:, :3])
    report = mf.meshing_decimation_by_saliency(meshes, ratio=0.4)
    light = meshes.current_mesh()
    assert [m.label() for m in meshes] == ["layer 0", "layer 1"]
    assert light.transform_matrix()[0, 0] == 2
    assert (light.vertex_matrix() == points[expected.indices]).all()
    assert (light.face_matrix() == expected.faces).all()
    assert (light.vertex_color_matrix() == colors[expected.indices]).all()
    assert (light.vertex_scalar_array() == scalars[expected.indices]).all()
    assert report["points_after"] == round(0.4 * len(points))
    assert report["faces_after"] == light.face_number() > 0


def test_wedges_stay_in_their_charts():
    """Two charts meet along a seam: coordinates of one are below 1, of the other above 2."""
    points, faces = grid(21, 21)
    points[:, 2] = 3 * np.sin(points[:, 0] / 5) * np.cos(points[:, 1] / 4)
    right = points[faces].mean(axis=1)[:, 0] > 10
    wedges = points[faces][:, :, :2] / 20 + 2 * right[:, None, None]
    meshes = set_of(pymeshlab.Mesh(points, faces, w_tex_coords_matrix=wedges.reshape(-1, 2)))
    mf.meshing_decimation_by_saliency(meshes, ratio=0.2)
    light = meshes.current_mesh()
    after = light.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    corners = light.vertex_matrix()[light.face_matrix()]
    chart = after[:, :, 0] >= 2
    assert (chart.all(axis=1) | ~chart.any(axis=1)).mean() > 0.9
    exact = corners[:, :, :2] / 20 + 2 * chart[:, :, None] * [1, 1]
    assert after == pytest.approx(exact, abs=1e-6)
    assert light.has_wedge_tex_coord()


def test_a_texture_comes_along():
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(demo.sample("bunny10k_textured.obj")))
    mf.meshing_decimation_by_saliency(meshes, count=1000)
    assert list(meshes.current_mesh().textures()) == ["TextureDouble_A.png"]
    assert meshes.current_mesh().has_wedge_tex_coord()


def test_targets_in_meshlabs_units():
    meshes = set_of(rich_mesh())
    diagonal = np.linalg.norm(np.ptp(meshes.current_mesh().vertex_matrix(), axis=0))
    counts = []
    for error in (pymeshlab.PercentageValue(1), pymeshlab.PureValue(0.01 * diagonal), 0.01):
        meshes.set_current_mesh(0)
        report = mf.generate_simplified_point_cloud_by_saliency(meshes, maxerror=error)
        assert report["errors"]["surface"]["max"] <= 0.01 * diagonal
        counts.append(report["points_after"])
    assert len(set(counts)) == 1


def test_selected_points_are_protected():
    meshes = set_of(rich_mesh())
    meshes.compute_selection_by_condition_per_vertex(condselect="(y > 9)")
    chosen = meshes.current_mesh().selected_vertex_number()
    report = mf.meshing_decimation_by_saliency(meshes, count=60, protectselected=True)
    assert report["points_after"] == 60
    assert meshes.current_mesh().selected_vertex_number() == chosen == 30


def test_meshlabs_own_decimation_guided_by_saliency():
    """The way the README shows: saliency as quality, and quality as a weight."""
    errors = []
    for guided in (False, True):
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.load_new_mesh(str(model_path("Laurana50k.ply")))
        points = meshes.current_mesh().vertex_matrix()
        mf.compute_scalar_by_saliency_per_vertex(meshes)
        saliency = meshes.current_mesh().vertex_scalar_array()
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=3000, qualityweight=guided, optimalplacement=False
        )
        light = meshes.current_mesh()
        surface = salcore.make_surface(light.vertex_matrix(), light.face_matrix())
        salient = points[saliency >= np.quantile(saliency, 0.9)]
        errors.append(salcore.compare(salcore.make_surface(salient), surface).surface.rms)
    assert errors[1] < errors[0]


def test_decimation_of_a_cloud_is_a_mistake():
    meshes = set_of(pymeshlab.Mesh(bumpy()))
    with pytest.raises(salcore.SalcoreError, match="has no faces: use generate_simplified"):
        mf.meshing_decimation_by_saliency(meshes, ratio=0.5)
    meshes = set_of(rich_mesh())
    with pytest.raises(salcore.SalcoreError, match="alpha gives points"):
        mf.meshing_decimation_by_saliency(meshes, alpha=3)
