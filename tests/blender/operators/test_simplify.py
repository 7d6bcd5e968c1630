# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplify and levels of detail on every kind of object, and what they leave alone."""

import itertools
import math

import bpy
import numpy as np
import pytest
import scenes
from models import load_crop, model_path


def new_objects(operator, **options):
    """Call an operator and return the objects that came of it."""
    before = set(bpy.data.objects)
    assert operator(**options) == {"FINISHED"}
    return sorted(set(bpy.data.objects) - before, key=lambda obj: obj.name)


def simplify(**options):
    return new_objects(
        bpy.ops.object.salient_simplify, **{"hide_source": False, "placement": "original"} | options
    )


def count(obj):
    return len(obj.data.attributes["position"].data)


@pytest.mark.parametrize("make", ["torus", "points", "cloud"])
@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"target": "RATIO", "ratio": 0.25}, 200),
        ({"target": "COUNT", "count": 123}, 123),
        ({"target": "MAX_ERROR", "max_error": 0.05}, None),
        ({"target": "ALPHA", "alpha": 10.0}, None),
    ],
)
def test_every_target_on_every_kind_of_object(make, options, expected):
    obj = scenes.torus()
    if make != "torus":
        obj = {"points": scenes.points_mesh, "cloud": scenes.cloud}[make](scenes.positions(obj))
    (result,) = simplify(**options)
    assert result.type == obj.type
    assert count(obj) == 800
    if expected is None:
        assert 20 < count(result) < 800
    else:
        assert count(result) == expected
    figures = bpy.context.window_manager.salient_simplify
    assert (figures.points_before, figures.points_after) == (800, count(result))
    if "max_error" in options:
        assert 0 < figures.max_error <= 0.05
    faces = make == "torus" and "alpha" not in options
    assert bool(result.type == "MESH" and result.data.polygons) == faces


def test_lengths_are_those_of_the_scene():
    obj = scenes.torus()
    obj.scale = (10.0, 10.0, 10.0)
    (result,) = simplify(target="MAX_ERROR", max_error=0.5)
    assert 0.25 < bpy.context.window_manager.salient_simplify.max_error <= 0.5
    obj.scale = (1.0, 1.0, 1.0)
    scenes.select(obj)
    (other,) = simplify(target="MAX_ERROR", max_error=0.05)
    assert abs(count(result) - count(other)) <= 0.02 * count(other)


def test_a_stretched_object_is_simplified_as_it_is_seen():
    obj = scenes.points_mesh(scenes.relief())
    obj.scale = (1.0, 1.0, 8.0)
    obj.rotation_euler = (0.3, 0.2, 0.1)
    (stretched,) = simplify(ratio=0.2)
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    (applied,) = simplify(ratio=0.2)
    seen = np.array(stretched.matrix_world)[:3, :3] @ scenes.positions(stretched).T
    same = np.isclose(seen.T[:, None], scenes.positions(applied)[None], atol=1e-5).all(axis=2)
    assert same.any(axis=1).mean() > 0.98


def test_everything_about_the_object_goes_along():
    obj = scenes.torus()
    parent = bpy.data.objects.new("parent", None)
    home = bpy.data.collections.new("home")
    bpy.context.scene.collection.children.link(home)
    home.objects.link(obj)
    obj.parent, obj.location, obj["mine"] = parent, (1, 2, 3), "kept"
    obj.data["mine too"] = 7
    obj.modifiers.new("sub", "SUBSURF")
    (result,) = simplify(ratio=0.5)
    assert result.parent == parent
    assert result.matrix_world == obj.matrix_world
    assert result["mine"] == "kept"
    assert result.data["mine too"] == 7
    assert {c.name for c in result.users_collection} == {c.name for c in obj.users_collection}
    assert [modifier.type for modifier in result.modifiers] == ["SUBSURF"]
    assert result.name == obj.name + "_simplified"


@pytest.mark.parametrize("output", ["NEW", "IN_PLACE"])
def test_modifiers_can_be_applied(output):
    obj = scenes.torus()
    obj.modifiers.new("sub", "SUBSURF").levels = 1
    name = obj.data.name
    made = simplify(ratio=0.25, source="EVALUATED", output=output)
    result = made[0] if output == "NEW" else obj
    assert count(result) == 800  # a quarter of 3200
    assert not result.modifiers
    assert len(bpy.data.meshes) == (2 if output == "NEW" else 1)
    if output == "NEW":
        assert len(obj.modifiers) == 1
        assert count(obj) == 800
    else:
        assert obj.data.name == name


def test_selection_active_object_and_mode_stay():
    obj, other = scenes.torus(), scenes.torus()
    other.name = "other"
    scenes.select(obj)
    (result,) = simplify(ratio=0.5)
    assert bpy.context.selected_objects == [obj]
    assert bpy.context.active_object == obj
    assert bpy.context.mode == "OBJECT"
    assert not result.select_get()


def test_the_original_is_hidden_and_the_result_selected():
    obj = scenes.torus()
    obj.hide_render = False
    bpy.ops.object.salient_simplify(ratio=0.5)
    result = bpy.data.objects["Torus_simplified"]
    assert obj.hide_get()
    assert obj.hide_render
    assert not result.hide_get()
    assert not result.hide_render
    assert bpy.context.selected_objects == [result]
    assert bpy.context.active_object == result


def test_several_objects_at_once():
    first, second = scenes.torus(), scenes.cloud(scenes.relief())
    scenes.select(second, first)
    made = simplify(ratio=0.5)
    assert [count(obj) for obj in made] == [400, 300]
    assert bpy.context.active_object == second


def test_shared_data_stay_shared():
    obj = scenes.torus()
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    other.location.x = 5
    scenes.select(obj, other)
    made = simplify(ratio=0.5)
    assert len(made) == 2
    assert made[0].data == made[1].data
    assert {tuple(o.location) for o in made} == {tuple(obj.location), tuple(other.location)}
    bpy.ops.object.salient_simplify(ratio=0.5, output="IN_PLACE")
    assert obj.data == other.data
    assert count(other) == 400


def test_data_linked_from_another_file(tmp_path):
    obj = scenes.torus()
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {obj})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    with bpy.data.libraries.load(str(library), link=True) as (there, here):
        here.objects = there.objects
    linked = here.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    scenes.select(linked)
    for call in (
        lambda: bpy.ops.object.salient_simplify(ratio=0.5, output="IN_PLACE"),
        bpy.ops.object.salient_show_saliency,
        bpy.ops.object.salient_live,
    ):
        with pytest.raises(RuntimeError, match=r"is linked from .*library\.blend.*make it local"):
            call()
    (result,) = simplify(ratio=0.5)
    assert result.library is None
    assert result.data.library is None
    assert (count(result), count(linked)) == (400, 800)


@pytest.mark.parametrize("make", [scenes.points_mesh, scenes.cloud])
def test_protected_points(make):
    obj = make(scenes.relief())
    mine = obj.data.attributes.new("mine", "BOOLEAN", "POINT")
    chosen = np.zeros(600, dtype=bool)
    chosen[::7] = True
    mine.data.foreach_set("value", chosen)
    (result,) = simplify(ratio=0.2, protect="mine")
    values = np.empty(count(result), dtype=bool)
    result.data.attributes["mine"].data.foreach_get("value", values)
    assert values.sum() == chosen.sum()
    assert count(result) == 120


def test_a_vertex_group_protects():
    obj = scenes.torus()
    group = obj.vertex_groups.new(name="keep")
    group.add(list(range(100)), 1.0, "REPLACE")
    (result,) = simplify(ratio=0.2, protect="keep")
    kept = {tuple(row) for row in scenes.positions(result).tolist()}
    assert {tuple(row) for row in scenes.positions(obj)[:100].tolist()} <= kept
    with pytest.raises(RuntimeError, match=r"no vertex group .* 'nothing'; clear the field"):
        bpy.ops.object.salient_simplify(protect="nothing")


def test_mistakes_are_one_clear_message_and_change_nothing(extension):
    obj = scenes.torus()
    obj.vertex_groups.new(name="keep").add(list(range(100)), 1.0, "REPLACE")
    before = scenes.fingerprint(extension)
    for options, message in (
        ({"target": "COUNT", "count": 3, "protect": "keep"}, "100 are protected"),
        ({"ratio": 0.5, "protect": "x"}, "is called 'x'"),
    ):
        with pytest.raises(RuntimeError, match=message) as caught:
            bpy.ops.object.salient_simplify(**options)
        assert "Traceback" not in str(caught.value)
        assert scenes.fingerprint(extension) == before


def test_poll_says_what_is_missing():
    with pytest.raises(RuntimeError, match="Select a mesh or a point cloud"):
        bpy.ops.object.salient_simplify()
    scenes.torus()
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Object Mode"):
        bpy.ops.object.salient_simplify()
    bpy.ops.object.mode_set(mode="OBJECT")
    with pytest.raises(RuntimeError, match="Select two"):
        bpy.ops.object.salient_measure()


def test_every_operator_can_be_found_and_undone(module):
    for kind in module("ui.panel").OPERATORS:
        module_name, name = kind.bl_idname.split(".")
        words = getattr(getattr(bpy.ops, module_name), name).get_rna_type()
        assert len(words.description) > 20
        assert words.name.startswith("Salient")
        assert "REGISTER" in kind.bl_options
        if "measure" not in kind.bl_idname:
            assert "UNDO" in kind.bl_options


def test_operators_take_from_the_panel_what_nobody_has_set(module):
    scenes.torus()
    settings = bpy.context.scene.salient_simplify
    settings.target, settings.count, settings.detail = "COUNT", 77, 0.0
    own = bpy.context.window_manager.operator_properties_last("object.salient_simplify")
    own.detail = 5.0
    module("settings.properties").fill_unset(own, settings)
    assert (own.target, own.count, own.detail) == ("COUNT", 77, 5.0)
    for name in own.bl_rna.properties.keys():  # noqa: SIM118
        own.property_unset(name)


def test_measure():
    obj = scenes.torus()
    (result,) = simplify(ratio=0.2)
    figures = bpy.context.window_manager.salient_simplify
    known = figures.max_error
    result.location.z += 1.0
    scenes.select(result, obj)
    assert bpy.ops.object.salient_measure() == {"FINISHED"}
    assert figures.max_error > known
    result.location.z -= 1.0
    bpy.ops.object.salient_measure()
    assert math.isclose(figures.max_error, known, rel_tol=1e-4)
    assert figures.title == "Torus_simplified against Torus"
    assert len(bpy.data.meshes) == 2


def test_measure_takes_two():
    obj = scenes.torus()
    flat = obj.copy()
    bpy.context.collection.objects.link(flat)
    flat.scale.z = 0.0
    scenes.select(obj, flat)
    with pytest.raises(RuntimeError, match="its scale is 0 along an axis"):
        bpy.ops.object.salient_measure()


def test_a_scan_from_a_file():
    bpy.ops.wm.ply_import(filepath=str(model_path("bun_zipper.ply")))
    obj = bpy.context.active_object
    scenes.select(obj)
    (result,) = simplify(ratio=0.1)
    assert count(result) == round(0.1 * count(obj))
    assert not result.data.validate(verbose=True)
    assert bpy.context.window_manager.salient_simplify.max_error < 0.02 * max(obj.dimensions)


def test_undo_gives_everything_back(extension):
    scenes.torus()
    bpy.ops.ed.undo_push(message="start")
    window = bpy.context.window_manager.windows[0]
    for call in (
        lambda: bpy.ops.object.salient_simplify(ratio=0.5, output="IN_PLACE"),
        lambda: bpy.ops.object.salient_simplify(ratio=0.5),
        bpy.ops.object.salient_show_saliency,
        bpy.ops.object.salient_live,
        bpy.ops.object.salient_levels,
    ):
        before = scenes.fingerprint(extension)
        assert call() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="done")
        assert scenes.fingerprint(extension) != before
        with bpy.context.temp_override(window=window):
            bpy.ops.ed.undo()
        assert scenes.fingerprint(extension) == before


def test_a_cloud_in_place_keeps_its_name_materials_and_properties():
    obj = scenes.cloud(scenes.relief())
    obj.data.name, obj.data["mine"] = "scan", 3
    obj.data.materials.append(bpy.data.materials.new("dust"))
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    bpy.ops.object.salient_simplify(ratio=0.25, output="IN_PLACE")
    assert count(obj) == 150
    assert other.data == obj.data
    assert obj.data.name == "scan"
    assert obj.data["mine"] == 3
    assert [material.name for material in obj.data.materials] == ["dust"]
    assert len(bpy.data.pointclouds) == 1


def test_modifiers_that_change_the_type():
    obj = scenes.torus()
    group = bpy.data.node_groups.new("points", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = [
        group.nodes.new(k)
        for k in ("NodeGroupInput", "GeometryNodeMeshToPoints", "NodeGroupOutput")
    ]
    for start, end in itertools.pairwise(nodes):
        group.links.new(start.outputs[0], end.inputs[0])
    obj.modifiers.new("points", "NODES").node_group = group
    before = len(bpy.data.meshes), len(bpy.data.pointclouds)
    with pytest.raises(RuntimeError, match="change its type; let the result be a new object"):
        bpy.ops.object.salient_simplify(ratio=0.5, source="EVALUATED", output="IN_PLACE")
    assert (len(bpy.data.meshes), len(bpy.data.pointclouds)) == before
    obj["mine"] = "kept"
    (result,) = simplify(ratio=0.5, source="EVALUATED")
    assert result.type == "POINTCLOUD"
    assert count(result) == 400
    assert result["mine"] == "kept"


@pytest.mark.parametrize("make", [scenes.points_mesh, scenes.cloud])
def test_broken_coordinates_and_duplicates(make):
    points = scenes.relief()
    points[5], points[6, 1] = np.nan, np.inf
    points[10:20] = points[30]
    obj = make(points)
    (result,) = simplify(target="COUNT", count=100)
    assert count(result) == 100
    assert np.isfinite(scenes.positions(result)).all()
    with pytest.raises(RuntimeError, match="2 of 600 are NaN or infinite"):
        bpy.ops.object.salient_simplify(ratio=0.5, invalid="refuse")
    bpy.ops.object.salient_live(ratio=0.1)
    bpy.ops.object.salient_show_saliency()
    assert count(obj) == 600


@pytest.mark.parametrize(
    "name", ["abominevole.off", "degtri_sliding.off", "non_manif_hole.ply", "sliver_tet.ply"]
)
def test_nasty_meshes(name):
    points, faces = load_crop(f"nasty/{name}", 2_500)
    mesh = bpy.data.meshes.new("nasty")
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    mesh.validate()
    obj = scenes.link(mesh)
    for ratio in (0.9, 0.5, 0.1):
        (result,) = simplify(ratio=ratio)
        assert count(result) == max(round(ratio * count(obj)), 1)
        assert not result.data.validate(verbose=True)
    bpy.ops.object.salient_live(ratio=0.3)
    bpy.ops.object.salient_show_regions()
