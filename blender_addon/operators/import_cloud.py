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

from ..geometry import attributes, ply, point_nodes, rebuild
from ..geometry.attributes import Layer
from ..geometry.read import HostError
from ..worker import requests
from . import show

OFFSET = "salient_offset"
"""Custom property of an imported object: what to add to its coordinates for those of the file."""
COLOR = "Col"


class IMPORT_OT_salient_cloud(bpy.types.Operator, ImportHelper):
    """Import the points of a PLY file as a point cloud, in double precision with its offset off"""

    bl_idname = "import_scene.salient_cloud"
    bl_label = "Import Cloud"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender reads the class attribute
    filename_ext = ".ply"
    __annotations__ = {
        "filter_glob": StringProperty(default="*.ply", options={"HIDDEN"}),
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
            values = ply.read_points(path)
            obj, offset = add_cloud(context, path.stem, values)
        except (HostError, OSError, MemoryError) as error:
            self.report({"ERROR"}, str(error) or "not enough memory for this file")
            return {"CANCELLED"}
        x, y, z = offset
        text = f"{len(obj.data.points):,} points; their offset {x:g}, {y:g}, {z:g} is in {OFFSET!r}"
        self.report({"INFO"}, f"{obj.name}: {text}")
        return {"FINISHED"}


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
    cloud = rebuild.new_cloud(len(points))
    cloud.name = name
    for layer in [Layer("position", "FLOAT_VECTOR", "POINT", near), *_layers(values, len(points))]:
        attributes.write_layer(cloud, layer)
    obj = bpy.data.objects.new(name, cloud)
    obj[OFFSET] = offset.tolist()
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


def _layers(values: dict[str, NDArray[Any]], count: int) -> list[Layer]:
    """Return colours, normals and all other properties as attributes."""
    found, used = [], {"x", "y", "z"}
    colors = ("red", "green", "blue")
    if used.isdisjoint(colors) and set(colors) <= set(values):
        names = (*colors, "alpha") if "alpha" in values else colors
        rgba = np.ones((count, 4), dtype=np.float32)
        for k, channel in enumerate(names):
            array = values[channel]
            largest = 255.0 if array.dtype.kind in "iu" else 1.0
            rgba[:, k] = array / largest
        found.append(Layer(COLOR, "BYTE_COLOR", "POINT", rgba))
        used |= set(names)
    axes = ("nx", "ny", "nz")
    if set(axes) <= set(values):
        normals = np.column_stack([values[axis] for axis in axes]).astype(np.float32)
        found.append(Layer("normal", "FLOAT_VECTOR", "POINT", normals))
        used |= set(axes)
    for name, array in values.items():
        if name not in used:
            whole = array.dtype.kind in "iu" and array.dtype.itemsize < 4
            kind = "INT" if whole or array.dtype.kind == "i" else "FLOAT"
            found.append(Layer(name, kind, "POINT", array))
    return found


CLASSES: tuple[Any, ...] = (IMPORT_OT_salient_cloud,)


def draw_import(self: Any, context: Any) -> None:
    """Draw the entry of the menu of imports."""
    self.layout.operator(IMPORT_OT_salient_cloud.bl_idname, text="Cloud, precise (.ply)")
