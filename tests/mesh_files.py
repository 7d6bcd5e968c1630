# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that several tests write, and shapes for them."""

from __future__ import annotations

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
