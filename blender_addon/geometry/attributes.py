# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of meshes and point clouds as arrays: every type, in the type it is stored in."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Layout(NamedTuple):
    """How the values of one attribute type lie in memory."""

    field: str
    """Name of the property to read and write."""
    dtype: str
    width: int
    """Numbers in a value."""


LAYOUTS = {
    "FLOAT": Layout("value", "f4", 1),
    "INT": Layout("value", "i4", 1),
    "BOOLEAN": Layout("value", "?", 1),
    "INT8": Layout("value", "i1", 1),
    "FLOAT_VECTOR": Layout("vector", "f4", 3),
    "FLOAT2": Layout("vector", "f4", 2),
    "FLOAT4": Layout("vector", "f4", 4),
    "FLOAT_COLOR": Layout("color", "f4", 4),
    # Bytes as they are stored, divided by 255: "color" would take them through linear light.
    "BYTE_COLOR": Layout("color_srgb", "f4", 4),
    "INT16_2D": Layout("value", "i2", 2),
    "INT32_2D": Layout("value", "i4", 2),
    "QUATERNION": Layout("value", "f4", 4),
    "FLOAT4X4": Layout("value", "f4", 16),
}
"""Every type but STRING, which can only be read one by one."""

MEASURES = {"FLOAT", "FLOAT_VECTOR", "FLOAT2", "FLOAT_COLOR", "BYTE_COLOR"}
"""Types whose values between two others mean something."""

TOPOLOGY = {
    "position": "FLOAT_VECTOR",
    ".edge_verts": "INT32_2D",
    ".corner_vert": "INT",
    ".corner_edge": "INT",
}
"""Attributes that are the geometry itself, and their types."""


class Layer(NamedTuple):
    """One attribute, taken out of its geometry."""

    name: str
    type: str
    domain: str
    values: NDArray[Any] | list[bytes]

    def take(self, elements: NDArray[np.integer[Any]]) -> Layer:
        """Return the layer with the values of these elements; -1 stands for none, a zero."""
        if isinstance(self.values, list):
            chosen = [self.values[k] if k >= 0 else b"" for k in elements.tolist()]
            return self._replace(values=chosen)
        chosen = self.values[elements]
        if (elements < 0).any():
            chosen[elements < 0] = 0
        return self._replace(values=chosen)

    def blend(self, elements: NDArray[np.integer[Any]], weights: NDArray[np.float64]) -> Layer:
        """Return the layer with the means of some elements (n, 3) by weights (n, 3)."""
        values = np.asarray(self.values)[elements]
        share = weights.reshape(weights.shape + (1,) * (values.ndim - 2))
        return self._replace(values=(share * values).sum(axis=1).astype(values.dtype))


def read(attribute: Any) -> NDArray[Any] | list[bytes]:
    """Return the values of a `bpy.types.Attribute`: (n,) or (n, width), or a list of bytes."""
    data = attribute.data
    if attribute.data_type == "STRING":
        return [item.value for item in data]
    layout = LAYOUTS[attribute.data_type]
    values = np.empty(len(data) * layout.width, dtype=layout.dtype)
    data.foreach_get(layout.field, values)
    return values if layout.width == 1 else values.reshape(-1, layout.width)


def topology(geometry: Any, name: str) -> NDArray[Any]:
    """Return an attribute that is the geometry itself; an empty geometry may lack it."""
    attribute = geometry.attributes.get(name)
    if attribute is not None:
        values: NDArray[Any] = read(attribute)  # type: ignore[assignment]
        return values
    layout = LAYOUTS[TOPOLOGY[name]]
    shape = (0,) if layout.width == 1 else (0, layout.width)
    return np.empty(shape, dtype=layout.dtype)


def write(attribute: Any, values: NDArray[Any] | list[bytes]) -> None:
    """Set all values of an attribute; arrays are cast to the type it stores."""
    if isinstance(values, list):
        for item, value in zip(attribute.data, values, strict=True):
            item.value = value
        return
    layout = LAYOUTS[attribute.data_type]
    flat = np.ascontiguousarray(values, dtype=layout.dtype).ravel()
    attribute.data.foreach_set(layout.field, flat)


def read_layers(geometry: Any, skip: Collection[str] = ()) -> list[Layer]:
    """Return all attributes of a mesh or point cloud but its topology and those of `skip`."""
    return [
        Layer(attribute.name, attribute.data_type, attribute.domain, read(attribute))
        for attribute in geometry.attributes
        if attribute.name not in TOPOLOGY and attribute.name not in skip
    ]


def write_layer(geometry: Any, layer: Layer) -> None:
    """Give a geometry an attribute; one of the same name, type and domain is overwritten.

    One of the same name and another type or domain is replaced.
    """
    attribute = geometry.attributes.get(layer.name)
    if attribute is not None and (attribute.data_type, attribute.domain) != layer[1:3]:
        geometry.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = geometry.attributes.new(layer.name, layer.type, layer.domain)
    write(attribute, layer.values)
