# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender properties of a baked normal map, once for the panel and once for the operator."""

from __future__ import annotations

from typing import Any

from bpy.props import BoolProperty, FloatProperty, IntProperty


def bake_annotations(options: set[str]) -> dict[str, Any]:
    """Return the properties of a bake."""
    return {
        "bake_size": IntProperty(
            name="Size",
            description="Width and height of the image in pixels: more shows finer detail, and "
            "takes longer to bake and more memory",
            default=2048,
            min=16,
            max=16384,
            options=options,
        ),
        "bake_unwrap": BoolProperty(
            name="Unwrap Anew",
            description="Make a new UV map for the image beside those that there are; without, "
            "only a mesh that has none gets one",
            options=options,
        ),
        "bake_cage": FloatProperty(
            name="Cage",
            description="How far outside of the active object rays towards the original begin: "
            "more finds what lies further out, and too much catches parts nearby. 0 measures the "
            "largest error and takes a little more",
            default=0.0,
            min=0.0,
            soft_max=1.0,
            subtype="DISTANCE",
            precision=5,
            options=options,
        ),
    }
