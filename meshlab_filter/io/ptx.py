# SPDX-License-Identifier: GPL-3.0-or-later
"""Read PTX files: one scan or several, each a grid with a pose."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np

from ..errors import FileError, Warn, ignore
from .layer import RGB, XYZ, Columns, Layer
from .scans import transform

SHORTEST_LINE = len("0 0 0\n")
HEADER_LINES = 10
"""Columns, rows, position, three axes, and the four rows of the matrix."""


def is_plain(_: Path) -> bool:
    """Return whether this module reads a file."""
    return True


def read(path: Path, warn: Warn = ignore) -> list[Layer]:
    """Read all scans, each with its pose applied; cells without a point are left out.

    Raises
    ------
    FileError
        If the file is damaged.
    """
    layers: list[Layer] = []
    empty = 0
    with path.open(encoding="utf-8", errors="replace") as text:
        while True:
            header = [line for _, line in zip(range(HEADER_LINES), text, strict=False)]
            if not "".join(header).strip():
                break
            try:
                layer, missing = _read_scan(header, text, path, len(layers))
            except (ValueError, IndexError) as error:
                said = " ".join(str(error).split())
                raise FileError(
                    f"{path}: scan {len(layers)} is cut short or damaged ({said})"
                ) from error
            layers.append(layer)
            empty += missing
    if not layers:
        raise FileError(f"{path}: is empty")
    if empty:
        warn(f"{path}: {empty} cells of its grids hold no point and were left out")
    return layers


def _read_scan(header: list[str], text: TextIO, path: Path, number: int) -> tuple[Layer, int]:
    """Return a scan, and the number of its cells without a point."""
    columns, rows = int(header[0]), int(header[1])
    if columns < 1 or rows < 1 or SHORTEST_LINE * columns * rows > path.stat().st_size:
        raise ValueError(f"a grid of {columns} by {rows} cells")
    matrix = np.array([[float(word) for word in line.split()] for line in header[6:10]])
    if matrix.shape != (4, 4):
        raise ValueError("its matrix is not of four rows of four numbers")
    table = np.loadtxt(text, np.float64, max_rows=columns * rows, ndmin=2)
    if len(table) < columns * rows:
        raise ValueError(f"{columns * rows} points are declared, and {len(table)} are there")
    if table.shape[1] not in (3, 4, 6, 7):
        raise ValueError(f"{table.shape[1]} columns; there are 4 or 7, with colours")
    # A cell without a point is "0 0 0 0.5".
    there = table[:, :3].any(axis=1)
    table = table[there]
    points = transform(table[:, :3], matrix[:3, :3].T, matrix[3, :3])
    found: Columns = {name: points[:, axis] for axis, name in enumerate(XYZ)}
    if table.shape[1] in (4, 7):
        found["intensity"] = table[:, 3]
    if table.shape[1] >= 6:
        colors = table[:, -3:]
        if (colors != np.clip(np.round(colors), 0, 255)).any():
            raise ValueError("its colours are not whole numbers from 0 to 255")
        found |= {name: colors[:, k].astype(np.uint8) for k, name in enumerate(RGB)}
    return Layer(f"{path.stem} {number}", points, found), int(np.count_nonzero(~there))
