# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the normals of one object of a scene into an image of another's; also a script of its own.

    blender --background --factory-startup --python bake_child.py -- FILE.blend IMAGE.png

FILE.blend holds the scene, which knows its `Task`. Blender's own bake within a window cannot be
stopped while it casts its rays; another process can, at any time, and takes only what it needs.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any, NamedTuple

import bpy
import numpy as np

ORIGINAL, RESULT, KEY = "salient_original", "salient_result", "salient_task"
"""Custom properties of the scene."""
SAMPLES = 4
"""For each pixel: they smooth where one face of the original ends and the next begins."""
NICENESS = 5
"""Blender's window goes first where there are few processors."""
PIXELS_OF_MARGIN = 128
"""Pixels along a side of the image for one of margin round an island."""


class Task(NamedTuple):
    """What to bake.

    Attributes
    ----------
    size : int
        Pixels along each side of the image.
    cage : float
        How far outside of the result rays begin, in the scene.
    uv_map : str
    """

    size: int
    cage: float
    uv_map: str


def bake(scene: Any, task: Task) -> Any:
    """Return a new image of the normals of a scene's original, as the result's tangents have them.

    Raises
    ------
    RuntimeError
        With Blender's own words, if it cannot bake.
    """
    original, result = scene[ORIGINAL], scene[RESULT]
    scene.cycles.samples = SAMPLES
    image = bpy.data.images.new("Bake", task.size, task.size, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    material = _aim(result, image)
    # The cage is in the result's own space, the reach of rays in the scene.
    scales = stretches(result)
    with bpy.context.temp_override(
        scene=scene, view_layer=scene.view_layers[0], active_object=result,
        object=result, selected_objects=[original, result],
    ):  # fmt: skip
        bpy.ops.object.bake(
            type="NORMAL",
            normal_space="TANGENT",
            use_selected_to_active=True,
            use_cage=True,
            cage_extrusion=task.cage / scales[-1],
            max_ray_distance=2.0 * task.cage * scales[0] / scales[-1],
            margin=max(task.size // PIXELS_OF_MARGIN, 2),
            uv_layer=task.uv_map,
            target="IMAGE_TEXTURES",
            save_mode="INTERNAL",
            use_clear=True,
        )
    bpy.data.materials.remove(material)
    if not image.is_dirty:
        raise RuntimeError("it left the image empty")
    return image


def _aim(result: Any, image: Any) -> Any:
    """Let all faces be of one material, whose active node is the image; return the material."""
    material = bpy.data.materials.new("Bake")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    if not result.material_slots:
        result.data.materials.append(None)
    for slot in result.material_slots:
        for slot.link in ("OBJECT", "DATA"):
            slot.material = material
    return material


def stretches(obj: Any) -> Any:
    """Return how much an object's own space is stretched along three axes, falling."""
    return np.linalg.svd(np.array(obj.matrix_world)[:3, :3], compute_uv=False)


def main(path: str, output: str) -> None:
    """Bake the scene of a file, and write its image."""
    with bpy.data.libraries.load(path) as (there, here):
        here.scenes = there.scenes[:1]
    (scene,) = here.scenes
    scene.view_layers[0].update()
    image = bake(scene, Task(*json.loads(scene[KEY])))
    image.filepath_raw, image.file_format = output, "PNG"
    image.save()


if __name__ == "__main__":
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    main(*sys.argv[sys.argv.index("--") + 1 :])
