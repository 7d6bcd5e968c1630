# SPDX-License-Identifier: GPL-3.0-or-later
"""Read OBJ files corner by corner: texture coordinates, normals, materials and groups.

Readers at hand lose the normals of corners, or split the vertices. Lines of a kind are parsed
together by numpy.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn, ignore
from .layer import RGB, XYZ, Columns, Floats, Layer
from .mtl import Material, images, read_materials
from .polygons import triangulate

MATERIAL = "material"
GROUP = "group"
TEXCOORD, NORMAL_CORNERS = "texcoord", "normal"
_SLOTS = ((b"v", "points"), (b"vt", "texture coordinates"), (b"vn", "normals"))
_STATES = (b"usemtl", b"g", b"o", b"s", b"mtllib")


class Origin(NamedTuple):
    """What a layer remembers of its OBJ file.

    Attributes
    ----------
    libraries : tuple of (str, str)
        Names and texts of material libraries.
    groups : tuple of tuple of str
        For each number in the column of groups the lines that begin it.
    """

    libraries: tuple[tuple[str, str], ...]
    groups: tuple[tuple[str, ...], ...]


class _Lines(NamedTuple):
    """Lines by their first word, with their numbers."""

    texts: dict[bytes, list[bytes]]
    numbers: dict[bytes, NDArray[np.int64]]


def is_plain(_: Path) -> bool:
    """Return whether this module reads a file."""
    return True


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read a mesh or a cloud.

    Raises
    ------
    FileError
        If the file is damaged.
    """
    data = path.read_bytes()
    if b"\0" in data[:4096]:
        raise FileError(f"{path}: is no text, as its ending says; rename it to what it is")
    lines = _sort_lines(data)
    try:
        vertices = _numbers(lines, b"v")
        texture, normals = _numbers(lines, b"vt"), _numbers(lines, b"vn")
        corners, counts = _corners(lines)
    except ValueError as error:
        raise FileError(f"{path}: is damaged or no OBJ file ({error})") from error
    if not len(vertices):
        raise FileError(f"{path}: holds no points; it may be damaged or of another format")
    _warn_of_others(lines, path, warn)
    columns: Columns = {name: vertices[:, axis] for axis, name in enumerate(XYZ)}
    if vertices.shape[1] >= 6:
        columns |= {name: vertices[:, 3 + axis] for axis, name in enumerate(RGB)}
    points = np.ascontiguousarray(vertices[:, :3])
    if not len(counts):
        return [Layer(path.stem, points, columns)]
    _resolve(corners, lines, counts, (len(vertices), len(texture), len(normals)), path)
    triangle, polygon = triangulate(points, corners[:, 0], counts)
    if not len(triangle):
        return [Layer(path.stem, points, columns)]
    if (counts > 3).any():
        warn(
            f"{path}: {np.count_nonzero(counts > 3)} of {len(counts)} faces are no triangles and "
            f"were cut into triangles, which makes {len(triangle)}"
        )
    values = _values(corners[triangle], texture, normals)
    groups, states, materials, libraries = _groups(lines, path, warn)
    face_columns = {name: of[polygon] for name, of in groups.items()}
    textures = dict.fromkeys(name for _, text in libraries for name in images(text))
    return [
        Layer(
            path.stem,
            points,
            columns,
            corners[triangle, 0].astype(np.int64),
            face_columns,
            values,
            Origin(tuple(libraries), states),
            tuple(textures),
            materials=materials,
        )
    ]


def _values(corners: NDArray[np.int64], texture: Floats, normals: Floats) -> Columns:
    """Return the values of corners (F, 3, 3), each of which refers to point, texture and normal."""
    values: Columns = {}
    for slot, name, table in ((1, TEXCOORD, texture), (2, NORMAL_CORNERS, normals)):
        if len(table) and (corners[..., slot] >= 0).any():
            # A corner without a value, number -1, takes the zeros at the end.
            padded = np.vstack([table[:, :3], np.zeros((1, min(table.shape[1], 3)))])
            values[name] = padded[corners[..., slot]]
    return values


def _warn_of_others(lines: _Lines, path: Path, warn: Warn) -> None:
    """Say which elements are no points or faces."""
    found = [key for key in (b"l", b"p", b"curv", b"curv2", b"surf") if key in lines.texts]
    if found:
        listed = ", ".join(f"{len(lines.texts[key])} of {key.decode()!r}" for key in found)
        warn(f"{path}: elements that are no faces are left out: {listed}")


def _sort_lines(data: bytes) -> _Lines:
    """Return the lines of a file by their first word."""
    if b"\\\n" in data or b"\\\r\n" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    lines = [line.lstrip() for line in data.splitlines()]
    heads = np.array([line[:2].replace(b"\t", b" ") for line in lines], dtype="S2")
    texts: dict[bytes, list[bytes]] = {}
    numbers: dict[bytes, NDArray[np.int64]] = {}
    others = np.ones(len(lines), dtype=bool)
    for key in (b"v", b"vt", b"vn", b"f"):  # by far the most lines
        found = heads == key.ljust(2)
        others &= ~found
        if found.any():
            numbers[key] = np.flatnonzero(found)
            texts[key] = [lines[k][2:] for k in numbers[key].tolist()]
    rare: dict[bytes, list[int]] = {}
    for number in np.flatnonzero(others).tolist():
        key, _, rest = lines[number].replace(b"\t", b" ").partition(b" ")
        if key and not key.startswith(b"#"):
            texts.setdefault(key, []).append(rest)
            rare.setdefault(key, []).append(number)
    return _Lines(texts, numbers | {key: np.array(n) for key, n in rare.items()})


def _parse(text: bytes, dtype: type) -> NDArray[Any]:
    """Return all numbers of a text."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # it warns of what is no number, and stops there
        try:
            return np.fromstring(text, dtype=dtype, sep=" ")
        except DeprecationWarning as error:
            raise ValueError("what should be numbers is none") from error


def _numbers(lines: _Lines, key: bytes) -> Floats:
    """Return the numbers behind a word, a row for each line."""
    texts = lines.texts.get(key, [])
    if not texts:
        return np.empty((0, 3))
    if any(b"#" in text for text in texts):
        texts = [text.partition(b"#")[0] for text in texts]
    values = _parse(b" ".join(texts), np.float64)
    width, rest = divmod(len(values), len(texts))
    if rest or not 1 <= width <= 8 or len(texts[0].split()) != width:
        raise ValueError(f"lines of {key.decode()!r} differ in their number of values")
    if key == b"v" and width < 3:
        raise ValueError(f"points have {width} coordinates")
    return values.reshape(-1, width)


def _corners(lines: _Lines) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return what all corners of faces refer to (C, 3), from 1 and 0 for nothing, and counts."""
    texts = lines.texts.get(b"f", [])
    if any(b"#" in text for text in texts):
        texts = [text.partition(b"#")[0] for text in texts]
    counts = np.fromiter((len(text.split()) for text in texts), dtype=np.int64, count=len(texts))
    total, joined = int(counts.sum()), b" ".join(texts)
    single, double = joined.count(b"/"), joined.count(b"//")
    table = np.zeros((total, 3), dtype=np.int64)
    slots = None
    if single == 0:
        slots = [0]
    elif single == 2 * double == 2 * total:
        slots = [0, 2]
    elif single == total and not double and b"/ " not in joined + b" ":
        slots = [0, 1]
    elif single == 2 * total and not double:
        slots = [0, 1, 2]
    if slots is None:  # corners of several kinds
        parts = [(word + b"//").split(b"/")[:3] for word in joined.split()]
        slots, joined = [0, 1, 2], b" ".join(number or b"0" for part in parts for number in part)
    values = _parse(joined.replace(b"/", b" "), np.int64)
    if len(values) != total * len(slots):
        raise ValueError("what faces refer to is no number")
    table[:, slots] = values.reshape(total, len(slots))
    return table, counts


def _resolve(
    corners: NDArray[np.int64],
    lines: _Lines,
    counts: NDArray[np.int64],
    sizes: tuple[int, int, int],
    path: Path,
) -> None:
    """Turn numbers from 1, or back from where a face stands, into positions; -1 for none."""
    face = np.repeat(np.arange(len(counts)), counts)
    for slot, ((key, name), size) in enumerate(zip(_SLOTS, sizes, strict=True)):
        given = corners[:, slot]
        below = given < 0
        if below.any():
            above = np.searchsorted(lines.numbers.get(key, np.empty(0)), lines.numbers[b"f"])
            given[below] += above[face[below]] + 1
            if (given[below] < 1).any():
                raise FileError(f"{path}: a face refers to {name} before the first; it is damaged")
        if given.max(initial=0) > size or (slot == 0 and given.min(initial=1) < 1):
            raise FileError(
                f"{path}: a face refers to {name} outside 1 to {size}; the file is damaged or cut "
                "short"
            )
        corners[:, slot] = given - 1


def _groups(
    lines: _Lines, path: Path, warn: Warn
) -> tuple[Columns, tuple[tuple[str, ...], ...], tuple[Material, ...], list[tuple[str, str]]]:
    """Return the material and group of every face, the groups' lines, materials, and libraries."""
    libraries = []
    named = [_text(line) for line in lines.texts.get(b"mtllib", [])]
    # A line may name several libraries, or one with blanks in its name.
    split = [[name] if (path.parent / name).is_file() else name.split() for name in named]
    for name in dict.fromkeys(name for names in split for name in names):
        library = path.parent / name
        if library.is_file():
            libraries.append((name, library.read_text(encoding="utf-8", errors="surrogateescape")))
        else:
            warn(f"{path}: its material library {name} is missing")
    known = {material.name: material for _, text in libraries for material in read_materials(text)}
    faces = lines.numbers[b"f"]
    columns: Columns = {}
    materials: tuple[Material, ...] = ()
    if b"usemtl" in lines.texts:
        names = ["", *map(_text, lines.texts[b"usemtl"])]
        at = np.searchsorted(lines.numbers[b"usemtl"], faces)
        order = list(dict.fromkeys(names[k] for k in np.unique(at)))
        numbers = np.array([order.index(name) if name in order else -1 for name in names])
        columns[MATERIAL] = numbers[at].astype(np.int32)
        materials = tuple(known.get(name, Material(name)) for name in order)
    keys = [key for key in (b"o", b"g", b"s") if key in lines.texts]
    states: tuple[tuple[str, ...], ...] = ()
    if keys:
        at = np.stack([np.searchsorted(lines.numbers[key], faces) for key in keys], axis=1)
        rows, number = np.unique(at, axis=0, return_inverse=True)
        states = tuple(
            tuple(
                f"{key.decode()} {_text(lines.texts[key][k - 1])}".rstrip()
                for key, k in zip(keys, row, strict=True)
                if k
            )
            for row in rows.tolist()
        )
        columns[GROUP] = number.reshape(-1).astype(np.int32)
    return columns, states, materials, libraries


def _text(line: bytes) -> str:
    return line.strip().decode("utf-8", "surrogateescape")
