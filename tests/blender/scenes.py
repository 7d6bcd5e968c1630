# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects to test with, and a hash of everything that a user could lose."""

import hashlib

import bpy
import numpy as np
from models import load_crop

RNG_SEED = 7


def select(*objects):
    """Select exactly these objects; the first becomes active."""
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other in objects)
    bpy.context.view_layer.objects.active = objects[0]


def link(data, name="object"):
    """Make an object of data, selected alone."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    select(obj)
    return obj


def torus(major=40, minor=20):
    """Return a torus of quads with a UV map, 800 points."""
    bpy.ops.mesh.primitive_torus_add(
        major_segments=major, minor_segments=minor, generate_uvs=True, minor_radius=0.4
    )
    obj = bpy.context.active_object
    select(obj)
    return obj


def points_mesh(coordinates):
    """Return a mesh of loose points."""
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(coordinates))
    values = np.ascontiguousarray(coordinates, dtype=np.float32)
    mesh.attributes["position"].data.foreach_set("vector", values.ravel())
    return link(mesh, "points")


def cloud(coordinates):
    """Return a point cloud."""
    obj = points_mesh(coordinates)
    bpy.ops.object.convert(target="POINTCLOUD")
    select(obj)
    return obj


def scan(most):
    """Return a part of a scan, of so many points, as a mesh."""
    points, faces = load_crop("bun_zipper.ply", most)
    mesh = bpy.data.meshes.new("scan")
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    return link(mesh, "scan")


def relief(count=600):
    """Return points (count, 3) on a wavy sheet."""
    xy = np.random.default_rng(RNG_SEED).random((count, 2)) * 4
    return np.column_stack([xy, 0.3 * np.sin(3 * xy[:, 0]) * np.cos(2 * xy[:, 1])])


def positions(obj):
    """Return the coordinates of an object's own data."""
    attribute = obj.data.attributes["position"]
    values = np.empty(3 * len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("vector", values)
    return values.reshape(-1, 3)


def fingerprint(extension):
    """Return a digest of all data, selection, active object and mode."""
    from importlib import import_module

    attributes = import_module(extension.__name__ + ".geometry.attributes")
    digest = hashlib.sha256()

    def say(*words):
        digest.update(repr(words).encode())

    for kind in ("objects", "meshes", "pointclouds", "materials", "collections", "node_groups"):
        say(kind, [item.name for item in getattr(bpy.data, kind)])
    for data in (*bpy.data.meshes, *bpy.data.pointclouds):
        for attribute in sorted(data.attributes, key=lambda item: item.name):
            if attribute.name.startswith("."):  # what the last selection left
                continue
            values = attributes.read(attribute)
            say(attribute.name, attribute.data_type, attribute.domain)
            digest.update(repr(values).encode() if isinstance(values, list) else values.tobytes())
    for obj in bpy.data.objects:
        say(obj.name, obj.data and obj.data.name, obj.select_get(), obj.hide_get())
        say([tuple(row) for row in obj.matrix_world], [item.type for item in obj.modifiers])
        if obj.type == "MESH":
            say([[(g.group, g.weight) for g in vertex.groups] for vertex in obj.data.vertices])
    active = bpy.context.view_layer.objects.active
    say(active and active.name, bpy.context.mode)
    return digest.hexdigest()
