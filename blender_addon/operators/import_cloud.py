# SPDX-License-Identifier: GPL-3.0-or-later
"""Import a point cloud without rounding it: far from the origin single precision is too coarse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper
from numpy.typing import NDArray

from ..geometry import attributes, las, ply, point_nodes, rebuild
from ..geometry.attributes import Layer
from ..geometry.read import HostError
from ..worker import requests
from . import show

OFFSET = "salient_offset"
"""Custom property of an imported object: what to add to its coordinates for those of the file."""
COLOR = "Col"
READERS = {".ply": ply.read_points, ".las": las.read_points, ".laz": las.read_points}
"""What reads the points of a file of this ending."""
RGB = ("red", "green", "blue")
ROUNDING = 1e-6
"""Share of their range by which values may be rounded with nothing taken off."""


class IMPORT_OT_salient_cloud(bpy.types.Operator, ImportHelper):
    """Import the points of a PLY, LAS or LAZ file as a cloud, exactly, with an offset taken off"""

    bl_idname = "import_scene.salient_cloud"
    bl_label = "Import Cloud"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender reads the class attribute
    filename_ext = ".ply"
    __annotations__ = {
        "filter_glob": StringProperty(
            default=";".join(f"*{e}" for e in READERS), options={"HIDDEN"}
        ),
        "filepath": StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"}),
    }

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Work in Object Mode."""
        return bool(context.mode == "OBJECT")

    def execute(self, context: Any) -> set[str]:
        """Read the file and make the object."""
        path = Path(bpy.path.abspath(self.filepath))
        try:
            obj, offset = add_cloud(context, path.stem, read_points(path))
        except (HostError, OSError, MemoryError) as error:
            self.report({"ERROR"}, str(error) or "not enough memory for this file")
            return {"CANCELLED"}
        x, y, z = offset
        text = f"{len(obj.data.points):,} points; their offset {x:g}, {y:g}, {z:g} is in {OFFSET!r}"
        self.report({"INFO"}, f"{obj.name}: {text}")
        return {"FINISHED"}


def read_points(path: Path) -> dict[str, NDArray[Any]]:
    """Return the values of a file's points by name, in the file's precision."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise HostError(f"{path.name}: is none of {', '.join(READERS)}; convert it to one of them")
    return reader(path)


def add_cloud(
    context: Any, name: str, values: dict[str, NDArray[Any]]
) -> tuple[Any, NDArray[np.float64]]:
    """Make a point cloud object of the properties of points; return it and its offset.

    Parameters
    ----------
    context : bpy.types.Context
    name : str
    values : dict of str to (n,) array
        "x", "y" and "z", and whatever else; colours, normals and others become attributes.
    """
    points = np.column_stack([np.asarray(values[axis], dtype=np.float64) for axis in "xyz"])
    finite = points[np.isfinite(points).all(axis=1)]
    if not len(finite):
        raise HostError(f"{name}: has no points")
    offset = np.rint(0.5 * (finite.min(axis=0) + finite.max(axis=0)))
    near = (points - offset).astype(np.float32)
    layers, offsets = _layers(values, len(points))
    cloud = rebuild.new_cloud(len(points))
    cloud.name = name
    for layer in [Layer("position", "FLOAT_VECTOR", "POINT", near), *layers]:
        attributes.write_layer(cloud, layer)
    obj = bpy.data.objects.new(name, cloud)
    obj[OFFSET] = offset.tolist()
    for key, value in offsets.items():
        obj[f"{OFFSET}_{key}"] = value
    context.collection.objects.link(obj)
    for other in context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj
    if COLOR in cloud.attributes:
        show.show_points(obj, COLOR, requests.point_radius(finite))
        show.show_colors(context, solid=False)
    else:
        point_nodes.show(obj, None, requests.point_radius(finite))
    return obj, offset


def _layers(values: dict[str, NDArray[Any]], count: int) -> tuple[list[Layer], dict[str, float]]:
    """Return colours, normals and all other properties as attributes, and what was taken off."""
    found: list[Layer] = []
    offsets: dict[str, float] = {}
    used = {"x", "y", "z"}
    if set(RGB) <= values.keys():
        found.append(Layer(COLOR, "BYTE_COLOR", "POINT", _colors(values, count)))
        used |= {*RGB, "alpha"}
    axes = ("nx", "ny", "nz")
    if set(axes) <= set(values):
        normals = np.column_stack([values[axis] for axis in axes]).astype(np.float32)
        found.append(Layer("normal", "FLOAT_VECTOR", "POINT", normals))
        used |= set(axes)
    for name, array in values.items():
        if name not in used:
            layer, offset = _number(name, array)
            found.append(layer)
            offsets |= {name: offset} if offset else {}
    return found, offsets


def _colors(values: dict[str, NDArray[Any]], count: int) -> NDArray[np.float32]:
    """Return colours (count, 4) from 0 to 1; whole ones reach to 255 or, where any does, 65535."""
    rgba = np.ones((count, 4), dtype=np.float32)
    names = [name for name in (*RGB, "alpha") if name in values]
    largest = max(float(np.nan_to_num(values[name]).max(initial=0)) for name in RGB)
    whole = values["red"].dtype.kind in "iu" or largest > 1.0
    top = (65535.0 if largest > 255.0 else 255.0) if whole else 1.0
    for k, name in enumerate(names):
        rgba[:, k] = values[name] / top
    return rgba


def _number(name: str, array: NDArray[Any]) -> tuple[Layer, float]:
    """Return an attribute, and what was taken off, lest single precision should round it."""
    if array.dtype.kind in "iub":
        low, high = (int(array.min(initial=0)), int(array.max(initial=0)))
        if low >= -(2**31) and high < 2**31:
            return Layer(name, "INT", "POINT", array), 0.0
    wide = array.astype(np.float64)
    finite = wide[np.isfinite(wide)]
    near = float(np.abs(finite.astype(np.float32) - finite).max(initial=0.0))
    offset = float(np.rint(0.5 * (finite.min() + finite.max()))) if len(finite) else 0.0
    # Only where the values lie far from 0, for how far they lie apart.
    if near > ROUNDING * (float(np.ptp(finite)) if len(finite) else 0.0):
        return Layer(name, "FLOAT", "POINT", (wide - offset).astype(np.float32)), offset
    return Layer(name, "FLOAT", "POINT", wide.astype(np.float32)), 0.0


CLASSES: tuple[Any, ...] = (IMPORT_OT_salient_cloud,)


def draw_import(self: Any, context: Any) -> None:
    """Draw the entry of the menu of imports."""
    self.layout.operator(
        IMPORT_OT_salient_cloud.bl_idname, text="Cloud, precise (.ply, .las, .laz)"
    )
