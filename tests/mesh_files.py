# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that several tests write, and shapes for them."""

from __future__ import annotations

import json

import numpy as np
from plyfile import PlyData, PlyElement


def grid(n):
    """Return a flat square of n by n cells, of two triangles each."""
    x, y = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n, indexing="ij")
    q = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = q[:-1, :-1].ravel(), q[1:, :-1].ravel(), q[1:, 1:].ravel(), q[:-1, 1:].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]), faces


def rows(points, columns, dtype="f8"):
    """Return points and columns as plyfile takes them."""
    fields = [(name, dtype) for name in "xyz"] + [(k, v.dtype) for k, v in columns.items()]
    table = np.zeros(len(points), fields)
    for name, values in dict(zip("xyz", points.T, strict=True)).items():
        table[name] = values
    for name, values in columns.items():
        table[name] = values
    return table


def write_ply(path, vertices, faces=None, text=False, order="<", more=(), comments=(), **lists):
    """Write points and faces as a PLY file, with lists of values for every face."""
    elements = [PlyElement.describe(vertices, "vertex")]
    if faces is not None:
        table = np.empty(len(faces), [("vertex_indices", object)] + [(k, object) for k in lists])
        for key, values in {"vertex_indices": faces, **lists}.items():
            for row, value in enumerate(values):
                table[key][row] = np.asarray(value, None if key != "vertex_indices" else "i4")
        elements.append(PlyElement.describe(table, "face", val_types=dict.fromkeys(lists, "f4")))
    PlyData([*elements, *more], text=text, byte_order=order, comments=list(comments)).write(path)
    return path


def write_obj(path, points, faces, *, coords=None, normals=None, lines=(), head=()):
    """Write faces whose corners refer to (F, 3) rows of coordinates and normals; lines by face."""
    texts = [*head, *("v " + " ".join(map(repr, p)) for p in points.tolist())]
    slots = [faces]
    for key, given in (("vt", coords), ("vn", normals)):
        if given is not None:
            texts += [f"{key} " + " ".join(map(repr, v)) for v in given[0].tolist()]
        slots.append(None if given is None else given[1])
    before = dict(lines)
    for row in range(len(faces)):
        texts += before.get(row, [])
        corners = [
            "/".join("" if s is None else str(s[row, c] + 1) for s in slots) for c in range(3)
        ]
        texts.append("f " + " ".join(corner.rstrip("/") for corner in corners))
    path.write_text("\n".join([*texts, ""]))
    return path


def write_glb(path, parts, *, images=(), materials=None, text=False, change=lambda tree: None):
    """Write parts: dicts of points, faces, node, and optional coords, normals, colors, material."""
    blob, views, accessors, meshes, nodes = b"", [], [], [], []

    def view(data):
        nonlocal blob
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob += data + bytes(-len(data) % 4)
        return len(views) - 1

    def accessor(values, kind, **more):
        codes = {"f4": 5126, "u4": 5125, "u2": 5123, "u1": 5121}
        code = codes[values.dtype.str[1:]]
        accessors.append({"bufferView": view(values.tobytes()), "componentType": code,
                          "count": len(values), "type": kind, **more})  # fmt: skip
        return len(accessors) - 1

    for part in parts:
        names = {"POSITION": accessor(part["points"].astype("f4"), "VEC3")}
        if "coords" in part:
            names["TEXCOORD_0"] = accessor(part["coords"].astype("f4"), "VEC2")
        if "normals" in part:
            names["NORMAL"] = accessor(part["normals"].astype("f4"), "VEC3")
        if "colors" in part:
            names["COLOR_0"] = accessor(part["colors"], "VEC3", normalized=True)
        primitive = {
            "attributes": names,
            "indices": accessor(part["faces"].astype("u4").ravel(), "SCALAR"),
        }
        if "material" in part:
            primitive["material"] = part["material"]
        meshes.append({"primitives": [primitive]})
        nodes.append({"mesh": len(meshes) - 1, **part.get("node", {})})
    stored = [{"mimeType": kind, "bufferView": view(data)} for kind, data in images]
    tree = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}],
            "nodes": nodes, "meshes": meshes, "accessors": accessors, "bufferViews": views,
            "images": stored, "textures": [{"source": k} for k in range(len(stored))],
            "materials": materials or [], "buffers": [{"byteLength": len(blob)}]}  # fmt: skip
    change(tree)
    if text:
        tree["buffers"][0]["uri"] = "data.bin"
        path.with_name("data.bin").write_bytes(blob)
        path.write_text(json.dumps(tree))
        return path
    data = json.dumps(tree).encode()
    data += b" " * (-len(data) % 4)
    chunks = [(data, b"JSON"), (blob, b"BIN\0")]
    body = b"".join(len(c).to_bytes(4, "little") + kind + c for c, kind in chunks)
    path.write_bytes(
        b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body
    )
    return path
