# SPDX-License-Identifier: GPL-3.0-or-later
"""How long Blender's window waits while the worker simplifies, and how soon it can be cancelled.

    python -m benchmarks.speed.worker [--models FOLDER] [--ratio 0.1] [--textured]

Needs bpy. Drives the add-on as its modal operator does, by a tick every 0.1 s, on the Dragon as a
mesh and as loose points and on a LiDAR scan of a million points; what is missing is named. Prints
JSON: for each of them wall-clock seconds of Blender's own thread, CPU seconds in brackets.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
NAME = "bl_ext.user_default.salient_simplify"
TICK = 0.1
ROWS = [("dragon_vrip.ply", True), ("dragon_vrip.ply", False), ("autzen_crop_1M.ply", False)]


def enable(folder: str) -> Callable[[str], Any]:
    """Lay the extension into a user folder, enable it, and return a function that finds modules."""
    os.environ["BLENDER_USER_RESOURCES"] = folder  # before bpy is imported
    script = ROOT / "blender_addon" / "packaging" / "package.py"
    spec = importlib.util.spec_from_file_location("package", script)
    assert spec is not None
    assert spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)
    package.stage(Path(folder) / "extensions" / "user_default" / "salient_simplify")
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)
    return lambda name: importlib.import_module(f"{NAME}.{name}")


def load(path: Path, faces: bool, textured: bool) -> Any:
    """Import a file into an empty scene; without faces, as loose points."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)
    bpy.ops.wm.ply_import(filepath=str(path))
    obj = bpy.context.active_object
    if not faces and len(obj.data.polygons):
        points = np.empty(3 * len(obj.data.vertices), dtype=np.float32)
        obj.data.attributes["position"].data.foreach_get("vector", points)
        obj.data.clear_geometry()
        obj.data.vertices.add(len(points) // 3)
        obj.data.attributes["position"].data.foreach_set("vector", points)
    if faces and textured:
        # Charts of a grid of boxes over x and y: about as many seams as a scan's texture has.
        position = np.empty(3 * len(obj.data.vertices), dtype=np.float32)
        obj.data.attributes["position"].data.foreach_get("vector", position)
        vertex = np.empty(len(obj.data.loops), dtype=np.int32)
        obj.data.attributes[".corner_vert"].data.foreach_get("value", vertex)
        uv = position.reshape(-1, 3)[vertex][:, :2].copy()
        box = np.floor(uv.reshape(-1, 3, 2).mean(axis=1) / np.ptp(uv, axis=0) * 8)
        uv += np.repeat(box, 3, axis=0)
        obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.ravel())
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


class Clock:
    """Wall-clock and CPU seconds of this thread."""

    def __init__(self) -> None:
        self.begun = time.perf_counter(), time.thread_time()

    def __str__(self) -> str:
        wall, cpu = self.begun
        return f"{time.perf_counter() - wall:.3f} s ({time.thread_time() - cpu:.3f})"


def run(work: Any, request: dict[str, Any], until: str | None = None) -> tuple[Any, list[Any]]:
    """Run a request by ticks, to its end or to a stage; return the task and the ticks' times.

    The times are tuples: wall-clock and CPU seconds, stage, and whether the answer came. The first
    tick sends the request.
    """
    task = work.Task([lambda: request], work.host)
    ticks: list[Any] = []
    while not task.done and (until is None or task.stage != until):
        wall, cpu = time.perf_counter(), time.thread_time()
        done = task.advance()
        spent = time.perf_counter() - wall, time.thread_time() - cpu
        ticks.append((*spent, task.stage, done))
        time.sleep(0.0 if done else TICK if until is None else 0.005)
    return task, ticks


def ready(work: Any) -> None:
    """Start the child, and wait until it is connected."""
    work.host.start()
    while work.host.state != "idle":
        work.host.poll()
        time.sleep(0.01)


def longest(ticks: list[Any]) -> str:
    """Return the longest of the ticks that brought no answer."""
    wall, cpu, *_ = max(tick for tick in ticks if not tick[3])
    return f"{wall:.4f} s ({cpu:.4f})"


def measure(module: Callable[[str], Any], obj: Any, ratio: float) -> dict[str, str]:
    """Return the figures of one object."""
    import bpy

    work, sources = module("operators.work"), module("geometry.sources")
    results, topology = module("geometry.results"), module("geometry.topology")
    parameters = module("salcore").Parameters(error_unit="length").as_dict()
    kept = SimpleNamespace(**module("command").NO_WEIGHTS, **module("command").KEEP)
    source = sources.originals(bpy.context)[0]

    def request_of(ratio: float) -> dict[str, Any]:
        words = {"task": "simplify", "parameters": parameters, "targets": [{"ratio": ratio}]}
        return words | {"number": 0, **sources.geometry_with_mesh(source, kept)}

    def build(task: Any, name: str) -> None:
        answer = topology.Reduced.from_dict(task.results[0]["levels"][0])
        made = results.add(source, answer, name)
        assert len(made[0].data.vertices) == len(answer.indices)

    figures = {}
    clock = Clock()
    ready(work)
    figures["child started and connected"] = str(clock)
    clock = Clock()
    request = request_of(ratio)
    figures["reading the object"] = str(clock)
    task, ticks = run(work, request)
    figures["sending"] = f"{ticks[0][0]:.3f} s ({ticks[0][1]:.3f})"
    figures["longest look while the child works"] = longest(ticks[1:])
    figures["receiving"] = f"{ticks[-1][0]:.3f} s ({ticks[-1][1]:.3f})"
    clock = Clock()
    build(task, "_new")
    figures["building the new object"] = str(clock)
    figures["longest look while it measures"] = longest(
        run(work, {"task": "measure", "numbers": [0]})[1][1:]
    )
    for other in (2.0 * ratio, 0.5 * ratio):
        clock = Clock()
        build(run(work, request_of(other))[0], "_second")
        figures[f"another ratio, {other:g}, from press to object"] = str(clock)
    figures |= cancelled(work, request, list(dict.fromkeys(tick[2] for tick in ticks[:-1])))
    work.stop()
    return figures


def cancelled(work: Any, request: dict[str, Any], stages: list[str]) -> dict[str, str]:
    """Return how soon Esc is answered, and the child is ready again, at worst over the stages."""
    answered, waits, killed = [], [], 0
    for number, stage in enumerate(stages):
        changed = request | {"points": request["points"] * (1.5 + number)}
        task, _ = run(work, changed, until=stage)
        if task.done:
            continue
        pid, begun = work.host.pid, time.perf_counter()
        task.cancel()
        answered.append(time.perf_counter() - begun)
        while work.host.state == "stopping":
            work.host.poll()
            time.sleep(0.002)
        waits.append(time.perf_counter() - begun)
        killed += work.host.pid != pid
        ready(work)
    return {
        "Esc is answered, at worst": f"{max(answered):.3f} s",
        "the child is ready again, at worst": f"{max(waits):.2f} s",
        "stages tried, child ended in": f"{len(waits)}, {killed}",
    }


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=Path, default=Path(os.environ.get("SALIENT_MODELS", ".")))
    parser.add_argument("--ratio", type=float, default=0.1)
    parser.add_argument("--textured", action="store_true", help="give meshes a UV map")
    options = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory() as folder:
        module = enable(folder)
        for name, faces in ROWS:
            path = options.models / name
            if not path.is_file():
                print(f"missing: {path}", file=sys.stderr)
                continue
            obj = load(path, faces, options.textured)
            kind = "mesh" if faces else "points"
            count = len(obj.data.vertices)
            figures = measure(module, obj, options.ratio)
            found.append({"model": f"{path.stem}, {kind}", "points": count, "figures": figures})
        print(json.dumps(found), flush=True)
    os._exit(0)  # bpy's own end now and then waits for ever for one of its threads


if __name__ == "__main__":
    main()
