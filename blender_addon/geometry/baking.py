# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in a scene of its own: the user's scene, selection, visibility and engine stay untouched.

Blender bakes selected, visible objects of a scene with its engine. Here copies of two objects are
all that such a scene has, which spares it the rest of the user's scene, too.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.app import handlers

from . import unwrap
from .read import HostError

ENGINE = "CYCLES"
SAMPLES = 4
"""For each pixel: they smooth where one face of the original ends and the next begins."""
REACH = 1.25
"""Cage over the largest error: rays meet the original at a slant, hence later."""
LEAST = 1e-4
"""Cage over the size of the object, where there is no error."""
PIXELS_OF_MARGIN = 128
"""Pixels along a side of the image for one of margin round an island."""
MAX_STRETCH = 1.5
"""Scale along one axis over that along another: Blender moves the cage in the result's own space,
and casts rays in the scene's."""
JOB = "OBJECT_BAKE"


class Stage:
    """A scene with copies of an original and of what is to look like it.

    Attributes
    ----------
    original, result : bpy.types.Object
        The copies; the result's mesh is a copy, too.
    image : bpy.types.Image or None
    uv_map : str
        Of the result's mesh.
    """

    def __init__(self, context: Any, original: Any, result: Any) -> None:
        scene = bpy.data.scenes.new("Bake")
        self._scene = scene
        self.image: Any = None
        self.uv_map = ""
        self._material: Any = None
        try:
            scene.render.engine = ENGINE
        except TypeError:
            bpy.data.scenes.remove(scene)
            raise HostError(
                "Cycles is not there, which bakes; enable it in Preferences, Add-ons"
            ) from None
        scene.cycles.samples = SAMPLES
        scene.cycles.device = context.scene.cycles.device
        scene.frame_set(context.scene.frame_current, subframe=context.scene.frame_subframe)
        self.original, self.result = original.copy(), result.copy()
        self.result.data = result.data.copy()
        for obj in (self.original, self.result):
            scene.collection.objects.link(obj)
            obj.hide_viewport = obj.hide_render = False
            obj.select_set(True, view_layer=self._layer)
        self._layer.objects.active = self.result
        self._layer.update()

    @property
    def _layer(self) -> Any:
        return self._scene.view_layers[0]

    def evaluated(self, obj: Any) -> Any:
        """Return a copy of the mesh that a copy's modifiers make."""
        depsgraph = self._layer.depsgraph
        return bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), depsgraph=depsgraph)

    def prepare(self, size: int, anew: bool) -> str:
        """Give the result a UV map where it has none, and an image; return what to warn of."""
        mesh = self.result.data
        if anew or not len(mesh.uv_layers):
            self.uv_map = unwrap.unwrap(self._scene, self.result, size)
            note = ""
        else:
            self.uv_map = mesh.uv_layers.active.name
            note = unwrap.problem(mesh, self.uv_map)
        self.image = bpy.data.images.new("Bake", size, size, alpha=False)
        self.image.colorspace_settings.name = "Non-Color"
        self._aim()
        scales = self._scales()
        if scales[0] > MAX_STRETCH * scales[-1]:
            stretched = "its scale differs along its axes, which bends rays; apply its scale first"
            note = f"{note}; {stretched}" if note else stretched
        return note

    def _aim(self) -> None:
        """Let all faces of the result be of one material, whose active node is the image."""
        material = self._material = bpy.data.materials.new("Bake")
        if bpy.app.version < (5, 0):
            material.use_nodes = True
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = self.image
        material.node_tree.nodes.active = node
        slots = self.result.material_slots
        if not slots:
            self.result.data.materials.append(None)
        for slot in self.result.material_slots:
            for slot.link in ("OBJECT", "DATA"):
                slot.material = material

    def _scales(self) -> Any:
        """Return how much the result's own space is stretched, falling."""
        matrix = np.array(self.result.matrix_world)[:3, :3]
        return np.linalg.svd(matrix, compute_uv=False)

    def bake(self, cage: float) -> None:
        """Bake, and return when it is done; `cage` is a length in the scene."""
        self._call("EXEC_DEFAULT", cage)

    def begin(self, cage: float) -> Outcome:
        """Have Blender bake while its window stays free; Esc stops it."""
        outcome = Outcome()
        try:
            self._call("INVOKE_DEFAULT", cage)
        except BaseException:
            outcome.close()
            raise
        return outcome

    def _call(self, how: str, cage: float) -> None:
        # The cage is in the result's own space, the reach of rays in the scene.
        scales = self._scales()
        with bpy.context.temp_override(
            scene=self._scene, view_layer=self._layer, active_object=self.result,
            object=self.result, selected_objects=[self.original, self.result],
        ):  # fmt: skip
            try:
                bpy.ops.object.bake(
                    how,
                    type="NORMAL",
                    normal_space="TANGENT",
                    use_selected_to_active=True,
                    use_cage=True,
                    cage_extrusion=cage / scales[-1],
                    max_ray_distance=2.0 * cage * scales[0] / scales[-1],
                    margin=max(self.image.size[0] // PIXELS_OF_MARGIN, 2),
                    uv_layer=self.uv_map,
                    target="IMAGE_TEXTURES",
                    save_mode="INTERNAL",
                    use_clear=True,
                )
            except RuntimeError as error:
                said = str(error).strip().removeprefix("Error: ")
                raise HostError(f"Blender could not bake: {said}") from error

    def take_image(self, name: str) -> Any:
        """Return the baked image, kept in the file, under a name.

        Raises
        ------
        HostError
            If nothing has been baked.
        """
        if not self.image.is_dirty:
            raise HostError("Blender baked nothing; its own messages say why")
        image, self.image = self.image, None
        image.name = name
        image.pack()
        return image

    def discard(self) -> None:
        """Remove the scene and all that is in it, but for an image that has been taken."""
        mesh = self.result.data
        bpy.data.batch_remove([self.original, self.result, self._scene])
        left = [mesh, self._material, self.image]
        bpy.data.batch_remove([block for block in left if block is not None])


class Outcome:
    """How a bake that goes on by itself ends, as Blender's handlers tell.

    Attributes
    ----------
    cancelled : bool
    """

    def __init__(self) -> None:
        self.cancelled = False
        handlers.object_bake_cancel.append(self._cancel)

    def over(self) -> bool:
        """Return whether it has ended."""
        if bpy.app.is_job_running(JOB):
            return False
        self.close()
        return True

    def close(self) -> None:
        """Listen no longer."""
        if self._cancel in handlers.object_bake_cancel:
            handlers.object_bake_cancel.remove(self._cancel)

    def _cancel(self, *_: Any) -> None:
        self.cancelled = True


def cage_of(error: float, points: Any) -> float:
    """Return a cage that rays of the result's faces begin on, outside of all of the original."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    return max(REACH * error, LEAST * size)
