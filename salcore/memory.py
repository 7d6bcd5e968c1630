# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory an input takes, and whether the machine has as much."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path
from typing import Any

from .errors import MemoryLimitError
from .parameters import TARGETS, Parameters, checked

POINT, TRIANGLE, NEIGHBOR, EDGE, CELL_POINT = 350, 280, 9, 24, 1700
"""Bytes: of a point; of a triangle, also where a cloud's are only sought; of a nearest neighbour
among which a star is sought; of an edge of a wide graph; of a point in a 3D triangulation."""


def estimated_memory(points: int, faces: int = 0, parameters: Parameters | None = None) -> int:
    """Return about how many bytes an analysis and a simplification take beside their input.

    Parameters
    ----------
    points, faces : int
        How many there are; no faces for a cloud.
    parameters : Parameters, optional
        ``Parameters()`` if left out.

    Raises
    ------
    ParameterError
        If a number is none, or negative.

    Notes
    -----
    A formula fitted to measured peaks, mostly within a third of them: `POINT` bytes a point;
    `TRIANGLE` bytes a face, of which a cloud has two a point; `NEIGHBOR` bytes a point for each of
    `Parameters.neighbors` on a cloud; `EDGE` bytes for each of the 3 k (k + 1) neighbours that a
    point has at level k; `CELL_POINT` bytes a point for ``graph="delaunay"``, where a point has
    2.5 times as many neighbours.

    Measuring the errors for a report takes up to a quarter more on a mesh.

    Examples
    --------
    >>> import salcore
    >>> salcore.estimated_memory(1_000_000) // 10**6
    1198
    """
    parameters = checked(parameters)
    points, faces = (_count(value, name) for value, name in ((points, "points"), (faces, "faces")))
    rings = parameters.level
    edges = 3 * rings * (rings + 1)
    total = POINT * points + TRIANGLE * max(faces, 2 * points)
    if parameters.graph == "delaunay":
        total += CELL_POINT * points
        edges = int(2.5 * edges)
    elif not faces:
        total += NEIGHBOR * parameters.neighbors * points
    return total + EDGE * edges * points


def _count(value: Any, name: str) -> int:
    """Return a number of points or faces, checked; any number from 0."""
    row = dataclasses.replace(TARGETS[1], name=name, minimum=0, maximum=2.0**63)
    return int(row.check(value))


def available_memory() -> int | None:
    """Return the bytes that this machine has free, or None where it does not tell.

    On Linux what programs can have without swapping; on other systems of the Unix family all there
    is; nothing on Windows.
    """
    try:
        text = Path("/proc/meminfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        text = ""
    match = re.search(r"^MemAvailable:\s+(\d+) kB", text, re.MULTILINE)
    if match:
        return 1024 * int(match[1])
    try:
        pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
    return pages * size if pages > 0 and size > 0 else None


def check_memory(points: Any, faces: Any, parameters: Parameters) -> None:
    """Raise `MemoryLimitError` if the arrays ask for more than is free, unless checks are off."""
    if not parameters.memory_check:
        return
    needed = estimated_memory(_length(points), _length(faces), parameters)
    free = available_memory()
    if free is not None and needed > free:
        raise MemoryLimitError(
            f"points: {_length(points)} points and {_length(faces)} faces need about "
            f"{needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are free; thin the input "
            "first, close other programs, or set memory_check=False"
        )


def _length(values: Any) -> int:
    """Return the number of rows; 0 for what has none, which is refused later."""
    try:
        return len(values)
    except TypeError:
        return 0
