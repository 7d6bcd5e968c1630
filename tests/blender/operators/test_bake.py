# SPDX-License-Identifier: GPL-3.0-or-later
"""A baked normal map shows the original's normals on the light mesh, and nothing else changes."""

import time
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from mathutils.interpolate import poly_3d_calc

SIZE = 160


def bumpy(segments=72):
    """Return a smooth sphere with bumps, without a UV map."""
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=segments, ring_count=segments // 2, calc_uvs=False
    )
    obj = bpy.context.active_object
    obj.name = "Statue"
    places = scenes.positions(obj).astype("f8")
    places *= 1.0 + 0.05 * np.prod(np.sin(8.0 * places), axis=1, keepdims=True)
    obj.data.vertices.foreach_set("co", places.astype("f4").ravel())
    obj.data.shade_smooth()
    scenes.select(obj)
    return obj


def pair(ratio=0.05):
    """Return a bumpy sphere and its simplified self, which is active and alone selected."""
    original = bumpy()
    bpy.ops.object.salient_simplify(ratio=ratio, measure=False)
    result = bpy.context.active_object
    assert result.name == "Statue_simplified"
    return original, result


def image_of(obj):
    """Return the image of an object's first material, as pixels (s, s, 3) from the lower left."""
    node = obj.material_slots[0].material.node_tree.nodes["Salient Image"]
    image = node.image
    assert image.colorspace_settings.name == "Non-Color"
    values = np.empty(image.size[0] * image.size[1] * 4, dtype="f4")
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[..., :3]


def angles(result, original, uv_map):
    """Return angles in degrees, at the middles of faces: of mapped and of bare normals, each
    with the original's where a ray from the face meets it."""
    pixels = image_of(result)
    size = len(pixels)
    mesh = result.data
    mesh.calc_tangents(uvmap=uv_map)
    uv = mesh.uv_layers[uv_map].uv
    depsgraph = bpy.context.evaluated_depsgraph_get()
    original.hide_set(False)
    tree = BVHTree.FromObject(original, depsgraph)
    fine = original.data
    world = result.matrix_world
    turned, source = world.inverted_safe().transposed().to_3x3(), original.matrix_world
    into = source.inverted()
    found = []
    for polygon in mesh.polygons:
        corners = [mesh.loops[k] for k in polygon.loop_indices]
        normal = sum((c.normal for c in corners), Vector()).normalized()
        tangent = sum((c.tangent for c in corners), Vector()).normalized()
        across = corners[0].bitangent_sign * normal.cross(tangent)
        place = sum((uv[c.index].vector for c in corners), Vector((0.0, 0.0))) / len(corners)
        x, y, z = (2.0 * pixels[int(place.y * size), int(place.x * size)] - 1.0).tolist()
        mapped = (turned @ (x * tangent + y * across + z * normal)).normalized()
        bare = (turned @ normal).normalized()
        start = world @ polygon.center + 0.2 * bare
        hit = tree.ray_cast(into @ start, into.to_3x3() @ -bare)
        if hit[0] is None:
            continue
        polygon = fine.polygons[hit[2]]
        places = [fine.vertices[k].co for k in polygon.vertices]
        shares = poly_3d_calc(places, hit[0])
        normals = (fine.corner_normals[k].vector for k in polygon.loop_indices)
        smooth = sum((w * n for w, n in zip(shares, normals, strict=True)), Vector())
        true = (source.inverted_safe().transposed().to_3x3() @ smooth).normalized()
        found.append([np.degrees(each.angle(true)) for each in (mapped, bare)])
    return np.array(found).T


def test_the_map_gives_the_originals_normals():
    original, result = pair()
    before = {block.name for block in (*bpy.data.scenes, *bpy.data.objects, *bpy.data.meshes)}
    assert bpy.ops.object.salient_bake(bake_size=SIZE) == {"FINISHED"}
    pixels = image_of(result)
    assert pixels.shape == (SIZE, SIZE, 3)
    bent = np.abs(pixels - [0.5, 0.5, 1.0]).max(axis=2) > 0.05
    assert bent.mean() > 0.1
    mapped, bare = angles(result, original, "Bake")
    assert len(mapped) > 0.95 * len(result.data.polygons)
    assert np.median(bare) > 6.0
    assert np.median(mapped) < 2.0  # the original's own faces turn by that much
    assert np.quantile(mapped, 0.95) < 6.0
    assert {b.name for b in (*bpy.data.scenes, *bpy.data.objects, *bpy.data.meshes)} == before


@pytest.mark.parametrize("scale", [(20.0, 20.0, 20.0), (0.02, 0.02, 0.02), (1.0, 1.3, -1.2)])
def test_objects_may_be_scaled_and_turned(scale):
    original = bumpy()
    original.scale, original.rotation_euler, original.location = scale, (0.3, 1.0, -0.5), (5, 6, 7)
    bpy.ops.object.salient_simplify(ratio=0.05, measure=False)
    result = bpy.context.active_object
    bpy.ops.object.salient_bake(bake_size=SIZE)
    mapped, bare = angles(result, original, "Bake")
    assert np.median(mapped) < 0.25 * np.median(bare)


def test_parents_and_modifiers_count():
    """A shape key makes the original's bumps; both hang on a turned and scaled empty."""
    parent = bpy.data.objects.new("parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale, parent.rotation_euler, parent.location = (
        (3.0, 3.0, 3.0),
        (1.0, 0.5, 0.0),
        (9, 0, 0),
    )
    original = bumpy()
    original.parent = parent
    bpy.context.view_layer.update()
    flat = original.data.copy()
    smooth = scenes.positions(original) / np.linalg.norm(
        scenes.positions(original), axis=1, keepdims=True
    )
    bumps = original.shape_key_add(name="Basis"), original.shape_key_add(name="bumps")
    bumps[0].data.foreach_set("co", smooth.ravel())
    bumps[1].value = 1.0
    bpy.ops.object.salient_simplify(ratio=0.05, measure=False, source="EVALUATED")
    result = bpy.context.active_object
    result.modifiers.new("wave", "TRIANGULATE")
    bpy.ops.object.salient_bake(bake_size=SIZE)
    original.shape_key_clear()
    original.data = flat  # what the shape key made
    mapped, bare = angles(result, original, "Bake")
    assert np.median(mapped) < 0.3 * np.median(bare)


def test_scales_that_differ_much_are_told(capfd):
    original = bumpy(24)
    original.scale = (1.0, 3.0, 2.0)
    bpy.ops.object.salient_simplify(ratio=0.5, measure=False)
    bpy.ops.object.salient_bake(bake_size=32)
    assert "apply its scale first" in capfd.readouterr().out


def test_everything_else_stays_as_it_was(extension):
    original, result = pair()
    original.hide_set(True)
    original.hide_render = True
    hidden = bpy.data.collections.new("hidden")
    bpy.context.scene.collection.children.link(hidden)
    hidden.objects.link(original)
    bpy.context.scene.collection.objects.unlink(original)
    bpy.context.view_layer.layer_collection.children["hidden"].hide_viewport = True
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.bake.margin, scene.cycles.samples = 3, 77
    bpy.ops.mesh.primitive_cube_add(location=(3, 0, 0))
    cube = bpy.context.active_object
    scenes.select(result)
    assert bpy.ops.object.salient_bake(bake_size=SIZE) == {"FINISHED"}
    assert (scene.render.engine, scene.render.bake.margin) == ("BLENDER_WORKBENCH", 3)
    assert scene.cycles.samples == 77
    assert bpy.context.scene == scene
    assert len(bpy.data.scenes) == 1
    assert bpy.context.selected_objects == [result]
    assert bpy.context.active_object == result
    assert original.hide_get()
    assert original.hide_render
    assert not cube.hide_get()
    assert len(bpy.data.images) == 1
    (material,) = bpy.data.materials
    assert result.material_slots[0].material == material
    assert not original.material_slots
    mapped, _ = angles(result, original, "Bake")
    assert np.median(mapped) < 2.0


def test_the_image_is_kept_in_the_file(tmp_path):
    _, result = pair()
    bpy.ops.object.salient_bake(bake_size=SIZE)
    before = image_of(result)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    np.testing.assert_array_equal(image_of(bpy.data.objects["Statue_simplified"]), before)


def test_a_second_bake_takes_the_place_of_the_first():
    _, result = pair()
    bpy.ops.object.salient_bake(bake_size=64)
    bpy.ops.object.salient_bake(bake_size=SIZE)
    assert [image.size[0] for image in bpy.data.images] == [SIZE]
    assert len(bpy.data.materials) == 1
    assert [layer.name for layer in result.data.uv_layers] == ["Bake"]
    nodes = result.material_slots[0].material.node_tree.nodes
    assert sum(node.type == "TEX_IMAGE" for node in nodes) == 1


def test_materials_are_copied_and_keep_their_look():
    original = bumpy()
    red, bare = (bpy.data.materials.new(name) for name in ("red", "bare"))
    if bpy.app.version < (5, 0):
        red.use_nodes = True
    shader = red.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (1.0, 0.0, 0.0, 1.0)
    for material in (red, bare, None):
        original.data.materials.append(material)
    numbers = np.arange(len(original.data.polygons)) % 3
    original.data.polygons.foreach_set("material_index", numbers.astype("i4"))
    bpy.ops.object.salient_simplify(ratio=0.2, measure=False)
    result = bpy.context.active_object
    bpy.ops.object.salient_bake(bake_size=SIZE)
    assert [slot.material for slot in original.material_slots] == [red, bare, None]
    assert not shader.inputs["Normal"].is_linked
    names = [slot.material.name for slot in result.material_slots]
    assert names == ["red baked", "bare baked", "Statue_simplified baked"]
    images = set()
    for slot in result.material_slots:
        nodes = slot.material.node_tree.nodes
        link = nodes["Principled BSDF"].inputs["Normal"].links[0]
        assert link.from_node == nodes["Salient Normal Map"]
        images.add(nodes["Salient Image"].image)
    assert len(images) == 1
    baked = result.material_slots[0].material.node_tree.nodes["Principled BSDF"]
    assert tuple(baked.inputs["Base Color"].default_value) == (1.0, 0.0, 0.0, 1.0)
    mapped, _ = angles(result, original, "Bake")
    assert np.median(mapped) < 2.0


def test_a_carried_map_is_taken_where_it_fits(capfd):
    original = bumpy()
    scenes.select(original)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(island_margin=0.02)
    bpy.ops.object.mode_set(mode="OBJECT")
    original.data.uv_layers[0].name = "carried"
    bpy.ops.object.salient_simplify(ratio=0.2, measure=False)
    result = bpy.context.active_object
    bpy.ops.object.salient_bake(bake_size=SIZE)
    assert [layer.name for layer in result.data.uv_layers] == ["carried"]
    nodes = result.material_slots[0].material.node_tree.nodes
    assert nodes["Salient Normal Map"].uv_map == nodes["Salient UV Map"].uv_map == "carried"
    mapped, _ = angles(result, original, "carried")
    assert np.median(mapped) < 2.0
    assert "UV map" not in capfd.readouterr().out
    bpy.ops.object.salient_bake(bake_size=SIZE, bake_unwrap=True)
    assert [layer.name for layer in result.data.uv_layers] == ["carried", "Bake"]
    assert result.data.uv_layers.active.name == "carried"
    assert result.data.uv_layers["carried"].active_render
    mapped, _ = angles(result, original, "Bake")
    assert np.median(mapped) < 2.0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda uv: np.column_stack([np.abs(uv[:, 0] - 0.5), uv[:, 1]]), "overlaps itself on"),
        (lambda uv: 8.0 * uv, "leaves the image"),
        (lambda uv: 0.0 * uv, "has no area"),
        (lambda uv: uv, None),
    ],
)
def test_a_map_that_does_not_fit_is_told(change, said, module):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=7, calc_uvs=True)
    mesh, unwrap = bpy.context.active_object.data, module("geometry.unwrap")
    name = mesh.uv_layers[0].name
    values = change(unwrap.coordinates(mesh, name)).astype("f4")
    module("geometry.attributes").write(mesh.attributes[name], values)
    found = unwrap.problem(mesh, name)
    if said is None:
        assert found == ""
    else:
        assert said in found
        assert "Unwrap Anew" in found


def test_the_share_that_overlaps(module):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=10, y_subdivisions=10, calc_uvs=True)
    mesh, unwrap = bpy.context.active_object.data, module("geometry.unwrap")
    name = mesh.uv_layers[0].name
    uv = unwrap.coordinates(mesh, name)
    folded = np.column_stack([np.where(uv[:, 0] > 0.75, 1.5 - uv[:, 0], uv[:, 0]), uv[:, 1]])
    module("geometry.attributes").write(mesh.attributes[name], folded.astype("f4"))
    corners = folded[module("geometry.read").triangles(mesh)[1]]
    assert unwrap._covered_twice(corners) == pytest.approx(0.2 / 0.7, abs=0.01)


def cannot(said, extension, **settings):
    before = scenes.fingerprint(extension)
    with pytest.raises(RuntimeError, match=said) as caught:
        bpy.ops.object.salient_bake(**{"bake_size": 32, **settings})
    assert "Traceback" not in str(caught.value)
    assert scenes.fingerprint(extension) == before
    assert len(bpy.data.scenes) == 1
    assert not len(bpy.data.images)


def test_without_an_original_nothing_happens(extension):
    scenes.torus()
    cannot("Torus: has no original known; select it, and last the simplified mesh", extension)


def test_with_a_lost_original_nothing_happens(extension):
    original, result = pair()
    original.name = "renamed"
    cannot("its original 'Statue' is not in the scene", extension)
    original.hide_set(False)
    original.select_set(True)
    assert bpy.context.active_object == result
    bpy.ops.object.salient_bake(bake_size=32)


def test_a_cloud_and_a_mesh_without_faces_are_refused(extension):
    points = scenes.points_mesh(scenes.relief())
    cloud = scenes.cloud(scenes.relief())
    torus = scenes.torus()
    scenes.select(torus, cloud)
    cannot("points.*: is a cloud and has no surface", extension)
    scenes.select(torus, points)
    cannot("points: has no faces", extension)
    scenes.select(points, torus)
    cannot("points: has no faces", extension)
    scenes.select(torus, points, cloud)
    cannot("Torus: 2 others are selected", extension)


def test_eight_maps_are_the_most(extension):
    _, result = pair()
    for k in range(8):
        result.data.uv_layers.new(name=f"map {k}")
    cannot("has 8 UV maps", extension, bake_unwrap=True)


def test_without_cycles_nothing_happens(extension):
    pair()
    bpy.ops.preferences.addon_disable(module="cycles")
    try:
        cannot("Cycles is not there", extension)
    finally:
        bpy.ops.preferences.addon_enable(module="cycles")


def test_a_given_cage_is_taken():
    original, result = pair()
    bpy.ops.object.salient_bake(bake_size=SIZE, bake_cage=1e-5)
    mapped, _ = angles(result, original, "Bake")
    assert np.median(mapped) > 3.0  # rays that begin inside of the bumps miss them
    bpy.ops.object.salient_bake(bake_size=SIZE, bake_cage=0.05)
    mapped, _ = angles(result, original, "Bake")
    assert np.median(mapped) < 2.0


def test_undo_takes_it_back():
    _, result = pair()
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.object.salient_bake("EXEC_DEFAULT", True, bake_size=32)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo()
    result = bpy.data.objects["Statue_simplified"]
    assert not result.material_slots
    assert not len(result.data.uv_layers)


def staged(module, original, result, task_size=SIZE):
    """Return a stage whose result has a UV map, and what to bake on it."""
    stage = module("geometry.baking").Stage(bpy.context, original, result)
    assert stage.prepare(task_size, False) == []
    return stage, module("geometry.bake_child").Task(task_size, 0.03, stage.uv_map)


def test_another_process_bakes_the_same(module):
    original, result = pair()
    stage, task = staged(module, original, result)
    child = stage.begin(task)
    while not child.over():
        time.sleep(0.05)
    image = child.take()
    child.close()
    here = stage.bake(task)
    stage.discard()
    found = [np.empty(4 * SIZE * SIZE, dtype="f4") for _ in range(2)]
    for values, each in zip(found, (image, here), strict=True):
        each.pixels.foreach_get(values)
    np.testing.assert_array_equal(*found)
    assert image.packed_file is not None
    assert not image.filepath_raw


def test_another_process_is_ended_at_once(module):
    original, result = pair()
    stage, task = staged(module, original, result)
    child = stage.begin(task._replace(size=8192))
    folder = Path(child._folder.name)
    assert folder.exists()
    assert not child.over()
    child.close()
    stage.discard()
    assert child.over()
    assert not folder.exists()
    assert len(bpy.data.scenes) == 1


def test_what_another_process_cannot_do_is_one_sentence(module):
    original, result = pair()
    stage, task = staged(module, original, result)
    stage.original.data = bpy.data.meshes.new("empty")
    child = stage.begin(task._replace(uv_map="lost"))
    while not child.over():
        time.sleep(0.05)
    with pytest.raises(
        module("geometry.read").HostError, match="Blender could not bake: "
    ) as caught:
        child.take()
    assert "\n" not in str(caught.value)
    child.close()
    stage.discard()
