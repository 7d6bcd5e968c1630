# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender extension's own figures: bridge, a second ratio, time slices.

Run ``python benchmarks/blender.py --models FOLDER`` with bpy installed. The folder holds
dragon_vrip.ply and autzen_crop_1M.ply; what is missing is named.
"""

import argparse
import importlib
import importlib.util
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
NAME = "bl_ext.user_default.salient_simplify"


def enable(folder: str) -> Any:
    """Lay the extension into a user folder, enable it, and return a function that finds modules."""
    os.environ["BLENDER_USER_RESOURCES"] = folder  # before bpy is imported
    spec = importlib.util.spec_from_file_location("package", ROOT / "blender_addon" / "package.py")
    assert spec is not None
    assert spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)
    package.stage(Path(folder) / "extensions" / "user_default" / "salient_simplify")
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)
    return lambda name: importlib.import_module(f"{NAME}.{name}")


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


def bridge(module: Any, count: int = 1_000_000) -> None:
    """Time the way from an object to arrays, and from a result to a new object that keeps all."""
    rng = np.random.default_rng(0)
    obj = points_object(rng.random((count, 3)), a=rng.random(count), b=rng.random(count))
    sources, results = module("sources"), module("results")
    source = sources.Source([obj], obj.data)
    salcore = module("salcore")
    few = salcore.simplify(rng.random((100, 3)), ratio=1.0)

    class All:
        """A result that keeps every point: no time of the core's is in it."""

        indices = source_of = np.arange(count)
        source, faces, face_source, positions = source_of, None, None, None
        edge_source = few.edge_source

    for _ in range(3):
        begun = time.perf_counter()
        module("bridge").read(obj.data, obj.matrix_world)
        read = time.perf_counter() - begun
        begun = time.perf_counter()
        made = results.add(source, All(), "_copy")
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


def slices(module: Any, path: Path) -> None:
    """Time every slice of the work that the modal operator does."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)
    bpy.ops.wm.ply_import(filepath=str(path))
    bpy.context.object.select_set(True)
    sources, jobs = module("sources"), module("jobs")
    parameters = module("salcore").Parameters(error_unit="length")

    def steps_of(source: Any) -> Any:
        return sources.simplification_steps(source, parameters, {"ratio": 0.1}, "")

    job = jobs.Job(sources.each(sources.originals(bpy.context), steps_of))
    spent = []
    done = False
    while not done:
        begun = time.perf_counter()
        done = job.advance(jobs.SLICE)
        spent.append(time.perf_counter() - begun)
    begun = time.perf_counter()
    for source, result in job.result:
        module("results").add(source, result, "_new")
    spent.append(time.perf_counter() - begun)
    half, most = np.percentile(spent, [50, 99])
    print(
        f"{path.name}: {len(spent)} slices, median {half:.3f} s, 99th percentile {most:.3f} s, "
        f"longest {max(spent):.3f} s, {np.sum(np.array(spent) > 0.2)} over 0.2 s"
    )


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--models", type=Path, default=Path(os.environ.get("SALIENT_MODELS", ".")))
    folder = parser.parse_args().models
    with tempfile.TemporaryDirectory() as user:
        module = enable(user)
        bridge(module)
        for name, run in (
            ("dragon_vrip.ply", second_ratio),
            ("autzen_crop_1M.ply", lambda path: slices(module, path)),
            ("dragon_vrip.ply", lambda path: slices(module, path)),
        ):
            if (folder / name).exists():
                run(folder / name)
            else:
                print(f"{folder / name}: not there", file=sys.stderr)


if __name__ == "__main__":
    main()
