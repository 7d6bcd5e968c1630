# SPDX-License-Identifier: GPL-3.0-or-later
"""Our figures as shares of the peers', from the rows of peers.json."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

Row = dict[str, Any]
Blocks = dict[tuple[str, float], list[Row]]
"""The rows of each model and ratio."""

SUBSET_MESHES = ("MeshLab QEM, original vertices", "meshoptimizer")
MOVED_MESHES = ("MeshLab QEM, optimal placement", "fast-simplification", "Blender Decimate")
POINTS = (
    "random",
    "voxel grid",
    "farthest point",
    "Poisson disk",
    "hierarchy",
    "k-means with normals",
    "curvature-weighted clusters",
    "grid with normals",
)
EVEN = ("voxel grid", "farthest point", "Poisson disk")
MESH_FIGURES = {
    "rms": ("mesh", "rms"),
    "at features": ("mesh", "feature"),
    "largest, both ways": ("mesh", "both"),
    "smooth normals": ("mesh", "normal"),
}
RATIOS = (0.1, 0.02)  # of the tables; further ones are for the plot


def blocks_of(rows: list[Row]) -> Blocks:
    """Return the rows of each model and ratio of the tables."""
    blocks: Blocks = {}
    for row in rows:
        if row.get("ratio") in RATIOS:
            blocks.setdefault((row["model"], row["ratio"]), []).append(row)
    return blocks


def read(figures: Path) -> dict[str, Any]:
    """Return what peers.json holds: the build and the rows."""
    return json.loads((figures / "peers.json").read_text(encoding="utf-8"))


def fair(row: Row) -> bool:
    """Return whether a row has about the count that was asked for."""
    return "points" in row and abs(row["points"] - row["asked"]) <= 0.02 * row["asked"]


def best_of(rows: list[Row], group: str, key: str) -> float:
    """Return the least figure of a column."""
    found = [row[group][key] for row in rows if fair(row) and key in row.get(group, {})]
    return min(found, default=math.nan)


def against(rows: list[Row], ours: str, peers: tuple[str, ...], column: tuple[str, str]) -> float:
    """Return our figure as a share of the best peer's; nan where there is none."""
    group, key = column
    mine = best_of([row for row in rows if row["method"] == ours], group, key)
    return mine / best_of([row for row in rows if row["method"] in peers], group, key)


def by_column(table: list[list[float]]) -> list[list[float]]:
    """Return a table's columns without what is missing."""
    return [
        [value for value in column if not math.isnan(value)] for column in zip(*table, strict=True)
    ]


def geometric_mean(shares: Sequence[float]) -> float:
    """Return the geometric mean; nan of nothing."""
    return math.exp(sum(map(math.log, shares)) / len(shares)) if shares else math.nan


def ratio_to(rows: list[Row], ours: str, peer: str, group: str, key: str) -> float:
    """Return our figure as a share of one peer's; nan where either is missing or not fair."""
    found = {row["method"]: row for row in rows if fair(row)}
    if ours not in found or peer not in found:
        return math.nan
    pair = [found[name] if not group else found[name].get(group, {}) for name in (ours, peer)]
    mine, theirs = (side.get(key, math.nan) for side in pair)
    return mine / theirs if theirs else math.nan
