# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory an input takes, and whether the machine has as much."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path
from typing import Any

from ..errors import MemoryLimitError
from ..parameters import TARGETS, Parameters, checked

# Bytes, fitted to measured peaks of the analysis and of the elimination, of which one is larger.
ANALYSIS = {"point": 140, "face": 185, "nearest": 12, "edge": 40, "cell": 1900}
"""Of a point, of a face, of a nearest point of a cloud among which its star is sought, of a
neighbour in the graph, and of a point of a 3D triangulation."""
ELIMINATION = {"point": 280, "triangle": 280, "face": 100, "nearest": 6, "edge": 16}
"""Of a point, of a triangle (two a point on a cloud), of a given face, and what the analysis holds
of nearest points and of neighbours."""


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
        If a count is not a whole number of at least 0.

    Notes
    -----
    The larger of two sums. Analysis: 140 bytes a point, 185 a face, 12 a point for each of
    `Parameters.neighbors` on a cloud, 40 for each neighbour in the graph, of which a point has
    about 4 k (k + 1) - 2 at level k; with ``graph="delaunay"`` 1900 more a point and 2.4 times as
    many neighbours. Elimination: 280 bytes a point and 280 a triangle, of which a cloud has two a
    point, 100 a face, 6 a nearest point and 16 a neighbour. Within a third of what was measured
    on scans; then measuring the errors for a report takes up to a quarter more on a mesh.

    Examples
    --------
    >>> import salcore
    >>> salcore.estimated_memory(1_000_000) // 10**6
    1032
    """
    parameters = checked(parameters)
    points, faces = (_count(value, name) for value, name in ((points, "points"), (faces, "faces")))
    rings = parameters.level
    edges = 4 * rings * (rings + 1) - 2
    nearest = 0 if faces else parameters.neighbors
    analysis = points * (ANALYSIS["point"] + ANALYSIS["nearest"] * nearest)
    analysis += faces * ANALYSIS["face"]
    if parameters.graph == "delaunay":
        analysis += points * ANALYSIS["cell"]
        edges = int(2.4 * edges)
    analysis += points * ANALYSIS["edge"] * edges
    elimination = points * (ELIMINATION["point"] + ELIMINATION["nearest"] * nearest)
    elimination += points * ELIMINATION["edge"] * edges
    elimination += ELIMINATION["triangle"] * max(faces, 2 * points) + ELIMINATION["face"] * faces
    return max(analysis, elimination)


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
