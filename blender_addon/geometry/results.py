# SPDX-License-Identifier: GPL-3.0-or-later
"""Results go back into the scene: as new objects, or in place."""

from __future__ import annotations

from typing import Any

import bpy

from . import read, rebuild
from .read import HostError
from .sources import Source
from .topology import Reduced

ORIGINAL = "salient_original"
"""Custom property of new objects: the name of the one that they were made from."""


def require_replaceable(source: Source) -> None:
    """Raise `HostError` if a result cannot take the place of its source."""
    source.require_editable()
    if read.is_mesh(source.data) != (source.object.type == "MESH"):
        raise HostError(
            f"{source.object.name}: its modifiers change its type; let the result be a new object"
        )


def replace(source: Source, result: Reduced) -> list[Any]:
    """Put a result in the place of its source's geometry, and return the objects that show it."""
    old, obj = source.object.data, source.object
    data = rebuild.shrink(source.data, result, source.matrix, weighted=source.weighted)
    if source.fresh:
        name = old.name
        obj.data = data
        obj.modifiers.clear()
        if not old.users:
            bpy.data.batch_remove([old])
        data.name = name
        source.data, source.fresh = data, False
    return source.objects


def add(source: Source, result: Reduced, suffix: str, collection: Any = None) -> list[Any]:
    """Make new objects of a result, beside those of the source, and return them.

    Parameters
    ----------
    source : Source
    result : Reduced
    suffix : str
        Follows the names of objects and data.
    collection : bpy.types.Collection, optional
        Where the objects go; without it, into the collections of the originals.
    """
    data = source.data.copy()
    data.name = source.object.data.name + suffix
    data = rebuild.shrink(data, result, source.matrix, weighted=source.weighted)
    return [_copy(obj, data, source.fresh, suffix, collection) for obj in source.objects]


def _copy(obj: Any, data: Any, applied: bool, suffix: str, collection: Any) -> Any:
    """Return an object like `obj` that shows other data."""
    if read.is_mesh(data) == (obj.type == "MESH"):
        selected = obj.select_get()
        obj.select_set(False)  # or else the copy would be selected, too
        copy = obj.copy()
        obj.select_set(selected)
        copy.data = data
        if applied:
            copy.modifiers.clear()
    else:
        # An object cannot change its type.
        copy = bpy.data.objects.new(obj.name, data)
        copy.parent, copy.matrix_parent_inverse = obj.parent, obj.matrix_parent_inverse
        copy.matrix_world = obj.matrix_world
        for key in list(obj.keys()):
            copy[key] = obj[key]
    copy.name = obj.name + suffix
    copy[ORIGINAL] = obj.name
    collections = obj.users_collection if collection is None else [collection]
    for one in collections or [bpy.context.scene.collection]:
        one.objects.link(copy)
    return copy


def hide(context: Any, originals: list[Any], copies: list[Any]) -> None:
    """Hide originals, in the view and in pictures, and select what takes their place."""
    context.view_layer.update()
    active = context.view_layer.objects.active
    for obj, copy in zip(originals, copies, strict=True):
        copy.hide_render = obj.hide_render
        if copy.name in context.view_layer.objects:
            copy.hide_set(False)
            copy.select_set(True)
            if obj == active:
                context.view_layer.objects.active = copy
        obj.hide_set(True)
        obj.hide_render = True
