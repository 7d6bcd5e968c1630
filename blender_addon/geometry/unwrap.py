# SPDX-License-Identifier: GPL-3.0-or-later
"""UV maps that an image can be baked to."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import attributes, read
from .read import HostError

NAME = "Bake"
ANGLE = np.radians(66.0)
"""Blender's own limit between the normals of an island."""
GAP = 4.0
"""Pixels between two islands."""
GRID = 512
"""Places along each side of the image at which overlaps are looked for."""
SHIFT = 0.4142
"""Of these places, lest edges along a grid meet them."""
MOST_MAPS = 8
SLACK = 0.01
"""Share of a map that may lie outside of the image, or be covered twice."""


def unwrap(scene: Any, obj: Any, pixels: int) -> str:
    """Give an object's mesh a new UV map without overlaps, and return its name.

    Parameters
    ----------
    scene : bpy.types.Scene
        One that nobody sees: the mesh goes through Edit Mode, and its selection is lost.
    obj : bpy.types.Object
        In this scene.
    pixels : int
        Along each side of the image.
    """
    mesh = obj.data
    if len(mesh.uv_layers) >= MOST_MAPS:
        raise HostError(f"{obj.data.name}: has {MOST_MAPS} UV maps, and no more fit; remove one")
    layer = mesh.uv_layers.new(name=NAME, do_init=False)
    mesh.uv_layers.active = layer
    name: str = layer.name
    chosen = {"active_object": obj, "object": obj, "selected_objects": [obj]}
    view = {"scene": scene, "view_layer": scene.view_layers[0]}
    edited = {"edit_object": obj, "objects_in_mode_unique_data": [obj]}
    with bpy.context.temp_override(**view, **chosen, selected_editable_objects=[obj]):
        bpy.ops.object.mode_set(mode="EDIT")
    with bpy.context.temp_override(**view, **chosen, **edited):
        bpy.ops.mesh.reveal()
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(angle_limit=ANGLE, island_margin=GAP / pixels, margin_method="ADD")
        bpy.ops.object.mode_set(mode="OBJECT")
    return name


def coordinates(mesh: Any, name: str) -> NDArray[np.float32]:
    """Return the coordinates (c, 2) of a UV map, one for each corner."""
    return np.asarray(attributes.read(mesh.attributes[name]))


def add(mesh: Any, name: str, corners: NDArray[np.float32]) -> None:
    """Give a mesh one more UV map; those that were active stay so."""
    active = [layer.name for layer in mesh.uv_layers if layer.active]
    rendered = [layer.name for layer in mesh.uv_layers if layer.active_render]
    mesh.uv_layers.new(name=name, do_init=False)
    attributes.write(mesh.attributes[name], corners)
    for layer in mesh.uv_layers:
        layer.active |= layer.name in active
        layer.active_render |= layer.name in rendered


def problem(mesh: Any, name: str) -> str:
    """Return a sentence if a UV map does not fit an image of its own; empty if it does."""
    corners = coordinates(mesh, name)[read.triangles(mesh)[1]].astype(np.float64)
    side, other = (corners[:, k] - corners[:, 0] for k in (1, 2))
    area = 0.5 * np.abs(side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0])
    total = float(area.sum())
    beyond = ((corners < -SLACK) | (corners > 1.0 + SLACK)).any(axis=(1, 2))
    if not total > 0.0:
        return f"its UV map {name!r} has no area; bake again with Unwrap Anew"
    if area[beyond].sum() > SLACK * total:
        return f"its UV map {name!r} leaves the image; bake again with Unwrap Anew"
    # More area than the image has is covered twice for sure, and might take long to look at.
    twice = 1.0 - 1.0 / total if total > 1.0 + SLACK else _covered_twice(corners)
    if twice > SLACK:
        return (
            f"its UV map {name!r} overlaps itself on {twice:.0%} of its area, where one place of "
            "the image stands for several of the mesh; bake again with Unwrap Anew"
        )
    return ""


def _covered_twice(corners: NDArray[np.float64]) -> float:
    """Return the share of the covered places of a grid that lie in several triangles (t, 3, 2)."""
    corners = GRID * corners - SHIFT
    low = np.clip(np.ceil(corners.min(axis=1)), 0, GRID - 1).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1)), -1, GRID - 1).astype(np.int64)
    wide, tall = np.maximum(high - low + 1, 0).T
    which = np.repeat(np.arange(len(corners)), wide * tall)
    number = np.arange(len(which)) - np.repeat(np.cumsum(wide * tall) - wide * tall, wide * tall)
    place = low[which] + np.column_stack([number % wide[which], number // wide[which]])
    to_corner = corners[which] - place[:, None]
    after = np.roll(to_corner, -1, axis=1)
    sides = to_corner[..., 0] * after[..., 1] - to_corner[..., 1] * after[..., 0]
    inside = place[(sides > 0.0).all(axis=1) | (sides < 0.0).all(axis=1)]
    covers = np.bincount(inside[:, 1] * GRID + inside[:, 0], minlength=GRID * GRID)
    covered = int(np.count_nonzero(covers))
    return int(np.count_nonzero(covers > 1)) / max(covered, 1)
