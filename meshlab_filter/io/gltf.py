# SPDX-License-Identifier: GPL-3.0-or-later
"""Read glTF and GLB scenes: all parts where their nodes put them, with materials and images."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn, ignore
from .layer import NORMAL, RGB, XYZ, Columns, Layer
from .mtl import Material
from .obj import MATERIAL, TEXCOORD

TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
KNOWN = {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform"}
"""Extensions without which a scene can be read, among those that files may require."""
POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
ENDINGS = {"image/jpeg": ".jpg", "image/png": ".png", "image/webp": ".webp", "image/ktx2": ".ktx2"}


class Scene:
    """The tree of a file with the bytes that it refers to."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        self.path, self.blob = path, b""
        if data.startswith(b"glTF"):
            chunks = _chunks(data)
            data, self.blob = chunks[0], chunks[1] if len(chunks) > 1 else b""
        self.tree: dict[str, Any] = json.loads(data)
        if not isinstance(self.tree, dict) or "asset" not in self.tree:
            raise ValueError("no glTF scene is in it")
        self._buffers: dict[int, bytes] = {}

    def part(self, name: str, number: int) -> dict[str, Any]:
        """Return an entry of one of the tree's lists."""
        entry: dict[str, Any] = self.tree[name][number]
        return entry

    def bytes_of(self, entry: dict[str, Any]) -> bytes:
        """Return what an entry with an address refers to."""
        uri = entry["uri"]
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return (self.path.parent / _plain(uri)).read_bytes()

    def view(self, number: int) -> bytes:
        """Return the bytes of a buffer view."""
        view = self.part("bufferViews", number)
        buffer = view["buffer"]
        if buffer not in self._buffers:
            entry = self.part("buffers", buffer)
            self._buffers[buffer] = self.bytes_of(entry) if "uri" in entry else self.blob
        start = view.get("byteOffset", 0)
        data = self._buffers[buffer][start : start + view["byteLength"]]
        if len(data) < view["byteLength"]:
            raise ValueError("a buffer ends early")
        return data

    def accessor(self, number: int) -> NDArray[Any]:
        """Return an accessor's values (n,) or (n, width), as the file has them."""
        entry = self.part("accessors", number)
        dtype, width = np.dtype(TYPES[entry["componentType"]]), WIDTHS[entry["type"]]
        count = entry["count"]
        if "bufferView" in entry:
            data = self.view(entry["bufferView"])
            stride = self.part("bufferViews", entry["bufferView"]).get("byteStride", 0)
            start = entry.get("byteOffset", 0)
            row = width * dtype.itemsize
            if count and start + (count - 1) * (stride or row) + row > len(data):
                raise ValueError("an accessor reaches beyond its buffer")
            values: NDArray[Any] = np.ndarray(
                (count, width), dtype, data, start, (stride or row, dtype.itemsize)
            )
        else:
            if count > self.path.stat().st_size:
                raise ValueError("an accessor has no buffer")
            values = np.zeros((count, width), dtype)
        if "sparse" in entry:
            values = self._patched(values, entry["sparse"], dtype, width)
        values = np.ascontiguousarray(values)
        return values[:, 0] if width == 1 else values

    def _patched(
        self, values: NDArray[Any], sparse: dict[str, Any], dtype: np.dtype[Any], width: int
    ) -> NDArray[Any]:
        """Return values of which a file gives some anew."""
        values, count = values.copy(), sparse["count"]
        where, what = sparse["indices"], sparse["values"]
        at = np.frombuffer(
            self.view(where["bufferView"]),
            TYPES[where["componentType"]],
            count,
            where.get("byteOffset", 0),
        )
        new = np.frombuffer(
            self.view(what["bufferView"]), dtype, count * width, what.get("byteOffset", 0)
        )
        values[at] = new.reshape(count, width)
        return values


def is_plain(_: Path) -> bool:
    """Return whether this module reads a file."""
    return True


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read all parts of a scene, moved to where their nodes put them.

    Raises
    ------
    FileError
        If the file is damaged, or compressed in a way that is not read.
    """
    try:
        scene = Scene(path)
        _check_extensions(scene)
        images, names = _images(scene, warn)
        materials = tuple(
            _material(scene, number, names)
            for number in range(len(scene.tree.get("materials", [])))
        )
        layers: list[Layer] = []
        left: set[str] = set()
        for node, matrix in _placed(scene):
            label = str(node.get("name") or f"part {len(layers)}")
            for primitive in scene.part("meshes", node["mesh"])["primitives"]:
                layer = _part(scene, primitive, matrix, label, left)
                if layer is not None:
                    layers.append(layer)
    except (MemoryError, FileError):
        raise
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OSError) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise FileError(f"{path}: is cut short or damaged ({said})") from error
    if not layers:
        raise FileError(f"{path}: holds no mesh")
    for what in ("animations", "skins"):
        if scene.tree.get(what):
            left.add(what)
    if left:
        warn(f"{path}: left out: {', '.join(sorted(left))}")
    used = tuple(dict.fromkeys(m.texture for m in materials if m.texture))
    return [_with_materials(layer, materials, used, images) for layer in layers]


def _chunks(data: bytes) -> list[bytes]:
    """Return the chunks of a GLB file."""
    found, at = [], 12
    if int.from_bytes(data[8:12], "little") > len(data):
        raise ValueError("it ends early")
    while at + 8 <= len(data):
        length = int.from_bytes(data[at : at + 4], "little")
        found.append(data[at + 8 : at + 8 + length])
        at += 8 + length
    return found


def _plain(uri: str) -> str:
    """Return an address without its escapes."""
    bytes_of = re.sub(rb"%([0-9a-fA-F]{2})", lambda m: bytes.fromhex(m[1].decode()), uri.encode())
    return bytes_of.decode("utf-8", "surrogateescape")


def _check_extensions(scene: Scene) -> None:
    """Refuse a scene that needs what is not read here."""
    needed = sorted(set(scene.tree.get("extensionsRequired", [])) - KNOWN)
    if needed:
        raise FileError(
            f"{scene.path}: needs {', '.join(needed)}, which is not read; export it without "
            "compression"
        )


def _images(scene: Scene, warn: Warn) -> tuple[dict[str, bytes], list[str]]:
    """Return embedded images as they are, by file names, and the names of all images."""
    images: dict[str, bytes] = {}
    names: list[str] = []
    for number, entry in enumerate(scene.tree.get("images", [])):
        uri = entry.get("uri", "")
        if uri and not uri.startswith("data:"):
            names.append(_plain(uri))
            continue
        data = scene.bytes_of(entry) if uri else scene.view(entry["bufferView"])
        kind = entry.get("mimeType") or uri[5:].partition(";")[0]
        stem = re.sub(r"[^\w.-]+", "_", Path(entry.get("name") or "").stem)
        name = f"{stem or f'{scene.path.stem}_{number}'}{ENDINGS.get(kind, _ending(data))}"
        while name in images:
            name = f"{number}_{name}"
        images[name] = data
        names.append(name)
    return images, names


def _ending(data: bytes) -> str:
    return ".jpg" if data.startswith(b"\xff\xd8") else ".png"


def _material(scene: Scene, number: int, names: list[str]) -> Material:
    """Return name, colour and image of a material."""
    entry = scene.part("materials", number)
    surface = entry.get("pbrMetallicRoughness", {})
    red, green, blue = surface.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])[:3]
    texture = None
    if "baseColorTexture" in surface:
        source = scene.part("textures", surface["baseColorTexture"]["index"]).get("source")
        texture = None if source is None else names[source]
    name = re.sub(r"\s+", "_", str(entry.get("name") or "").strip()) or f"material_{number}"
    return Material(name, (float(red), float(green), float(blue)), texture)


def _placed(scene: Scene) -> list[tuple[dict[str, Any], NDArray[np.float64]]]:
    """Return the nodes that have a mesh, with their matrices in the scene."""
    nodes = scene.tree.get("nodes", [])
    scenes = scene.tree.get("scenes", [])
    if scenes:
        roots = scenes[scene.tree.get("scene", 0)].get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [number for number in range(len(nodes)) if number not in children]
    found, todo, seen = [], [(number, np.eye(4)) for number in reversed(roots)], 0
    while todo:
        number, above = todo.pop()
        seen += 1
        if seen > len(nodes):
            raise ValueError("its nodes form a ring")
        node = nodes[number]
        matrix = above @ _matrix(node)
        if "mesh" in node:
            found.append((node, matrix))
        todo += [(child, matrix) for child in reversed(node.get("children", []))]
    return found


def _matrix(node: dict[str, Any]) -> NDArray[np.float64]:
    """Return the matrix of a node."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", [1.0, 1.0, 1.0]))
    matrix[:3, 3] = node.get("translation", [0.0, 0.0, 0.0])
    return matrix


def _part(
    scene: Scene, primitive: dict[str, Any], matrix: NDArray[np.float64], label: str, left: set[str]
) -> Layer | None:
    """Return one primitive where it is; `left` takes the names of what is not read."""
    mode, attributes = primitive.get("mode", TRIANGLES), primitive["attributes"]
    if mode not in (POINTS, TRIANGLES, STRIP, FAN):
        left.add("lines")
        return None
    points, columns = _columns(scene, attributes, matrix)
    left |= {name for name in attributes if re.fullmatch(r"TEXCOORD_[1-9]|COLOR_[1-9]", name)}
    if primitive.get("targets"):
        left.add("shape keys")
    if mode == POINTS:
        return Layer(label, points, columns)
    given = primitive.get("indices")
    order = np.arange(len(points)) if given is None else scene.accessor(given).astype(np.int64)
    faces = _triangles(order, mode)
    if len(faces) and faces.max() >= len(points):
        raise ValueError("a face refers to a point that is not there")
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        faces = faces[:, ::-1]
    corners: Columns = {}
    if "TEXCOORD_0" in attributes:
        texture = _shares(scene, attributes["TEXCOORD_0"])
        # Here the image's first row is at the top, elsewhere at the bottom.
        corners[TEXCOORD] = (texture * [1.0, -1.0] + [0.0, 1.0])[faces]
    number = np.full(len(faces), primitive.get("material", -1), dtype=np.int32)
    return Layer(label, points, columns, faces, {MATERIAL: number}, corners)


def _columns(
    scene: Scene, attributes: dict[str, int], matrix: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Columns]:
    """Return the points where they are, and all their values."""
    points = _shares(scene, attributes["POSITION"]) @ matrix[:3, :3].T + matrix[:3, 3]
    columns: Columns = {name: points[:, axis] for axis, name in enumerate(XYZ)}
    if "NORMAL" in attributes:
        normals = _shares(scene, attributes["NORMAL"]) @ np.linalg.pinv(matrix[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        columns |= {name: normals[:, axis] for axis, name in enumerate(NORMAL)}
    if "COLOR_0" in attributes:
        colors = scene.accessor(attributes["COLOR_0"])
        names = (*RGB, "alpha")[: colors.shape[1]]
        columns |= {name: colors[:, axis] for axis, name in enumerate(names)}
    for name in (name for name in attributes if name.startswith("_")):
        values = scene.accessor(attributes[name])
        if values.ndim == 1:
            columns[name.lstrip("_").lower()] = values
    return points, columns


def _shares(scene: Scene, number: int) -> NDArray[np.float64]:
    """Return values as numbers, whole ones that stand for shares divided by the largest."""
    values = scene.accessor(number)
    if values.dtype.kind in "iu" and scene.part("accessors", number).get("normalized"):
        return np.maximum(values / np.iinfo(values.dtype).max, -1.0)
    return values.astype(np.float64)


def _triangles(order: NDArray[Any], mode: int) -> NDArray[np.int64]:
    """Return triangles (F, 3) of a list, a strip or a fan of points."""
    order = order.astype(np.int64)
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if mode == FAN:
        return np.column_stack([np.full(max(len(order) - 2, 0), order[0]), order[1:-1], order[2:]])
    strip = np.column_stack([order[:-2], order[1:-1], order[2:]])
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip


def _with_materials(
    layer: Layer, materials: tuple[Material, ...], used: tuple[str, ...], images: dict[str, bytes]
) -> Layer:
    """Return a part with the materials of the scene, if it has one of these."""
    number = layer.face_columns.get(MATERIAL)
    if number is None or not materials or (number < 0).all():
        return dataclasses.replace(layer, face_columns={})
    kept = {name: data for name, data in images.items() if name in used}
    return dataclasses.replace(layer, materials=materials, textures=used, images=kept)
