# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in a scene of its own: the user's scene, selection, visibility and engine stay untouched.

Blender bakes selected, visible objects of a scene with its engine. Here copies of two objects are
all that such a scene has, which spares it the rest of the user's scene, too.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np

from . import bake_child, unwrap
from .bake_child import Task
from .read import HostError

ENGINE = "CYCLES"
REACH = 1.25
"""Cage over the largest error: rays meet the original at a slant, hence later."""
LEAST = 1e-4
"""Cage over the size of the object, where there is no error."""
MAX_STRETCH = 1.5
"""Scale along one axis over that along another: Blender moves the cage in the result's own space,
and casts rays in the scene's."""


class Stage:
    """A scene with copies of an original and of what is to look like it.

    Attributes
    ----------
    original, result : bpy.types.Object
        The copies; the result's mesh is a copy, too.
    uv_map : str
        Of the result's mesh.
    """

    def __init__(self, context: Any, original: Any, result: Any) -> None:
        scene = bpy.data.scenes.new("Bake")
        try:
            scene.render.engine = ENGINE
        except TypeError:
            bpy.data.scenes.remove(scene)
            raise HostError(
                "Cycles is not there, which bakes; enable it in Preferences, Add-ons"
            ) from None
        self._scene, self.uv_map = scene, ""
        scene.cycles.device = context.scene.cycles.device
        scene.frame_set(context.scene.frame_current, subframe=context.scene.frame_subframe)
        self.original, self.result = original.copy(), result.copy()
        self.result.data = result.data.copy()
        scene[bake_child.ORIGINAL], scene[bake_child.RESULT] = self.original, self.result
        for obj in (self.original, self.result):
            scene.collection.objects.link(obj)
            obj.hide_viewport = obj.hide_render = False
        layer = scene.view_layers[0]
        layer.objects.active = self.result
        self.result.select_set(True, view_layer=layer)
        layer.update()

    def evaluated(self, obj: Any) -> Any:
        """Return a copy of the mesh that a copy's modifiers make."""
        depsgraph = self._scene.view_layers[0].depsgraph
        return bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), depsgraph=depsgraph)

    def prepare(self, size: int, anew: bool) -> list[str]:
        """Give the result a UV map where it has none; return what to warn of."""
        mesh, notes = self.result.data, []
        if anew or not len(mesh.uv_layers):
            self.uv_map = unwrap.unwrap(self._scene, self.result, size)
        else:
            self.uv_map = mesh.uv_layers.active.name
            notes = [unwrap.problem(mesh, self.uv_map)]
        scales = bake_child.stretches(self.result)
        if scales[0] > MAX_STRETCH * scales[-1]:
            notes.append(
                "its scale differs along its axes, which bends rays; apply its scale first"
            )
        return [note for note in notes if note]

    def bake(self, task: Task) -> Any:
        """Return an image that this process has baked."""
        try:
            return bake_child.bake(self._scene, task)
        except RuntimeError as error:
            raise failure(str(error)) from error

    def begin(self, task: Task) -> Child:
        """Have another process bake."""
        self._scene[bake_child.KEY] = json.dumps(task)
        return Child(self._scene)

    def discard(self) -> None:
        """Remove the scene and all that is in it."""
        mesh = self.result.data
        bpy.data.batch_remove([self.original, self.result, self._scene])
        bpy.data.batch_remove([mesh])


class Child:
    """A process that bakes a scene.

    Raises
    ------
    OSError
        If it cannot be started.
    """

    def __init__(self, scene: Any) -> None:
        self._folder = TemporaryDirectory(prefix="salient-bake-")
        folder = Path(self._folder.name)
        file, self._output = folder / "scene.blend", folder / "normals.png"
        self._said = folder / "said.txt"
        bpy.data.libraries.write(str(file), {scene}, path_remap="ABSOLUTE")
        script = str(Path(bake_child.__file__))
        program = [sys.executable, *bpy.app.python_args, script]  # bpy without Blender
        if bpy.app.binary_path:
            quiet = ("--background", "--factory-startup", "--python-exit-code", "1")
            program = [bpy.app.binary_path, *quiet, "--python", script]
        try:
            with self._said.open("wb") as said:
                self._process = subprocess.Popen(
                    [*program, "--", str(file), str(self._output)],
                    stdin=subprocess.DEVNULL,
                    stdout=said,
                    stderr=said,
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError:
            self._folder.cleanup()
            raise

    def over(self) -> bool:
        """Return whether the process has ended."""
        return self._process.poll() is not None

    def take(self) -> Any:
        """Return the image that it has baked, inside of the file."""
        if self._process.returncode or not self._output.exists():
            said = self._said.read_text(encoding="utf-8", errors="replace").strip()
            raise failure(said.rpartition("\n")[2] or f"exit status {self._process.returncode}")
        image = bpy.data.images.load(str(self._output))
        image.colorspace_settings.name = "Non-Color"
        image.pack()
        image.filepath_raw = ""
        return image

    def close(self) -> None:
        """End the process, and remove what it has written."""
        if not self.over():
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()


def failure(said: str) -> HostError:
    """Return an error with Blender's own words."""
    return HostError(f"Blender could not bake: {said.strip().removeprefix('Error: ')}")


def cage_of(error: float, points: Any) -> float:
    """Return a cage that rays of the result's faces begin on, outside of all of the original."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    return max(REACH * error, LEAST * size)
