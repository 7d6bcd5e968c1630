# SPDX-License-Identifier: GPL-3.0-or-later
"""What peers.json says, in the few lines that the README and docs/evidence.md show.

Tables are of the mean over the models at 10 and 2 %. `docs/tables.py` writes them into the pages.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from benchmarks.common.page import table
from benchmarks.peers.shares import (
    MESH_FIGURES,
    MOVED_MESHES,
    POINTS,
    SUBSET_MESHES,
    Blocks,
    against,
    geometric_mean,
    ratio_to,
)  # fmt: skip

CLOUD_FIGURES = {
    "rms": ("rebuilt", "rms"),
    "at features": ("rebuilt", "feature"),
    "Δmax": ("cover", "max"),
    "Δavg": ("cover", "avg"),
}
EFFORTS = (
    ("original vertices, as cut", "ours, mesh, not refined"),
    ("original vertices, edges flipped (default)", "ours, mesh"),
    ("moved vertices, as cut", "ours, mesh, optimal placement, not refined"),
    ("moved vertices, fitted", "ours, mesh, optimal placement"),
    *((name, name) for name in (*SUBSET_MESHES, *MOVED_MESHES)),
)


class Side(NamedTuple):
    """One of our methods, the peers that it is compared with, and in which figures."""

    name: str
    ours: str
    peers: tuple[str, ...]
    figures: dict[str, tuple[str, str]]


KEPT = Side("original vertices; MeshLab, meshoptimizer", "ours, mesh", SUBSET_MESHES, MESH_FIGURES)
MOVED = Side(
    "moved vertices; MeshLab, fast-simplification, Blender",
    "ours, mesh, optimal placement",
    MOVED_MESHES,
    MESH_FIGURES,
)
CLOUD = Side("bare points; eight ways to choose points", "ours, cloud", POINTS, CLOUD_FIGURES)


def brief(share: float) -> str:
    """Return a share with two digits."""
    if share < 100:
        return f"{share:.2g}"
    step = 10 ** (math.floor(math.log10(share)) - 1)
    return f"{step * round(share / step):,}"


def shares(blocks: Blocks, side: Side, figure: tuple[str, str]) -> dict[tuple[str, float], float]:
    """Return a figure as a share of the best peer's, for each model and ratio that has both."""
    found = {key: against(rows, side.ours, side.peers, figure) for key, rows in blocks.items()}
    return {key: share for key, share in found.items() if not math.isnan(share)}


def of_best(blocks: Blocks, side: Side) -> str:
    """Return the table of our figures as shares of the best peer's for each."""
    rows = []
    for name, figure in side.figures.items():
        found = shares(blocks, side, figure)
        (model, ratio), worst = max(found.items(), key=lambda item: item[1])
        ahead = sum(share < 1 for share in found.values())
        where = f"{worst:.2f} ({model}, {ratio:.0%})"
        mean = f"{geometric_mean(list(found.values())):.2f}"
        rows.append([name, mean, where, f"{ahead} of {len(found)}"])
    return table(["", "mean", "worst", "ahead in"], rows)


def of_each(blocks: Blocks, side: Side) -> str:
    """Return the table of our figures as shares of each peer's: errors, time, memory."""
    columns = {**side.figures, "CPU time": ("", "cpu"), "memory": ("", "memory")}
    rows = []
    for peer in side.peers:
        cells = []
        for group, key in columns.values():
            each = (ratio_to(rows, side.ours, peer, group, key) for rows in blocks.values())
            found = [share for share in each if 0 < share < math.inf]
            cells.append(brief(geometric_mean(found)) if found else "")
        rows.append([peer, *cells])
    return table(["of", *columns], rows)


def in_short(blocks: Blocks) -> str:
    """Return the README's table: each side against the best peer, and the times."""
    rows = []
    for side in (KEPT, MOVED, CLOUD):
        cells = [""] * len(MESH_FIGURES)
        for place, figure in enumerate(MESH_FIGURES):
            if figure in side.figures:
                found = list(shares(blocks, side, side.figures[figure]).values())
                cells[place] = f"{geometric_mean(found):.2f}"
        times = []
        for peer in side.peers:
            each = (ratio_to(rows, side.ours, peer, "", "cpu") for rows in blocks.values())
            found = [share for share in each if 0 < share < math.inf]
            if found:
                times.append(geometric_mean(found))
        rows.append([side.name, *cells, f"{brief(min(times))} to {brief(max(times))}"])
    return table(["ours, of the best of", *MESH_FIGURES, "CPU time, of each"], rows)


def efforts(blocks: Blocks) -> str:
    """Return the table of what more time buys: errors and times as shares of our plainest cut's."""
    base = EFFORTS[0][1]
    columns = {**MESH_FIGURES, "CPU time": ("", "cpu")}
    rows = []
    for name, method in EFFORTS:
        cells = []
        for group, key in columns.values():
            each = (ratio_to(rows, method, base, group, key) for rows in blocks.values())
            found = [share for share in each if 0 < share < math.inf]
            cells.append(f"{geometric_mean(found):.2f}" if found else "")
        rows.append([name, *cells])
    return table(["of our plainest cut", *columns], rows)
