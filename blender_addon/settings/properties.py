# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender properties made from salcore's table, once for the panel and once for operators."""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..geometry import read
from ..salcore import PRESETS, TABLE, TARGETS, Parameter, Parameters
from . import baking
from .figures import Figures, figures
from .words import choice_label, label, sentence

HIDDEN = {"error_unit"}
"""Rows that a scene decides: lengths are always in its unit."""
ROWS = tuple(row for row in TABLE if row.name not in HIDDEN)
QUALITY = (
    "detail", "evenness", "level", "regions_of_interest", "interest_density", "refine",
)  # fmt: skip
"""Rows that anyone may want to turn, in a panel of their own."""
GROUPS = tuple(dict.fromkeys(row.group for row in ROWS))
"""The stages in the paper's order; each is a heading of the panel of all other rows."""

SOURCES = (
    ("ORIGINAL", "Original", "The object's own geometry, before its modifiers; they stay"),
    ("EVALUATED", "With Modifiers", "What the modifiers make of it; they are applied"),
)
OUTPUTS = (
    ("NEW", "New Object", "Put the result into a new object beside the original"),
    ("IN_PLACE", "In Place", "Replace the geometry of the object and of all that share it"),
)
DEFAULTS = {"placement": "optimal"}
"""Defaults that are others than the table's: in Blender a mesh is to look like the original."""
LEVEL_TARGETS = ("ratio", "faces", "max_error")
"""What levels of detail can be chosen by."""
SOFT_MAXIMUM = {"ratio": 1.0, "alpha": 100.0, "max_error": 10.0, "detail": 10.0, "evenness": 2.0}

MORE_PRESETS = {
    "detail": {"detail": 10.0},
    "even": {"detail": 0.0, "evenness": 1.0},
}
"""Presets beside salcore's, as changes to its default."""


def _property(row: Parameter, options: set[str]) -> Any:
    """Return the Blender property of a row of the table."""
    symbol = f" Paper: {row.symbol}." if row.symbol else ""
    words: dict[str, Any] = {
        "name": label(row),
        "description": (sentence(row) + symbol).rstrip("."),  # Blender adds the full stop
        "default": DEFAULTS.get(row.name, row.default),
        "options": options,
    }
    if row.type is bool:
        return BoolProperty(**words)
    if row.type is str:
        items = tuple((choice, choice_label(choice), "") for choice in row.choices)
        return EnumProperty(items=items, **words)
    if row.type is int:
        return IntProperty(min=int(row.minimum), max=min(int(row.maximum), 2**31 - 1), **words)
    if row.name == "ratio":
        words |= {"subtype": "FACTOR", "precision": 4}
    if row.name == "max_error":
        words |= {"subtype": "DISTANCE", "precision": 5}
    return FloatProperty(
        min=row.minimum,
        max=min(row.maximum, 1e30),
        soft_max=SOFT_MAXIMUM.get(row.name, min(row.maximum, 1e30)),
        **words,
    )


def target_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties that say how far to go."""
    items = tuple((row.name.upper(), label(row), sentence(row).rstrip(".")) for row in TARGETS)
    return {
        "target": EnumProperty(
            items=items,
            name="Target",
            description="What says how many points stay",
            options=options,
        ),
        **{row.name: _property(row, options) for row in TARGETS},
    }


def show_annotations(options: set[str]) -> dict[str, Any]:
    """Return what else attributes that are shown depend on."""
    return {
        "alpha": _property(next(row for row in TARGETS if row.name == "alpha"), options),
        "by_saliency": BoolProperty(
            name="Color by Saliency",
            description="Show regions in the colour of their mean saliency, from blue to red; "
            "without, each has a colour of its own",
            options=options,
        ),
    }


def region_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties that say which regions are picked, and what becomes of them."""
    return {
        "regions": StringProperty(
            name="Regions",
            description="Numbers of regions, such as 0-4 or 0 2 7: number 0 is the most salient",
            default="0-4",
            options=options,
        ),
        "into": EnumProperty(
            items=(
                ("GROUP", "Vertex Group", "A vertex group; an attribute of points for a cloud"),
                ("SELECTION", "Selection", "Selected vertices, as seen in Edit Mode"),
            ),
            name="Into",
            description="What becomes of the regions",
            options=options,
        ),
    }


def parameter_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties of an analysis."""
    return {row.name: _property(row, options) for row in ROWS}


def input_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties that say what of an object is taken."""
    return {
        "source": EnumProperty(
            items=SOURCES,
            name="Geometry",
            description="Which geometry of the object to take",
            options=options,
        ),
        "symmetry": EnumProperty(
            items=(
                ("NONE", "Off", "Both sides go their own ways"),
                *((axis, axis, f"Left and right along the object's {axis}") for axis in "XYZ"),
            ),
            name="Symmetry",
            description="A mesh that is the same on both sides of its origin, along this axis, "
            "stays so exactly: one half is simplified and mirrored. One that is not is left as it "
            "is, and the points that differ are counted",
            options=options,
        ),
        "weld": BoolProperty(
            name="Join Doubles",
            description="Points that lie exactly on another are joined to it first: a surface "
            "whose polygons do not hold together becomes one",
            options=options,
        ),
        "remove_loose": BoolProperty(
            name="Remove Loose",
            description="Points of a mesh that no polygon and no edge uses are removed first",
            options=options,
        ),
        **keep_annotations(options),
    }


def _weights(settings: Any, context: Any, text: str) -> list[str]:
    """Return what of the active object can protect points, or make them important."""
    return read.weight_names(context.object)


def keep_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties that say what has to stay."""
    return {
        "protect": StringProperty(
            name="Protect",
            description="Vertex group, or attribute of points or faces, whose points are never "
            "removed: those of any weight above zero, however small. The sculpt mask is called "
            ".sculpt_mask, all painted face sets together .sculpt_face_set, one of them Face Set 3",
            search=_weights,
            options=options,
        ),
        "importance": StringProperty(
            name="Importance",
            description="Vertex group, or attribute of points or faces, such as a painted one: the "
            "larger its weight, the more points stay there",
            search=_weights,
            options=options,
        ),
        "importance_factor": FloatProperty(
            name="Factor",
            description="How many times as costly it is to remove a point of weight 1: more keeps "
            "more points there, and fewer elsewhere",
            default=10.0,
            min=0.0,
            soft_max=1000.0,
            options=options,
        ),
        "keep_seams": BoolProperty(
            name="Keep Seams",
            description="Seams of UV maps, corner colors and custom normals, edges marked as "
            "seams and borders of materials stay as lines; without, more of the shape is kept but "
            "faces reach across",
            default=True,
            options=options,
        ),
        "keep_sharp": BoolProperty(
            name="Keep Sharp Edges",
            description="Edges that are sharp, creased, have a bevel weight or are marked for "
            "Freestyle stay as lines; without, more of the shape is kept but such lines break up",
            default=True,
            options=options,
        ),
        **_more_kept(options),
    }


def _more_kept(options: set[str]) -> dict[str, Any]:
    return {
        "keep_border": BoolProperty(
            name="Keep Border",
            description="Vertices on open borders neither move nor go: tiles that meet there "
            "still meet. A target of fewer points stops at these",
            options=options,
        ),
        "keep_topology": BoolProperty(
            name="Keep Topology",
            description="No part of the mesh goes or falls apart, no hole or handle closes. A "
            "target of fewer points stops at the fewest with which that is so",
            options=options,
        ),
    }


def output_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties that say where the result goes."""
    return {
        "output": EnumProperty(
            items=OUTPUTS, name="Result", description="Where the result goes", options=options
        ),
        "hide_source": BoolProperty(
            name="Hide Original",
            description="Hide the original, in the view and when rendered, and select the new "
            "object: they lie in one place and would flicker",
            default=True,
            options=options,
        ),
        "original_normals": BoolProperty(
            name="Original's Normals",
            description="Shade a mesh like its original: corners get the normals of the original "
            "surface, as custom normals",
            options=options,
        ),
        "measure": BoolProperty(
            name="Measure Error",
            description="Measure the exact distances from all original points to the result; on "
            "large meshes this takes a while",
            default=True,
            options=options,
        ),
    }


def level_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties of a chain of levels of detail."""
    rows = [row for row in TARGETS if row.name in LEVEL_TARGETS]
    return {
        "levels_by": EnumProperty(
            items=tuple((row.name.upper(), label(row), sentence(row).rstrip(".")) for row in rows),
            name="Levels by",
            description="What the numbers of the levels mean",
            options=options,
        ),
        "ratios": StringProperty(
            name="Levels",
            description="A number for each level below the original: shares such as 0.5 or 50%, "
            "numbers of triangles, or largest errors in the scene's unit",
            default="50% 25% 10% 2%",
            options=options,
        ),
        "arrange": EnumProperty(
            items=(
                ("STACKED", "One Visible", "All stand where the original is, which alone is shown"),
                ("BESIDE", "Side by Side", "All are shown, one beside the other"),
            ),
            name="Arrange",
            description="Where the levels stand",
            options=options,
        ),
    }


class SalientSettings(bpy.types.PropertyGroup):
    """What the panel shows; kept with the scene."""

    __annotations__ = {
        **target_annotations(set()),
        **input_annotations(set()),
        **output_annotations(set()),
        **parameter_annotations(set()),
        **level_annotations(set()),
        **region_annotations(set()),
        "by_saliency": show_annotations(set())["by_saliency"],
        **baking.bake_annotations(set()),
    }

    def use_preset(self, name: str) -> None:
        """Set all parameters of the analysis to those of a preset."""
        for key, value in preset(name).as_dict().items():
            if key not in HIDDEN:
                setattr(self, key, value)


def preset(name: str) -> Parameters:
    """Return the parameters of a preset: salcore's own, or one of `MORE_PRESETS`."""
    if name in PRESETS:
        return dataclasses.replace(Parameters.preset(name), **_defaults(name))
    return dataclasses.replace(Parameters(), **DEFAULTS, **MORE_PRESETS[name])


def _defaults(name: str) -> dict[str, Any]:
    """Return Blender's defaults, which the paper's preset does not have."""
    return {} if name == "paper" else DEFAULTS


def parameters(settings: Any) -> Parameters:
    """Return salcore's parameters from a settings group or an operator."""
    values = {row.name: getattr(settings, row.name) for row in ROWS}
    return Parameters(**values, error_unit="length")


def target(settings: Any) -> dict[str, float]:
    """Return the one target chosen, as the argument that salcore wants."""
    name = settings.target.lower()
    return {name: getattr(settings, name)}


def fill_unset(own: Any, settings: Any) -> None:
    """Give operator properties that nobody has set the values of the panel's settings."""
    for each in own.bl_rna.properties:
        name = each.identifier
        known = name != "rna_type" and name in settings.bl_rna.properties
        if known and not own.is_property_set(name):
            setattr(own, name, getattr(settings, name))


def _figure(field: Any) -> Any:
    """Return a property that reads a figure, and cannot be set."""
    kinds = {"str": StringProperty, "int": IntProperty, "float": FloatProperty}
    kind = kinds.get(field.type, BoolProperty)
    words: dict[str, Any] = {"get": lambda self: getattr(figures, field.name)}
    if field.name.endswith("_error"):
        words |= {"subtype": "DISTANCE", "precision": 6}
    return kind(**words)


class SalientFigures(bpy.types.PropertyGroup):
    """Figures of the last result, and how far running work has come; to read, not saved."""

    __annotations__ = {field.name: _figure(field) for field in dataclasses.fields(Figures)}


CLASSES: tuple[Any, ...] = (SalientSettings, SalientFigures)


def register() -> None:
    """Attach the settings to scenes and the figures to the window manager."""
    bpy.types.Scene.salient_simplify = bpy.props.PointerProperty(type=SalientSettings)
    bpy.types.WindowManager.salient_simplify = bpy.props.PointerProperty(type=SalientFigures)


def unregister() -> None:
    """Take them off again."""
    del bpy.types.WindowManager.salient_simplify
    del bpy.types.Scene.salient_simplify
