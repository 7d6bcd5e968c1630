# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings, presets and panels name what exists.

Blender draws no panel without a window. A layout that looks every name up in Blender's own
registry takes its place here.
"""

import re
from types import SimpleNamespace

import bpy
import pytest
import scenes


class Layout:
    """Takes what panels draw, and looks up all names."""

    def __init__(self, drawn=None):
        self.drawn = [] if drawn is None else drawn

    def nested(self, *args, **options):
        return Layout(self.drawn)

    box = column = row = nested

    def panel(self, name, default_closed=False):
        return Layout(self.drawn), Layout(self.drawn)

    def prop(self, data, name, **options):
        assert name in data.bl_rna.properties, name
        self.drawn.append(name)

    def prop_search(self, data, name, where, collection, **options):
        assert name in data.bl_rna.properties, name
        assert collection in where.bl_rna.properties, collection
        self.drawn.append(name)

    def operator(self, name, text=""):
        module, function = name.split(".")
        kind = getattr(getattr(bpy.ops, module), function).get_rna_type()
        self.drawn.append(name)
        return SimpleNamespace(**dict.fromkeys(kind.properties.keys()))

    def label(self, text=""):
        self.drawn.append(text)

    def progress(self, factor, text):
        assert 0.0 <= factor <= 1.0
        self.drawn.append(text)


class Shown:
    """What a panel's draw gets as itself."""

    def __init__(self, kind):
        self.layout = Layout()
        for name in dir(kind):
            if name.startswith("_draw"):
                setattr(self, name, getattr(kind, name).__get__(self))
        kind.draw(self, bpy.context)


def test_every_row_of_the_table_is_a_property(module):
    salcore, properties = module("salcore"), module("settings.properties")
    settings = bpy.context.scene.salient_simplify
    defaults = properties.preset("default")
    for row in properties.ROWS:
        words = settings.bl_rna.properties[row.name]
        assert words.name == module("settings.words").label(row)
        assert module("settings.words").sentence(row).rstrip(".") in words.description
        assert row.symbol in words.description
        assert getattr(settings, row.name) == pytest.approx(getattr(defaults, row.name))
        if row.type in (int, float):
            assert words.hard_min == pytest.approx(max(row.minimum, -(2**31)))
    assert {row.name for row in salcore.TABLE} - {row.name for row in properties.ROWS} == {
        "error_unit"
    }


def test_every_tooltip_says_what_more_does(module):
    properties = module("settings.properties")
    settings = bpy.context.scene.salient_simplify.bl_rna.properties
    numbers = {row.name for row in properties.ROWS if row.type in (int, float)}
    numbers |= {"max_error", "alpha", "importance_factor"}
    for name in numbers:
        words = settings[name].description.lower()
        assert re.search(r"\bmore\b", words.replace("no removed point is more", "")), name
    # What anyone may turn stands in one panel, what only the paper explains in a closed one.
    panel = module("ui.panel")
    quality = Shown(panel.VIEW3D_PT_salient_quality).layout.drawn
    assert {"detail", "evenness", "level", "keep_seams", "keep_sharp", "keep_border"} <= {*quality}
    assert "placement" in Shown(panel.VIEW3D_PT_salient).layout.drawn
    for name in properties.QUALITY:
        assert "Paper:" not in settings[name].description or name == "level"
    paper = panel.VIEW3D_PT_salient_advanced
    assert paper.bl_label == "More Parameters"
    assert "DEFAULT_CLOSED" in paper.bl_options


@pytest.mark.parametrize("name", ["Default", "Detail", "Even", "Paper"])
def test_presets(module, name):
    settings = bpy.context.scene.salient_simplify
    settings.cells, settings.detail, settings.graph = 3, 99.0, "delaunay"
    (path,) = (
        file
        for folder in bpy.utils.preset_paths("salient_simplify")
        for file in __import__("pathlib").Path(folder).glob(f"{name}.py")
    )
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname="VIEW3D_PT_salient_presets")
    expected = module("settings.properties").preset(name.lower()).as_dict()
    for key in (row.name for row in module("settings.properties").ROWS):
        assert getattr(settings, key) == pytest.approx(expected[key]), key


def test_a_preset_of_ones_own():
    settings = bpy.context.scene.salient_simplify
    settings.cells, settings.graph = 5, "delaunay"
    bpy.ops.object.salient_preset_add(name="mine")
    settings.cells, settings.graph = 8, "surface"
    (path,) = (
        file
        for folder in bpy.utils.preset_paths("salient_simplify")
        for file in __import__("pathlib").Path(folder).glob("mine.py")
    )
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname="VIEW3D_PT_salient_presets")
    assert (settings.cells, settings.graph) == (5, "delaunay")


def test_the_panels_draw_what_there_is(module):
    panel = module("ui.panel")
    drawn = Shown(panel.VIEW3D_PT_salient).layout.drawn
    assert drawn[:3] == ["target", "ratio", "object.salient_simplify"]
    assert drawn[3] == "object.salient_preview"
    scenes.torus()
    bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.5)
    bpy.context.scene.salient_simplify.target = "MAX_ERROR"
    drawn = Shown(panel.VIEW3D_PT_salient).layout.drawn
    assert drawn[1] == "max_error"
    kept = Shown(panel.VIEW3D_PT_salient_quality).layout.drawn
    assert {"protect", "importance", "keep_seams", "keep_border"} <= set(kept)
    text = " ".join(drawn)
    assert "400 of 800 points" in text
    assert "50.00% removed" in text
    assert "Largest error" in text
    figures = module("settings.figures").figures
    figures.stage, figures.fraction = "Graph", 0.5
    drawn = Shown(panel.VIEW3D_PT_salient).layout.drawn
    assert "Graph (Esc: cancel)" in drawn
    assert "object.salient_simplify" not in drawn
    figures.stage, figures.preview = "", "shown"
    drawn = Shown(panel.VIEW3D_PT_salient).layout.drawn
    assert drawn[2:4] == ["object.salient_preview_end"] * 2
    figures.preview = ""
    names = [row.name for row in module("settings.properties").ROWS]
    panels = ("VIEW3D_PT_salient", "VIEW3D_PT_salient_quality", "VIEW3D_PT_salient_advanced")
    drawn = [name for kind in panels for name in Shown(getattr(panel, kind)).layout.drawn]
    assert sorted(name for name in drawn if name in names) == sorted(names)  # each once
    more = Shown(panel.VIEW3D_PT_salient_more).layout.drawn
    menu = Shown(panel.VIEW3D_MT_salient).layout.drawn
    assert {kind.bl_idname for kind in panel.OPERATORS} == set(menu)
    assert set(menu) - {"object.salient_simplify"} <= set(more)


def test_all_buttons_are_grey_while_work_goes_on(module):
    scenes.torus()
    operators = [kind.bl_idname.split(".") for kind in module("ui.panel").OPERATORS]
    calls = [getattr(getattr(bpy.ops, place), name) for place, name in operators]
    ready = [call.poll() for call in calls]
    assert ready.count(False) == 1  # measuring wants two objects
    figures = module("settings.figures").figures
    figures.stage = "Graph"
    assert not any(call.poll() for call in calls)
    figures.stage = ""
    assert [call.poll() for call in calls] == ready


def test_the_extension_can_be_taken_off_and_put_on_again(extension):
    name = extension.__name__
    bpy.ops.preferences.addon_disable(module=name)
    assert not hasattr(bpy.types.Scene, "salient_simplify")
    assert not hasattr(bpy.types, "VIEW3D_PT_salient")
    assert not bpy.utils.preset_paths("salient_simplify") or all(
        "extensions" not in path for path in bpy.utils.preset_paths("salient_simplify")
    )
    bpy.ops.preferences.addon_enable(module=name)
    assert hasattr(bpy.types.Scene, "salient_simplify")
