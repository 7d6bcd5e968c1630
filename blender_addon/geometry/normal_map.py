# SPDX-License-Identifier: GPL-3.0-or-later
"""A normal map in an object's materials, each a copy of its own: others keep theirs."""

from __future__ import annotations

from typing import Any

import bpy

KEY = "salient_baked"
"""Custom property of materials that were made here."""
SUFFIX = " baked"
IMAGE, MAP, PLACE = "Salient Image", "Salient Normal Map", "Salient UV Map"
"""Names of the nodes."""


def attach(obj: Any, image: Any, uv_map: str) -> list[str]:
    """Let all materials of an object take their normals from an image; return what to warn of.

    Parameters
    ----------
    obj : bpy.types.Object
    image : bpy.types.Image
    uv_map : str
        Of its mesh, in which the image lies.
    """
    if not obj.material_slots:
        obj.data.materials.append(None)
    notes: list[str] = []
    made: dict[Any, Any] = {}
    last = _images(obj)
    for slot in obj.material_slots:
        old = slot.material
        if old not in made:
            made[old] = _own(old, obj.name)
            if not _link(made[old], image, uv_map):
                notes.append(
                    f"no shader of the material {made[old].name!r} takes normals; link its node "
                    f"{MAP!r} yourself"
                )
        slot.material = made[old]
    owners = set(made.values())
    bpy.data.batch_remove([
        old for old, users in bpy.data.user_map(subset=last - {image}).items() if users <= owners
    ])  # fmt: skip
    return notes


def _images(obj: Any) -> set[Any]:
    """Return the images of earlier bakes that the materials of an object show."""
    materials = {slot.material for slot in obj.material_slots if slot.material is not None}
    nodes = [m.node_tree.nodes.get(IMAGE) for m in materials if KEY in m and m.node_tree]
    return {node.image for node in nodes if node is not None and node.image is not None}


def _own(material: Any, name: str) -> Any:
    """Return a material that this object alone has, made from the one that it had."""
    if material is None:
        found = bpy.data.materials.new(name + SUFFIX)
    elif KEY in material and material.users == 1 and material.library is None:
        return material
    else:
        found = material.copy()
        found.name = material.name.removesuffix(SUFFIX) + SUFFIX
    found[KEY] = True
    if bpy.app.version < (5, 0) and not found.use_nodes:
        color = tuple(found.diffuse_color)
        found.use_nodes = True
        for node in found.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED":
                node.inputs["Base Color"].default_value = color
    return found


def _link(material: Any, image: Any, uv_map: str) -> bool:
    """Have the shaders of a material take their normals from an image; return whether any does."""
    tree = material.node_tree
    shaders = [
        node
        for node in tree.nodes
        if "Normal" in node.inputs and any(out.type == "SHADER" for out in node.outputs)
    ]
    texture = _node(tree, "ShaderNodeTexImage", IMAGE, shaders, 600.0)
    place = _node(tree, "ShaderNodeUVMap", PLACE, shaders, 800.0)
    normals = _node(tree, "ShaderNodeNormalMap", MAP, shaders, 300.0)
    texture.image = image
    place.uv_map = normals.uv_map = uv_map
    tree.links.new(place.outputs["UV"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], normals.inputs["Color"])
    for shader in shaders:
        tree.links.new(normals.outputs["Normal"], shader.inputs["Normal"])
    tree.nodes.active = texture
    return bool(shaders)


def _node(tree: Any, kind: str, name: str, shaders: list[Any], left: float) -> Any:
    """Return the node of this name, made where it is missing, left of the shaders."""
    node = tree.nodes.get(name)
    if node is None:
        node = tree.nodes.new(kind)
        node.name = node.label = name
        x, y = shaders[0].location if shaders else (0.0, 0.0)
        node.location = (x - left, y - 400.0)
    return node
