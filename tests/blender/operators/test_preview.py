# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview follows the target, and is applied or leaves nothing behind."""

import bpy
import pytest
import scenes


@pytest.fixture
def begin(module, work):
    """Return a function that begins a preview and waits for its first result."""

    def make(**settings):
        scene = bpy.context.scene.salient_simplify
        for name, value in ({"placement": "original"} | settings).items():
            setattr(scene, name, value)
        preview = module("operators.preview").Preview(bpy.context, scene, work.host)
        wait(preview)
        return preview

    def wait(preview):
        while preview.advance(bpy.context) != "changed":
            work.host.wait(0.05)

    make.wait = wait
    return make


def polygons(obj):
    return [p.vertices[:] for p in obj.data.polygons] if obj.type == "MESH" else []


def shown(preview):
    return [
        len(obj.data.attributes["position"].data) for copies in preview.copies for obj in copies
    ]


@pytest.mark.parametrize("kind", ["mesh", "weighted", "points", "cloud"])
def test_one_object_follows_the_target_and_is_what_simplify_makes(begin, kind):
    obj = scenes.torus()
    if kind in ("points", "cloud"):
        make = {"points": scenes.points_mesh, "cloud": scenes.cloud}[kind]
        obj = make(scenes.positions(obj))
    if kind == "weighted":
        obj.vertex_groups.new(name="a").add(list(range(100)), 0.5, "REPLACE")
    data_before = len(bpy.data.meshes) + len(bpy.data.pointclouds)
    preview = begin(ratio=0.5, placement="optimal")
    (made,) = preview.copies[0]
    settings = bpy.context.scene.salient_simplify
    assert shown(preview) == [400]
    for target, value, count in (("RATIO", 0.1, 80), ("COUNT", 123, 123), ("RATIO", 0.9, 720)):
        settings.target = target
        setattr(settings, target.lower(), value)
        begin.wait(preview)
        assert preview.copies == [[made]]
        assert shown(preview) == [count]
        assert made.name == obj.name + "_simplified"
        assert len(bpy.data.meshes) + len(bpy.data.pointclouds) == data_before + 1
        assert bpy.context.window_manager.salient_simplify.points_after == count
    assert preview.advance(bpy.context) == "wait"
    figures = bpy.context.window_manager.salient_simplify
    assert figures.title == f"{obj.name}: a draft, refined by Apply"
    preview.finish()  # what was shown were drafts
    begin.wait(preview)
    assert figures.title == obj.name
    assert preview.copies == [[made]]
    preview.apply()
    places, faces = scenes.positions(made).tolist(), polygons(made)
    bpy.data.objects.remove(made)
    obj.hide_set(False)
    scenes.select(obj)
    bpy.ops.object.salient_simplify(ratio=0.9, hide_source=False)
    result = bpy.data.objects[obj.name + "_simplified"]
    assert places == scenes.positions(result).tolist()
    assert faces == polygons(result)


def test_discarded_it_has_never_been(begin, extension):
    obj, other = scenes.torus(), scenes.cloud(scenes.relief())
    scenes.select(obj, other)
    before = scenes.fingerprint(extension)
    preview = begin(ratio=0.5)
    assert shown(preview) == [400, 300]
    assert obj.hide_get()
    assert obj.hide_render
    bpy.context.scene.salient_simplify.ratio = 0.2
    begin.wait(preview)
    assert scenes.fingerprint(extension) != before
    preview.discard(bpy.context)
    assert scenes.fingerprint(extension) == before
    assert not obj.hide_render
    assert not bpy.context.window_manager.salient_simplify.title


def test_discarded_while_the_first_result_is_worked_on(module, work, extension):
    scenes.torus()
    before = scenes.fingerprint(extension)
    scene = bpy.context.scene.salient_simplify
    preview = module("operators.preview").Preview(bpy.context, scene, work.host)
    preview.advance(bpy.context)
    preview.discard(bpy.context)
    assert scenes.fingerprint(extension) == before


def test_a_target_that_cannot_be_reached_leaves_what_is_shown(module, begin):
    obj = scenes.torus()
    obj.vertex_groups.new(name="keep").add(list(range(100)), 1.0, "REPLACE")
    preview = begin(target="COUNT", count=200, protect="keep")
    settings = bpy.context.scene.salient_simplify
    settings.count = 3
    with pytest.raises(module("salcore").SalcoreError, match="100 are protected"):
        begin.wait(preview)
    assert shown(preview) == [200]
    settings.count = 150
    begin.wait(preview)
    assert shown(preview) == [150]


def test_other_operators_wait_for_the_end_of_a_preview(module):
    scenes.torus()
    figures = module("settings.figures").figures
    assert not bpy.ops.object.salient_preview_end.poll()
    figures.preview = "shown"
    try:
        assert not bpy.ops.object.salient_simplify.poll()
        assert not bpy.ops.object.salient_preview.poll()
        assert bpy.ops.object.salient_preview_end(apply=False) == {"FINISHED"}
        assert figures.preview == "discard"
    finally:
        figures.preview = ""
