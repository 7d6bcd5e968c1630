# SPDX-License-Identifier: GPL-3.0-or-later
"""Render docs/pictures/blender.png with Blender itself: a monkey, its saliency, 10 % and 2 %.

Run ``python docs/blender_pictures.py`` with bpy installed; Cycles takes about four minutes.
"""

from __future__ import annotations

import sys
import tempfile
from math import radians
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks" / "speed"))

from worker import enable  # noqa: E402

WIDTH, HEIGHT, SAMPLES = 1800, 520, 96
SPACING = 2.75


def monkey() -> Any:
    """Return Blender's monkey with its subdivision applied: 31 000 points."""
    import bpy

    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.active_object
    obj.modifiers.new("smooth", "SUBSURF").levels = 3
    obj.modifiers.new("triangles", "TRIANGULATE")
    bpy.ops.object.convert(target="MESH")
    return bpy.context.active_object


def simplified(obj: Any, ratio: float) -> Any:
    """Return a new, faceted object of a share of the points."""
    import bpy

    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other is obj)
    before = set(bpy.data.objects)
    bpy.ops.object.salient_simplify(ratio=ratio, measure=False)
    (result,) = set(bpy.data.objects) - before
    result.data.shade_flat()
    return result


def clay(name: str, attribute: str | None) -> Any:
    """Return a material, grey or of a colour attribute."""
    import bpy

    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 0.6
    shader.inputs["Base Color"].default_value = (0.62, 0.6, 0.57, 1.0)
    if attribute:
        color = tree.nodes.new("ShaderNodeAttribute")
        color.attribute_name = attribute
        tree.links.new(color.outputs["Color"], shader.inputs["Base Color"])
    return material


def light_and_camera() -> None:
    """Set up a floor, two lamps and an orthographic camera."""
    import bpy

    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, -1.05))
    bpy.context.active_object.data.materials.append(clay("floor", None))
    for place, size, power in (((-4, -6, 6), 5.0, 900.0), ((7, -5, 3), 6.0, 350.0)):
        bpy.ops.object.light_add(type="AREA", location=place)
        lamp = bpy.context.active_object
        lamp.data.size, lamp.data.energy = size, power
        lamp.rotation_euler = (-lamp.location).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.object.camera_add(location=(0, -14, 2.2), rotation=(radians(81.5), 0, 0))
    camera = bpy.context.active_object
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4 * SPACING + 0.3
    scene = bpy.context.scene
    scene.camera = camera
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.35, 0.35, 0.37)


def render(path: Path) -> None:
    """Render the scene to a file."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = True
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def main() -> None:
    """Build the scene and render it."""
    import bpy

    original = monkey()
    original.data.shade_flat()
    bpy.ops.object.salient_show_saliency()
    colored = original.copy()
    colored.data = original.data.copy()
    bpy.context.scene.collection.objects.link(colored)
    row = [original, colored, simplified(original, 0.1), simplified(original, 0.02)]
    for k, obj in enumerate(row):
        obj.location.x = (k - 1.5) * SPACING
        obj.rotation_euler.z = radians(-18)
        obj.data.materials.clear()
        obj.data.materials.append(clay(f"clay {k}", "Saliency Color" if k == 1 else None))
        print(f"{len(obj.data.vertices):,} points, {len(obj.data.polygons):,} faces")
    light_and_camera()
    render(ROOT / "docs" / "pictures" / "blender.png")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        enable(folder)
        main()
