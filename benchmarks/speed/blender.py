# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender extension's own figures: to arrays and back, and a second ratio.

    python -m benchmarks.speed.blender [--models FOLDER]

Needs bpy, and dragon_vrip.ply in the folder of models. What the window waits for while the worker
process works is measured by `benchmarks.speed.worker`.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.models import add_models_option, present
from benchmarks.speed.worker import NAME, enable


def link(data: Any) -> Any:
    """Make an object of data, selected alone."""
    import bpy

    obj = bpy.data.objects.new("object", data)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other is obj)
    bpy.context.view_layer.objects.active = obj
    return obj


def points_object(points: Any, **floats: Any) -> Any:
    """Return an object of loose points with a colour and float attributes."""
    import bpy

    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(points))
    values = np.ascontiguousarray(points, dtype=np.float32)
    mesh.attributes["position"].data.foreach_set("vector", values.ravel())
    color = mesh.attributes.new("Col", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", np.ones(4 * len(points), dtype=np.float32))
    for name in floats:
        attribute = mesh.attributes.new(name, "FLOAT", "POINT")
        attribute.data.foreach_set("value", np.ascontiguousarray(floats[name], dtype=np.float32))
    return link(mesh)


def bridge(module: Any, count: int) -> None:
    """Time the way from an object to arrays, and from a result to a new object that keeps all."""
    rng = np.random.default_rng(0)
    obj = points_object(rng.random((count, 3)), a=rng.random(count), b=rng.random(count))
    sources, results = module("geometry.sources"), module("geometry.results")
    topology = module("geometry.topology")
    source = sources.Source([obj], obj.data)
    none, no_edges = np.empty(0, dtype=np.int32), np.empty((0, 2), dtype=np.int32)
    points_only = topology.Topology(none, none, none, none, none, no_edges, none)
    everything = topology.Reduced(np.arange(count), None, points_only)
    for _ in range(3):
        begun = time.perf_counter()
        module("geometry.read").arrays(obj.data, obj.matrix_world)
        read = time.perf_counter() - begun
        begun = time.perf_counter()
        made = results.add(source, everything, "_copy")
        write = time.perf_counter() - begun
        assert len(made[0].data.vertices) == count
        print(f"bridge, {count:,} points: {read:.3f} s to arrays, {write:.3f} s to a new object")


def second_ratio(path: Path) -> None:
    """Time a second Simplify with another ratio."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)
    bpy.ops.wm.ply_import(filepath=str(path))
    obj = bpy.context.object
    for measure in (False, True):
        for ratio in (0.1, 0.2, 0.05):
            begun = time.perf_counter()
            bpy.ops.object.salient_simplify(ratio=ratio, measure=measure)
            spent = time.perf_counter() - begun
            points = len(obj.data.attributes["position"].data)
            print(f"Simplify to {ratio}, {points:,} points, measure={measure}: {spent:.2f} s")


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=1_000_000, help="of the object that is read")
    add_models_option(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as user:
        bridge(enable(user), options.points)
        for path in present([options.models / "dragon_vrip.ply"]):
            second_ratio(path)


if __name__ == "__main__":
    main()
