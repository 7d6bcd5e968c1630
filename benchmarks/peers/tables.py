# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of peers.md, from peers.json, and the plots beside them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from benchmarks.peers import plots
from benchmarks.peers.registry import METHODS

Row = dict[str, Any]

COLUMNS = (
    ("mesh", "rms"),
    ("mesh", "max"),
    ("mesh", "feature"),
    ("rebuilt", "rms"),
    ("rebuilt", "max"),
    ("rebuilt", "feature"),
    ("cover", "max"),
    ("cover", "avg"),
)
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
DUELS = (
    ("mesh rms", "ours, mesh", SUBSET_MESHES, ("mesh", "rms")),
    ("mesh at features", "ours, mesh", SUBSET_MESHES, ("mesh", "feature")),
    ("optimal rms", "ours, mesh, optimal placement", MOVED_MESHES, ("mesh", "rms")),
    ("optimal at features", "ours, mesh, optimal placement", MOVED_MESHES, ("mesh", "feature")),
    ("cloud rms", "ours, cloud", POINTS, ("rebuilt", "rms")),
    ("cloud at features", "ours, cloud", POINTS, ("rebuilt", "feature")),
    ("cloud Δmax", "ours, cloud", POINTS, ("cover", "max")),
    ("cloud Δavg", "ours, cloud", POINTS, ("cover", "avg")),
)
RATIOS = (0.1, 0.02)  # of the tables; further ones are for the plot

HEAD = """# All methods at equal count

`python -m benchmarks.peers.compare --models FOLDER --blender PYTHON` writes this page, `peers.json`
and the plots; docs/evidence.md says what they mean. Lengths are per cent of the diagonal of the
bounding box, distances from the original to the result:

- **mesh**: from 200 000 samples of the original surface to the mesh that the method returned;
- **rebuilt**: to the surface that a neutral tool makes of the kept points: on a mesh the dual of
  their geodesic cells, on a cloud CGAL's advancing front (from all points);
- **feature**: rms over the tenth of the original points where the surface bends most;
- **Δmax, Δavg**: (5.1) and (5.2), from every original point to the nearest kept one.

Time is of one call, with the data already in the library's own form and, where a count is only
reached by trying, with the right value known: of the wall, and of all processors (CPU), which other
work on the machine disturbs less. Memory is the growth of the peak over the loaded arrays, in a
fresh process, conversion included. Methods that use normals get them for nothing. The best of each
column is **bold**; a count more than 2 % from the asked one is _slanted_ and does not compete.
"""


def number(value: float) -> str:
    """Return a length with three digits."""
    return f"{value:.3g}" if value >= 0.1 or value == 0 else f"{value:.4f}"


def fair(row: Row) -> bool:
    """Return whether a row has about the count that was asked for."""
    return "points" in row and abs(row["points"] - row["asked"]) <= 0.02 * row["asked"]


def best_of(rows: list[Row], group: str, key: str) -> float:
    """Return the least figure of a column."""
    found = [row[group][key] for row in rows if fair(row) and group in row]
    return min(found, default=math.nan)


def line(row: Row, best: dict[tuple[str, str], float]) -> str:
    """Return a method's row of the table."""
    for reason in ("left out", "missing", "unreachable"):
        if reason in row:
            return f"| {row['method']} | _{reason}: {row[reason]}_ |" + " |" * 11
    cells = [row["method"]]
    cells.append(f"{row['points']}" if fair(row) else f"_{row['points']}_")
    cells += [f"{row['seconds']:.3g}", f"{row['cpu']:.3g}", f"{row['memory'] / 2**20:.0f}"]
    for group, key in COLUMNS:
        if group not in row:
            cells.append("")
            continue
        text = number(row[group][key])
        cells.append(f"**{text}**" if fair(row) and row[group][key] == best[group, key] else text)
    return "| " + " | ".join(cells) + " |"


def table(rows: list[Row]) -> str:
    """Return one model's methods at one ratio as a table."""
    first = rows[0]
    best = {column: best_of(rows, *column) for column in COLUMNS}
    lines = [
        f"## {first['model']}: {first['asked']} of {first['of']} points",
        "",
        "| method | points | s | CPU s | MB | mesh rms | max | feature "
        "| rebuilt rms | max | feature | Δmax | Δavg |",
        "|---|" + "---:|" * 12,
    ]
    return "\n".join(lines + [line(row, best) for row in rows])


def against(rows: list[Row], ours: str, peers: tuple[str, ...], column: tuple[str, str]) -> float:
    """Return our figure as a share of the best peer's; nan where there is none."""
    group, key = column
    mine = [row[group][key] for row in rows if row["method"] == ours and group in row]
    theirs = best_of([row for row in rows if row["method"] in peers], group, key)
    return mine[0] / theirs if mine else math.nan


def duels(blocks: dict[tuple[str, float], list[Row]]) -> str:
    """Return the table of our figures as shares of the best peer's."""
    shares = {
        block: [against(rows, ours, peers, column) for _, ours, peers, column in DUELS]
        for block, rows in blocks.items()
    }
    lines = [
        "## Ours as a share of the best peer's",
        "",
        "Below 1 ours is better. Each figure is set against the best peer *for that figure*, so "
        "one row may name several winners. `mesh`: against MeshLab with original vertices and "
        "meshoptimizer; `optimal`: against MeshLab, fast-simplification and Blender; `cloud`: "
        "against all point methods.",
        "",
        "| model | kept | " + " | ".join(name for name, *_ in DUELS) + " |",
        "|---|---:|" + "---:|" * len(DUELS),
    ]
    for (model, ratio), values in shares.items():
        cells = ["" if math.isnan(v) else f"{v:.2f}" for v in values]
        lines.append(f"| {model} | {ratio:.0%} | " + " | ".join(cells) + " |")
    means = []
    for column in zip(*shares.values(), strict=True):
        logs = [math.log(value) for value in column if not math.isnan(value)]
        means.append(f"**{math.exp(sum(logs) / len(logs)):.2f}**" if logs else "")
    lines.append("| **geometric mean** | | " + " | ".join(means) + " |")
    return "\n".join(lines)


def ratio_to(rows: list[Row], ours: str, peer: str, group: str, key: str) -> float:
    """Return our figure as a share of one peer's; nan where either is missing or not fair."""
    found = {row["method"]: row for row in rows if fair(row)}
    if ours not in found or peer not in found:
        return math.nan
    pair = [found[name] if not group else found[name].get(group, {}) for name in (ours, peer)]
    mine, theirs = (side.get(key, math.nan) for side in pair)
    return mine / theirs if theirs else math.nan


def each_peer(blocks: dict[tuple[str, float], list[Row]]) -> str:
    """Return the table of our figures as shares of each peer's, over all models and ratios."""
    lines = [
        "## Ours as a share of each peer's",
        "",
        "Geometric means over the models and ratios where both met the count, and the worst single "
        "figure. Surfaces: of meshes the mesh, of points the rebuilt surface.",
        "",
        "| ours | peer | rms | worst | at features | worst | Δavg | CPU time | memory |",
        "|---|---|" + "---:|" * 7,
    ]
    sides = (
        ("ours, mesh", SUBSET_MESHES, "mesh"),
        ("ours, mesh, optimal placement", MOVED_MESHES, "mesh"),
        ("ours, cloud", POINTS, "rebuilt"),
    )
    for ours, peers, surface in sides:
        for peer in peers:
            cells = []
            for group, key, worst in (
                (surface, "rms", True),
                (surface, "feature", True),
                ("cover", "avg", False),
                ("", "cpu", False),
                ("", "memory", False),
            ):
                found = [ratio_to(rows, ours, peer, group, key) for rows in blocks.values()]
                cells += summary([x for x in found if 0 < x < math.inf], worst)
            lines.append(f"| {ours} | {peer} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def summary(shares: list[float], worst: bool) -> list[str]:
    """Return the geometric mean of shares, and the largest if asked for."""
    if not shares:
        return [""] * (1 + worst)
    mean = math.exp(sum(map(math.log, shares)) / len(shares))
    return [f"{mean:.3g}", f"{max(shares):.2f}"][: 1 + worst]


def series_table(rows: list[Row]) -> str:
    """Return times and memory over sizes as a table."""
    sizes = sorted({row["of"] for row in rows})
    by_place = {(row["method"], row["of"]): row for row in rows}
    lines = [
        "## Time and memory over size: airborne LiDAR, a tenth kept",
        "",
        "CPU seconds (and MB) at so many points.",
        "",
        "| method | " + " | ".join(f"{size:,}" for size in sizes) + " |",
        "|---|" + "---:|" * len(sizes),
    ]
    for method in dict.fromkeys(row["method"] for row in rows):
        cells = []
        for size in sizes:
            row = by_place.get((method, size), {})
            if "seconds" in row:
                cells.append(f"{row['cpu']:.3g} ({row['memory'] / 2**20:.0f})")
            else:
                cells.append("left out: " + row["left out"] if "left out" in row else "")
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def write(figures: Path) -> None:
    """Write the page and the plots."""
    data = json.loads((figures / "peers.json").read_text())
    rows = data["rows"]
    blocks: dict[tuple[str, float], list[Row]] = {}
    for row in rows:
        if row.get("ratio") in RATIOS:
            blocks.setdefault((row["model"], row["ratio"]), []).append(row)
    versions = {METHODS[row["method"]].package: row["version"] for row in rows if "version" in row}
    with_versions = ", ".join(f"{name} {version}" for name, version in sorted(versions.items()))
    absent = sorted({f"{row['method']} ({row['missing']})" for row in rows if "missing" in row})
    parts = [HEAD, f"Machine: {data['machine']}. Versions: {with_versions}."]
    if absent:
        parts.append("Missing: " + "; ".join(absent) + ".")
    parts += [duels(blocks), each_peer(blocks)]
    parts += [table(block) for block in blocks.values()]
    over_size = [row for row in rows if row["model"] == "series"]
    if over_size:
        parts.append(series_table(over_size))
    (figures / "peers.md").write_text("\n\n".join(parts) + "\n")
    plots.error_against_count([row for row in rows if row["model"] == "bun_zipper"], figures)
    plots.error_against_time(rows, figures)
    plots.time_against_points(over_size, figures)
