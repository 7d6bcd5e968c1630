# SPDX-License-Identifier: GPL-3.0-or-later
"""Read and write clouds as text: xyz, txt, csv, asc and pts, with headers or without."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn, ignore
from .columns import SKIP, canonical, color_range, describe, guess, settle_colors, unique
from .layer import NORMAL, RGB, XYZ, Columns, Layer, is_opaque

FACES = False
SNIFFED = 200
"""Lines that decide on the separator and the types of the columns."""
MAX_HEADER_LINES = 100
_WHOLE = re.compile(r"[+-]?\d+")


class Origin(NamedTuple):
    """How a text file was laid out."""

    separator: str | None
    header: tuple[str, ...]


class Layout(NamedTuple):
    """Where the data begins, and how its lines are split."""

    skip: int
    separator: str | None
    decimal_comma: bool
    names: list[str] | None
    header: tuple[str, ...]
    declared: int | None
    kinds: list[str]


def is_plain(_: Path) -> bool:
    """Return whether this module reads a file."""
    return True


def read(path: Path, warn: Warn = ignore, columns: str | None = None) -> list[Layer]:
    """Read a cloud.

    Parameters
    ----------
    path : Path
    warn : callable
        Called with one sentence that says how the columns were understood.
    columns : str, optional
        Names of the columns, such as ``x,y,z,r,g,b,_``; without, they are recognized.

    Raises
    ------
    FileError
        If the file has no columns of numbers, or other columns than named.
    """
    with _open(path) as text:
        layout = _sniff(text, path)
        if layout.declared is not None and 2 * layout.declared > path.stat().st_size:
            raise FileError(f"{path}: is cut short; it declares {layout.declared} points")
        table = _parse(text, layout, path)
    if columns is not None:
        names = _named(columns, len(table), path)
    elif layout.names is not None:
        names = unique([canonical(name) for name in layout.names])
    else:
        names = guess(table, path.suffix.lower())
    found = {name: v for name, v in zip(names, table, strict=True) if name not in SKIP}
    missing = [name for name in XYZ if name not in found]
    if len(missing) == 3 and layout.names is not None and columns is None:
        _refuse_degrees(layout.names, path)
        names = unique([*XYZ, *names[3:]])  # whatever they are called, they come first
        found = dict(zip(names, table, strict=True))
        missing = []
    if missing or any(found[name].dtype.kind not in "iuf" for name in XYZ):
        raise FileError(
            f"{path}: its columns were read as {describe(found)}, where no numbers are called "
            f"{' '.join(missing or XYZ)}; name them with --columns, such as --columns x,y,z,r,g,b"
        )
    found = settle_colors(found)
    points = np.column_stack([found[name] for name in XYZ]).astype(np.float64)
    found |= {name: points[:, axis] for axis, name in enumerate(XYZ)}
    lines = len(layout.header)
    after = f", after {lines} header line{'s' * (lines > 1)}" if lines else ""
    warn(f"{path}: columns read as {describe(found)}{_range(found)}{after}; --columns changes it")
    return [Layer(path.stem, points, found, origin=Origin(layout.separator, layout.header))]


def _refuse_degrees(names: list[str], path: Path) -> None:
    """Refuse coordinates that are angles on the globe, between which there are no distances."""
    if any(re.fullmatch(r"lat(itude)?|lon(g|gitude)?", name.strip().lower()) for name in names):
        raise FileError(
            f"{path}: its columns {', '.join(names[:3])} are degrees; project them to metres "
            "first, or name the columns of a projection with --columns"
        )


def _range(columns: Columns) -> str:
    if not set(RGB) <= columns.keys():
        return ""
    top = color_range([columns[name] for name in RGB])
    return "" if top is None else f" (colours up to {top})"


def _open(path: Path) -> TextIO:
    """Return the file's text, whatever its encoding is called."""
    with path.open("rb") as file:
        start = file.read(4096)
    wide = start.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not wide and b"\0" in start:
        raise FileError(f"{path}: is no text, as its ending says; rename it to what it is")
    encoding = "utf-16" if wide else "utf-8-sig"
    return path.open(encoding=encoding, errors="replace", newline=None)


def _sniff(text: TextIO, path: Path) -> Layout:
    """Find the first line of numbers, the separator and the names above it."""
    lines = [line for _, line in zip(range(MAX_HEADER_LINES + SNIFFED), text, strict=False)]
    text.seek(0)
    if lines and lines[0].split()[:1] in (["ncols"], ["NCOLS"]):
        raise FileError(f"{path}: is a grid of heights, no cloud; make points of it first")
    declared = None
    for skip, line in enumerate(lines):
        separator, comma = _separator(line)
        fields = _split(line, separator, comma)
        numbers = sum(map(_is_number, fields))
        if len(fields) == 1 and _WHOLE.fullmatch(fields[0]) and declared is None:
            declared = int(fields[0])
            continue
        if numbers < 3 or not _is_data(line):
            continue
        above = [h.strip() for h in lines[:skip] if h.strip()]
        header = tuple(h for h in above if not _WHOLE.fullmatch(h))
        names = None
        for title in reversed(header):
            bare = title.lstrip("#/;% ").strip()
            split = _split(bare, _separator(bare)[0], False)
            if len(split) == len(fields) and not any(map(_is_number, split)):
                names = split
                break
        sample = [_split(s, separator, comma) for s in lines[skip : skip + SNIFFED] if _is_data(s)]
        return Layout(skip, separator, comma, names, header, declared, _kinds(sample, len(fields)))
    raise FileError(f"{path}: holds no line of three numbers or more; is it a cloud?")


def _is_data(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith(("#", "//", "%"))


def _separator(line: str) -> tuple[str | None, bool]:
    """Return what separates fields (None for blanks), and whether numbers have commas."""
    if ";" in line:
        return ";", "," in line and "." not in line
    if "\t" in line.strip():
        return "\t", bool(re.search(r"\d,\d", line)) and "." not in line
    words = line.split()
    if len(words) >= 3 and all(re.fullmatch(r"[+-]?\d+,\d+", word) for word in words[:3]):
        return None, True
    return ("," if "," in line else None), False


def _split(line: str, separator: str | None, comma: bool) -> list[str]:
    text = line.strip().replace(",", ".") if comma else line.strip()
    fields = [field.strip() for field in text.split(separator)]
    if separator is not None and fields and not fields[-1]:
        fields.pop()  # a separator at the end of the line
    return fields


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def _kinds(sample: list[list[str]], count: int) -> list[str]:
    """Return the type of each column: whole numbers, numbers, or text."""
    kinds = []
    for column in range(count):
        words = [row[column] for row in sample if len(row) == count]
        if all(_WHOLE.fullmatch(w) and len(w) < 19 for w in words):
            kinds.append("i8")
        else:
            kinds.append("f8" if all(map(_is_number, words)) else "U64")
    return kinds


def _parse(text: TextIO, layout: Layout, path: Path) -> list[NDArray[Any]]:
    """Return the columns; a ``.pts`` file may hold several clouds, each after its count."""
    try:
        return _load(text, layout, layout.kinds)
    except ValueError:
        kinds = ["f8" if kind == "i8" else kind for kind in layout.kinds]
    try:
        return _load(text, layout, kinds)
    except ValueError as error:
        said = " ".join(str(error).split())
        raise FileError(f"{path}: is cut short or damaged ({said})") from error


def _load(text: TextIO, layout: Layout, kinds: list[str]) -> list[NDArray[Any]]:
    text.seek(0)
    for _ in range(layout.skip):
        text.readline()
    dtype = np.dtype([(str(number), kind) for number, kind in enumerate(kinds)])
    if layout.decimal_comma:
        text = io.StringIO(text.read().replace(",", "."))
    if layout.declared is None:
        return _columns(np.loadtxt(text, dtype, delimiter=layout.separator, ndmin=1))
    tables, declared = [], layout.declared
    while True:
        rows = np.loadtxt(
            text, dtype, delimiter=layout.separator, ndmin=1, max_rows=max(declared, 1)
        )
        if len(rows) < declared:
            raise ValueError(f"{declared} points are declared, and {len(rows)} are there")
        tables.append(rows)
        line = text.readline()
        while line and not line.strip():
            line = text.readline()
        if not line:
            return _columns(np.concatenate(tables))
        if not _WHOLE.fullmatch(line.strip()):
            raise ValueError(f"{declared} points are declared, and more are there")
        declared = int(line)


def _columns(table: NDArray[Any]) -> list[NDArray[Any]]:
    return [np.ascontiguousarray(table[name]) for name in table.dtype.names or ()]


def _named(columns: str, count: int, path: Path) -> list[str]:
    """Return the names that the user gave."""
    given = [name.strip() for name in columns.split(",")]
    if len(given) != count:
        raise FileError(
            f"{path}: has {count} columns, and --columns names {len(given)}; name all, those to "
            "leave out _"
        )
    names = [name if name in SKIP else canonical(name) for name in given]
    kept = [name for name in names if name not in SKIP]
    twice = {name for name in kept if kept.count(name) > 1}
    if twice:
        raise FileError(f"--columns: {', '.join(sorted(twice))} is named twice; name each once")
    return names


def write(layer: Layer, path: Path, warn: Warn = ignore) -> None:
    """Write a cloud; `warn` hears of columns whose names the format cannot hold."""
    ending = path.suffix.lower()
    origin = layer.origin if isinstance(layer.origin, Origin) else None
    columns = _ordered(layer.columns, ending) if origin is None else layer.columns
    held = _held(columns, ending) if origin is None or ending == ".pts" else tuple(columns)
    lost = [name for name, v in columns.items() if name not in held and not is_opaque(name, v)]
    if lost:
        warn(f"{path}: {ending} files do not keep {', '.join(lost)}; .csv and .ply do")
    columns = {name: columns[name] for name in held}
    separator = "," if ending == ".csv" else " "
    if origin is not None and (origin.separator == ";") == (ending == ".csv"):
        separator = origin.separator or separator
    lines = _rows(columns, separator)
    with path.open("w", encoding="utf-8") as file:
        if ending == ".pts":
            file.write(f"{len(layer.points)}\n")
        elif ending == ".csv" or (ending != ".xyz" or (origin is not None and origin.header)):
            mark = "" if ending == ".csv" else "# "
            file.write(mark + separator.join(columns) + "\n")
        file.write("\n".join(lines))
        file.write("\n")


def _held(columns: Columns, ending: str) -> tuple[str, ...]:
    """Return the columns that other programs understand in files without names of columns."""
    names = tuple(columns)
    if ending == ".pts":
        names = (*XYZ, "intensity", *RGB)
    elif ending == ".xyz":
        names = XYZ + (RGB if set(RGB) <= columns.keys() else NORMAL)
    return tuple(name for name in names if name in columns)


def _ordered(columns: Columns, ending: str) -> Columns:
    """Return columns in the usual order: coordinates, intensity or colours, normals, the rest."""
    first = (*XYZ, "intensity", *RGB) if ending == ".pts" else (*XYZ, *RGB, *NORMAL)
    names = [name for name in first if name in columns]
    return {name: columns[name] for name in [*names, *(n for n in columns if n not in names)]}


def _rows(columns: Columns, separator: str) -> list[str]:
    """Return the lines; numbers are as short as they can be and still the same when read."""
    texts = [_texts(values, separator) for values in columns.values()]
    return list(map(separator.join, zip(*texts, strict=True)))


def _texts(values: NDArray[Any], separator: str) -> list[str]:
    """Return values as text without separators."""
    if values.dtype.kind == "f" and values.dtype.itemsize == 8:
        return list(map(repr, values.tolist()))
    if values.dtype.kind in "iub":
        return list(map(str, map(int, values.tolist())))
    return [text.replace(separator, "_") for text in values.astype("U").tolist()]
