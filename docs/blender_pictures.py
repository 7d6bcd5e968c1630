# SPDX-License-Identifier: GPL-3.0-or-later
"""Render docs/pictures/blender.png and decimate.png with Blender itself.

    python -m docs.blender_pictures
    python -m docs.blender_pictures --model statue.ply --faces 4375 --output statue.png
    python -m docs.blender_pictures --figures

The first shows a monkey, its saliency, 10 % and 2 %; the second a carved monkey, what Blender's own
Decimate modifier makes of it, and what this build makes of it, at equal numbers of faces. A model
takes the place of the carved monkey. How far the surfaces lie apart stands in
docs/figures/decimate.md, which `--figures` writes without pictures. Needs bpy; Cycles takes a few
minutes.
"""

from __future__ import annotations

import argparse
import importlib
import tempfile
from math import radians
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.page import FIGURES, table, write
from benchmarks.speed.worker import NAME, enable

ROOT = Path(__file__).parents[1]
WIDTH, SAMPLES = 1800, 12
SPACING = 2.75
SHARE = 0.02
"""Of the faces of the carved monkey that are left."""


def monkey(levels: int = 3) -> Any:
    """Return Blender's monkey with its subdivision applied: 31 000 points, or more."""
    import bpy

    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.active_object
    obj.modifiers.new("smooth", "SUBSURF").levels = levels
    obj.modifiers.new("triangles", "TRIANGULATE")
    bpy.ops.object.convert(target="MESH")
    return bpy.context.active_object


def carved_monkey() -> Any:
    """Return a finer monkey with combed hair and a rough skin: 126 000 points."""
    obj = monkey(4)
    mesh = obj.data
    points = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    normals = np.empty_like(points)
    mesh.vertices.foreach_get("co", points)
    mesh.vertices.foreach_get("normal", normals)
    points, normals = points.reshape(-1, 3), normals.reshape(-1, 3)
    x, y, z = points.astype(np.float64).T
    hair = 1.0 / (1.0 + np.exp(-30.0 * (z - 0.5 + 0.4 * y)))
    comb = np.abs(np.sin(34.0 * x + 5.0 * np.sin(2.5 * y) + 3.0 * np.sin(4.0 * z)))
    waves = np.random.default_rng(0).normal(0.0, 30.0, (24, 3))
    rough = np.sin(points @ waves.T + np.arange(24.0)).mean(axis=1)
    depth = -0.035 * hair * (1.0 - comb) + 0.004 * rough
    mesh.vertices.foreach_set("co", (points + depth[:, None] * normals).astype("f4").ravel())
    mesh.update()
    return obj


def select(obj: Any) -> None:
    """Select an object alone."""
    import bpy

    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other is obj)
    bpy.context.view_layer.objects.active = obj


def simplified(obj: Any, **target: Any) -> Any:
    """Return a new, faceted object of a share of the points, or of a number of faces."""
    import bpy

    select(obj)
    before = set(bpy.data.objects)
    bpy.ops.object.salient_simplify(measure=False, hide_source=False, **target)
    (result,) = set(bpy.data.objects) - before
    result.data.shade_flat()
    return result


def decimated(obj: Any, faces: int) -> Any:
    """Return what Blender's Decimate modifier makes of an object, faceted."""
    import bpy

    modifier = obj.modifiers.new("decimate", "DECIMATE")
    modifier.ratio = faces / len(obj.data.polygons)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph))
    obj.modifiers.remove(modifier)
    result = bpy.data.objects.new("decimated", mesh)
    bpy.context.scene.collection.objects.link(result)
    mesh.shade_flat()
    return result


def errors(original: Any, result: Any) -> list[str]:
    """Return mean and largest distance between two surfaces, both ways, in thousandths of the size.

    Of samples all over each surface: vertices alone would tell nothing of the faces between.
    """
    salcore = importlib.import_module(f"{NAME}.salcore")
    read = importlib.import_module(f"{NAME}.geometry.read")
    found = (read.arrays(obj.data, np.eye(4)) for obj in (original, result))
    first, second = (salcore.make_surface(each.points, each.faces) for each in found)
    size = np.linalg.norm(np.ptp(first.points, axis=0)) / 1000.0
    there, back = (
        salcore.compare(other, salcore.make_surface(samples(one))).surface_back
        for one, other in ((first, second), (second, first))
    )
    mean, largest = 0.5 * (there.mean + back.mean) / size, max(there.max, back.max) / size
    return [f"{len(result.data.polygons):,}", f"{mean:.2f} ‰", f"{largest:.1f} ‰"]


def samples(surface: Any) -> Any:
    """Return points (n, 3) all over a surface, as dense everywhere."""
    corners = surface.points[surface.faces]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(one, other), axis=1)
    rng = np.random.default_rng(0)
    face = rng.choice(len(area), 50_000, p=area / area.sum())
    shares = rng.dirichlet((1.0, 1.0, 1.0), len(face))
    return np.einsum("nk,nkd->nd", shares, corners[face])


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


def light_and_camera(columns: int, width: float, height: float, floor: float) -> None:
    """Set up a floor, two lamps and an orthographic camera that sees so many columns."""
    import bpy

    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, floor))
    bpy.context.active_object.data.materials.append(clay("floor", None))
    for place, size, power in (((-6, -5, 6), 2.5, 650.0), ((8, -5, 3), 6.0, 150.0)):
        bpy.ops.object.light_add(type="AREA", location=place)
        lamp = bpy.context.active_object
        lamp.data.size, lamp.data.energy = size, power
        lamp.rotation_euler = (-lamp.location).to_track_quat("-Z", "Y").to_euler()
    bpy.ops.object.camera_add(location=(0, -14, 2.2), rotation=(radians(81.5), 0, 0))
    camera = bpy.context.active_object
    camera.data.type, camera.data.ortho_scale = "ORTHO", columns * width + 0.3
    scene = bpy.context.scene
    scene.camera = camera
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.3, 0.3, 0.32)
    scene.render.resolution_x = WIDTH
    scene.render.resolution_y = round(WIDTH * height / (columns * width + 0.3))


def render(path: Path) -> None:
    """Render the scene to a file."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def stand(row: list[Any], width: float, turn: float, colored: int = -1) -> None:
    """Put objects into a row, of clay but for one that shows its saliency."""
    for k, obj in enumerate(row):
        obj.location.x = (k - 0.5 * (len(row) - 1)) * width
        obj.rotation_euler.z = radians(turn)
        obj.data.materials.clear()
        obj.data.materials.append(clay(f"clay {k}", "Saliency Color" if k == colored else None))
        print(f"{len(obj.data.vertices):,} points, {len(obj.data.polygons):,} faces")


def empty() -> None:
    """Start with an empty scene."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)


def stages(path: Path) -> None:
    """Render a monkey, its saliency, 10 % and 2 %."""
    import bpy

    empty()
    original = monkey()
    original.data.shade_flat()
    bpy.ops.object.salient_show_saliency()
    colored = original.copy()
    colored.data = original.data.copy()
    bpy.context.scene.collection.objects.link(colored)
    row = [original, colored, simplified(original, ratio=0.1), simplified(original, ratio=0.02)]
    stand(row, SPACING, -18.0, colored=1)
    light_and_camera(4, SPACING, 3.3, -1.05)
    render(path)


def both(original: Any, faces: int | None = None) -> tuple[Any, Any]:
    """Return what Decimate and this make of an object, at equal numbers of faces."""
    theirs = decimated(original, faces or round(SHARE * len(original.data.polygons)))
    return theirs, simplified(original, target="FACES", faces=len(theirs.data.polygons))


def beside_decimate(path: Path, model: str | None, faces: int | None) -> None:
    """Render a mesh, Decimate's result and ours at equal numbers of faces."""
    import bpy

    empty()
    if model is None:
        original, turn = carved_monkey(), -18.0
    else:
        bpy.ops.wm.ply_import(filepath=model, forward_axis="NEGATIVE_Z", up_axis="Y")
        original, turn = fitted(bpy.context.active_object), 0.0
    theirs, ours = both(original, faces)
    original.data.shade_flat()
    corners = np.array([corner[:] for corner in original.bound_box])
    low, high = corners.min(axis=0), corners.max(axis=0)
    width = 1.08 * float(high[0] - low[0])
    stand([original, theirs, ours], width, turn)
    light_and_camera(3, width, 1.3 * float(high[2] - low[2]), float(low[2]))
    render(path)


def figures() -> None:
    """Write how far both monkeys lie from what Decimate and this make of them."""
    rows = []
    for name, make in (("combed monkey", carved_monkey), ("monkey", lambda: monkey(4))):
        empty()
        original = make()
        label = f"{name}, {len(original.data.polygons):,} triangles"
        for tool, result in zip(("Decimate", "Salient Simplify"), both(original), strict=True):
            rows.append([f"{label}: {tool}", *errors(original, result)])
    head = ["at equal triangles", "triangles", "mean distance", "largest"]
    title, module = "Beside Blender's Decimate", "docs.blender_pictures"
    write(FIGURES / "decimate.md", title, module, ABOUT, table(head, rows), models=False)


ABOUT = """Distances between the original's surface and the result's, the mean of both ways and the
largest of either, in thousandths of the diagonal, of samples all over both surfaces."""


def fitted(obj: Any) -> Any:
    """Return an object whose own coordinates stand upright and lie in a box of size 2."""
    from mathutils import Matrix

    obj.data.transform(obj.matrix_world)
    obj.matrix_world = Matrix.Identity(4)
    used = np.unique([k for polygon in obj.data.polygons for k in polygon.vertices])
    points = np.array([obj.data.vertices[k].co for k in used.tolist()])
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    scale = 2.0 / np.ptp(points, axis=0).max()
    obj.data.transform(Matrix.Scale(scale, 4) @ Matrix.Translation(-centre))
    return obj


def main() -> None:
    """Render both pictures, or the second one of a model."""
    parser = argparse.ArgumentParser(description="Render the pictures of Blender.")
    parser.add_argument("--model", help="PLY file with y upwards, in place of the carved monkey")
    parser.add_argument("--faces", type=int, help="default: a fiftieth")
    parser.add_argument("--figures", action="store_true", help="render nothing")
    parser.add_argument("--output", type=Path, help="render the second picture alone, to here")
    chosen = parser.parse_args()
    pictures = ROOT / "docs" / "pictures"
    if chosen.output is None:
        figures()
        if chosen.figures:
            return
        stages(pictures / "blender.png")
    beside_decimate(chosen.output or pictures / "decimate.png", chosen.model, chosen.faces)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        enable(folder)
        main()
