# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of levels of detail: what they are, where they stand, and what a second run does."""

import itertools

import bpy
import numpy as np
import pytest
import scenes


def levels_of(obj):
    (collection,) = [c for c in bpy.data.collections if c.name == f"{obj.name}_LODs"]
    return [o for o in sorted(collection.objects, key=lambda o: o.name) if o is not obj]


def counts(levels):
    return [len(level.data.vertices) for level in levels]


def test_the_original_is_level_0_and_alone_visible():
    obj = scenes.torus()
    assert bpy.ops.object.salient_levels(ratios="0.02, 0.5 0.1", placement="original") == {
        "FINISHED"
    }
    made = levels_of(obj)
    assert [level.name for level in made] == ["Torus_LOD1", "Torus_LOD2", "Torus_LOD3"]
    assert counts(made) == [400, 80, 16]
    assert obj.name in bpy.data.collections["Torus_LODs"].objects
    assert not obj.hide_get()
    assert not obj.hide_render
    assert all(level.hide_get() and level.hide_render for level in made)
    finer, coarser = ({tuple(p) for p in scenes.positions(level).tolist()} for level in made[:2])
    assert coarser < finer
    assert bpy.context.selected_objects == [obj]


def test_a_second_run_takes_the_place_of_the_first():
    obj = scenes.torus()
    for ratios, expected in (("50% 10%", [400, 80]), ("0.25", [200])):
        bpy.ops.object.salient_levels(ratios=ratios)
        assert counts(levels_of(obj)) == expected
        assert levels_of(obj)[0].name == "Torus_LOD1"
        assert len(bpy.data.objects) == len(bpy.data.meshes) == 1 + len(expected)
        assert len(bpy.data.collections) == 1


def test_side_by_side():
    obj = scenes.torus()
    obj.location, obj.rotation_euler = (1, 2, 3), (0.1, 0.2, 0.3)
    bpy.ops.object.salient_levels(ratios="0.5 0.1", arrange="BESIDE")
    bpy.context.view_layer.update()
    spans = []
    for each in [obj, *levels_of(obj)]:
        assert not each.hide_get()
        matrix = np.array(each.matrix_world)
        x = (scenes.positions(each) @ matrix[:3, :3].T + matrix[:3, 3])[:, 0]
        spans.append((x.min(), x.max()))
        assert tuple(each.location)[1:] == (2, 3)
    assert all(before[1] < after[0] for before, after in itertools.pairwise(spans))


def test_levels_by_triangles_and_by_error():
    obj = scenes.torus()
    bpy.ops.object.salient_levels(levels_by="FACES", ratios="100 600")
    for level, wanted in zip(levels_of(obj), (600, 100), strict=True):
        level.data.calc_loop_triangles()
        assert wanted - 2 <= len(level.data.loop_triangles) <= wanted
    bpy.ops.object.salient_levels(levels_by="MAX_ERROR", ratios="0.1;0.02")
    fine, coarse = counts(levels_of(obj))
    assert 20 < coarse < fine < 800


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("50% 25 % 2%", [0.5, 0.25, 0.02]),
        ("0.5;0.25; 0.1", [0.5, 0.25, 0.1]),
        ("0,5; 0,25", [0.5, 0.25]),
        ("0.1,0.5", [0.5, 0.1]),
        (" 1 ", [1.0]),
    ],
)
def test_how_numbers_may_be_written(module, text, expected):
    found = module("operators.levels").read_levels(text, "ratio")
    assert [level["ratio"] for level in found] == pytest.approx(expected)


@pytest.mark.parametrize("text", ["0.5 much", "", "0", "150%", "-0.5", "%", "nan"])
def test_what_is_no_ratio(text):
    scenes.torus()
    with pytest.raises(RuntimeError, match="give numbers above 0"):
        bpy.ops.object.salient_levels(ratios=text)


def test_several_objects_and_shared_data():
    first, cloud = scenes.torus(), scenes.cloud(scenes.relief())
    twin = first.copy()
    bpy.context.scene.collection.objects.link(twin)
    scenes.select(first, twin, cloud)
    bpy.ops.object.salient_levels(ratios="0.5")
    assert len(levels_of(cloud)) == 1
    chain = bpy.data.collections["Torus_LODs"].objects
    assert {obj.name for obj in chain} == {"Torus", "Torus_LOD1", "Torus.001_LOD1"}
    bpy.ops.object.salient_levels(ratios="0.5")
    assert len(bpy.data.collections["Torus_LODs"].objects) == 3
