# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh or point cloud is cut down to what a simplification keeps; all that it carries goes along.

Everything that is not geometry (materials, custom properties, animation, names) stays as it is,
because the data-block itself stays: callers who want the original, too, hand over a copy.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import attributes, read, vertices
from .attributes import Layer
from .topology import Reduced, Topology


def shrink(data: Any, result: Reduced, matrix: Any, *, weighted: bool = False) -> Any:
    """Cut a mesh or point cloud down to what a simplification keeps, and return it.

    Parameters
    ----------
    data : bpy.types.Mesh or bpy.types.PointCloud
    result : Reduced
        What is left of its points and triangles, as `read.arrays` gives them.
    matrix : (4, 4) matrix
        From its space to the one that `result` speaks of.
    weighted : bool
        Whether the mesh has vertex groups.

    Returns
    -------
    bpy.types.Mesh or bpy.types.PointCloud
        The same data-block; but before Blender 5.1, which cannot resize a point cloud, a new one
        that has taken the old one's name, materials, properties and users.
    """
    if read.is_mesh(data):
        _shrink_mesh(data, result, matrix, weighted)
        return data
    return _shrink_cloud(data, result)


def _shrink_mesh(mesh: Any, result: Reduced, matrix: Any, weighted: bool) -> None:
    shape = result.topology
    assert shape is not None
    actives = _Actives(mesh)
    normals = None
    skip = set()
    if mesh.has_custom_normals and _encoded(mesh):
        # Stored relative to the faces round a corner, so they have to be worked out anew.
        normals = np.empty((len(mesh.loops), 3), dtype=np.float32)
        mesh.corner_normals.foreach_get("vector", normals.ravel())
        normals = normals[shape.corners]
        skip = {"custom_normal"}
    if result.normals is not None:
        # Normals go back with the transposed matrix, as they came with its inverse.
        normals = (result.normals @ np.array(matrix)[:3, :3]).astype(np.float32)
        skip = {"custom_normal"}
    sources: dict[str, NDArray[Any]] = {
        "POINT": result.indices,
        "EDGE": np.empty(0, dtype=np.int32) if shape.edge_source is None else shape.edge_source,
        "FACE": shape.polygons,
        "CORNER": shape.corners,
    }
    layers = [
        layer.blend(*result.blends[layer.domain])
        if layer.domain in result.blends and layer.type in attributes.MEASURES
        else layer.take(sources[layer.domain])
        for layer in attributes.read_layers(mesh, skip=skip)
    ]
    old = read.positions(mesh)[result.indices]
    new = _moved(result, matrix, old)
    if weighted or mesh.shape_keys:
        vertices.keep(mesh, result.indices)
        _move_shape_keys(mesh, new - old)
    else:
        mesh.clear_geometry()
        mesh.vertices.add(len(old))
    _build(mesh, shape, new)
    for layer in layers:
        attributes.write_layer(mesh, layer)
    if normals is not None and len(normals):
        mesh.normals_split_custom_set(normals)
    actives.restore(mesh)
    mesh.update()


def _encoded(mesh: Any) -> bool:
    attribute = mesh.attributes.get("custom_normal")
    return attribute is not None and attribute.data_type == "INT16_2D"


def _moved(result: Reduced, matrix: Any, old: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the kept points' coordinates in their own space: the old ones unless they moved."""
    if result.positions is None:
        return old
    back = np.linalg.inv(np.array(matrix))
    return (result.positions @ back[:3, :3].T + back[:3, 3]).astype(np.float32)


def _build(mesh: Any, shape: Topology, points: NDArray[np.float32]) -> None:
    """Give a mesh that has only vertices their coordinates, edges and polygons."""
    mesh.edges.add(0 if shape.edges is None else len(shape.edges))
    mesh.loops.add(len(shape.corners))
    mesh.polygons.add(len(shape.starts))
    mesh.polygons.foreach_set("loop_start", shape.starts)
    for name, values in (
        ("position", points),
        (".edge_verts", shape.edges),
        (".corner_vert", shape.vertices),
        (".corner_edge", shape.edge_of),
    ):
        if values is not None and len(values):
            attributes.write(mesh.attributes[name], values)
    if shape.edges is None:
        mesh.update(calc_edges=True)


def _move_shape_keys(mesh: Any, offsets: NDArray[np.float32]) -> None:
    """Let all shape keys follow points that move."""
    if mesh.shape_keys is None or not offsets.any():
        return
    for key in mesh.shape_keys.key_blocks:
        places = np.empty(offsets.size, dtype=np.float32)
        key.data.foreach_get("co", places)
        key.data.foreach_set("co", places + offsets.ravel())


class _Actives:
    """Which colour and which UV map are active and rendered: geometry made anew forgets them."""

    def __init__(self, mesh: Any) -> None:
        self.color = mesh.attributes.active_color_name
        self.default_color = mesh.attributes.default_color_name
        layers = list(mesh.uv_layers)
        self.uv = next((layer.name for layer in layers if layer.active), None)
        self.rendered = next((layer.name for layer in layers if layer.active_render), None)
        self.clone = next((layer.name for layer in layers if layer.active_clone), None)

    def restore(self, mesh: Any) -> None:
        """Make the same ones active again."""
        mesh.attributes.active_color_name = self.color
        mesh.attributes.default_color_name = self.default_color
        for layer in mesh.uv_layers:
            layer.active |= layer.name == self.uv
            layer.active_render |= layer.name == self.rendered
            layer.active_clone |= layer.name == self.clone


def _shrink_cloud(cloud: Any, result: Reduced) -> Any:
    layers = [layer.take(result.indices) for layer in attributes.read_layers(cloud)]
    points = read.positions(cloud)[result.indices]
    layers.append(Layer("position", "FLOAT_VECTOR", "POINT", points))
    if hasattr(cloud, "resize"):
        cloud.resize(len(points))
        small = cloud
    else:
        small = new_cloud(len(points))
    for layer in layers:
        attributes.write_layer(small, layer)
    if small is not cloud:
        _take_over(cloud, small)
    small.update_tag()
    return small


def new_cloud(count: int) -> Any:
    """Return a point cloud of a size; before Blender 5.1 only a conversion can make one."""
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(count)
    obj = bpy.data.objects.new("points", mesh)
    bpy.context.scene.collection.objects.link(obj)
    try:
        chosen = {"selected_objects": [obj], "selected_editable_objects": [obj]}
        with bpy.context.temp_override(active_object=obj, object=obj, **chosen):
            bpy.ops.object.convert(target="POINTCLOUD")
        return obj.data
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)


def _take_over(old: Any, new: Any) -> None:
    """Let a new point cloud stand for an old one: materials, properties, animation, users, name."""
    for material in old.materials:
        new.materials.append(material)
    for key in list(old.keys()):
        new[key] = old[key]
    if old.animation_data is not None and old.animation_data.action is not None:
        new.animation_data_create().action = old.animation_data.action
    name = old.name
    old.user_remap(new)
    bpy.data.pointclouds.remove(old)
    new.name = name
