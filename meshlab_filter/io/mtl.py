# SPDX-License-Identifier: GPL-3.0-or-later
"""Material libraries of OBJ files: what they say, and the images that they name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-cc": 1, "-clamp": 1, "-bm": 1, "-boost": 1, "-texres": 1,
    "-imfchan": 1, "-type": 1, "-mm": 2, "-o": 3, "-s": 3, "-t": 3,
}  # fmt: skip
"""Options of an image with the number of their arguments; of three, two may be left out."""
IMAGES = {
    ".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".gif", ".webp", ".dds", ".ktx",
    ".ktx2", ".exr", ".hdr", ".psd", ".ppm", ".pgm", ".pbm",
}  # fmt: skip
"""Endings of images; nothing else goes along with a mesh, whatever a file names."""
_IMAGE = re.compile(r"\s*(map_\w+|bump|disp|decal|refl|norm)\s", re.IGNORECASE)


class Material(NamedTuple):
    """What other formats than OBJ can hold of a material.

    Attributes
    ----------
    name : str
    color : tuple of 3 float, or None
        Diffuse colour in [0, 1].
    texture : str or None
        Image file, relative to the mesh's file.
    """

    name: str
    color: tuple[float, float, float] | None = None
    texture: str | None = None


def read_materials(text: str) -> list[Material]:
    """Return the materials of a library."""
    found: list[Material] = []
    for line in text.splitlines():
        words = line.split()
        key = words[0].lower() if words else ""
        if key == "newmtl":
            found.append(Material(line.split(maxsplit=1)[1].strip() if len(words) > 1 else ""))
        elif key == "kd" and found and len(words) >= 4:
            try:
                red, green, blue = map(float, words[1:4])
            except ValueError:
                continue
            found[-1] = found[-1]._replace(color=(red, green, blue))
        elif key == "map_kd" and found:
            found[-1] = found[-1]._replace(texture=_image(line)[1] or None)
    return found


def images(text: str) -> Iterator[str]:
    """Yield the names of all images in a library."""
    for line in text.splitlines():
        if _IMAGE.match(line):
            name = _image(line)[1]
            if name:
                yield name


def rename_images(text: str, names: dict[str, str]) -> str:
    """Return a library in which images go by other names."""
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if _IMAGE.match(line):
            start, name = _image(line)
            if names.get(name, name) != name:
                lines[number] = f"{start}{names[name]}"
    return "\n".join([*lines, ""])


def write_materials(materials: list[Material]) -> str:
    """Return a library with these materials."""
    lines = []
    for material in materials:
        lines.append(f"newmtl {material.name}")
        red, green, blue = material.color or (1.0, 1.0, 1.0)
        lines.append(f"Kd {red:.9g} {green:.9g} {blue:.9g}")
        if material.texture:
            lines.append(f"map_Kd {material.texture}")
    return "\n".join([*lines, ""])


def _image(line: str) -> tuple[str, str]:
    """Return what stands before the name of an image, and the name, which may have blanks."""
    pieces = re.findall(r"\s*\S+", line.rstrip())
    position = 1
    while position < len(pieces) and pieces[position].strip().lower() in _OPTIONS:
        most = _OPTIONS[pieces[position].strip().lower()]
        position += 1
        taken = 0
        while taken < most and position < len(pieces) - 1:
            if taken and not re.fullmatch(r"\s*[-+.\d][\d.eE+-]*", pieces[position]):
                break
            position += 1
            taken += 1
    rest = "".join(pieces[position:])
    name = rest.strip()
    return "".join(pieces[:position]) + rest[: len(rest) - len(rest.lstrip())], name


def resolve(name: str, folders: list[Path]) -> Path | None:
    """Return the file of an image, which programs name with either slash; None if it is missing."""
    parts = re.split(r"[\\/]", name)
    if Path(parts[-1]).suffix.lower() not in IMAGES:
        return None
    for folder in folders:
        for path in (folder / Path(*parts), folder / parts[-1], Path(name)):
            if path.is_file():
                return path
    return None
