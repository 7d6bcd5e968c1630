# SPDX-License-Identifier: GPL-3.0-or-later
"""Results go back into the scene: as new objects, or in place."""

from __future__ import annotations

from typing import Any

import bpy

from . import bridge, rebuild
from .bridge import HostError
from .salcore import Simplification
from .sources import Source


def require_replaceable(source: Source) -> None:
    """Raise `HostError` if a result cannot take the place of its source."""
    source.require_editable()
    if bridge.is_mesh(source.data) != (source.object.type == "MESH"):
        raise HostError(
            f"{source.object.name}: its modifiers change its type; let the result be a new object"
        )


def replace(source: Source, result: Simplification) -> list[Any]:
    """Put a result in the place of its source's geometry, and return the objects that show it."""
    old, obj = source.object.data, source.object
    data = rebuild.shrink(source.data, result, obj.matrix_world, weighted=source.weighted)
    if source.fresh:
        name = old.name
        obj.data = data
        obj.modifiers.clear()
        if not old.users:
            bpy.data.batch_remove([old])
        data.name = name
    return source.objects


def add(source: Source, result: Simplification, suffix: str, collection: Any = None) -> list[Any]:
    """Make new objects of a result, beside those of the source, and return them.

    Parameters
    ----------
    source : Source
    result : Simplification
    suffix : str
        Follows the names of objects and data.
    collection : bpy.types.Collection, optional
        Where the objects go; without it, into the collections of the originals.
    """
    data = source.data.copy()
    data.name = source.object.data.name + suffix
    data = rebuild.shrink(data, result, source.object.matrix_world, weighted=source.weighted)
    return [_twin(obj, data, source.fresh, suffix, collection) for obj in source.objects]


def _twin(obj: Any, data: Any, applied: bool, suffix: str, collection: Any) -> Any:
    """Return an object like `obj` that shows other data."""
    if bridge.is_mesh(data) == (obj.type == "MESH"):
        selected = obj.select_get()
        obj.select_set(False)  # or else the copy would be selected, too
        twin = obj.copy()
        obj.select_set(selected)
        twin.data = data
        if applied:
            twin.modifiers.clear()
    else:
        # An object cannot change its type.
        twin = bpy.data.objects.new(obj.name, data)
        twin.parent, twin.matrix_parent_inverse = obj.parent, obj.matrix_parent_inverse
        twin.matrix_world = obj.matrix_world
        for key in list(obj.keys()):
            twin[key] = obj[key]
    twin.name = obj.name + suffix
    homes = obj.users_collection if collection is None else [collection]
    for home in homes or [bpy.context.scene.collection]:
        home.objects.link(twin)
    return twin


def hide(context: Any, originals: list[Any], twins: list[Any]) -> None:
    """Hide originals and select what takes their place."""
    context.view_layer.update()
    active = context.view_layer.objects.active
    for obj, twin in zip(originals, twins, strict=True):
        if twin.name in context.view_layer.objects:
            twin.select_set(True)
            if obj == active:
                context.view_layer.objects.active = twin
        obj.hide_set(True)
