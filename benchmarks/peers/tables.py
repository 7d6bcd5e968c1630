# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of peers.md, from peers.json, and the plots beside them."""

from __future__ import annotations

import math
from pathlib import Path

from benchmarks.common.build import said
from benchmarks.peers import plots
from benchmarks.peers.registry import METHODS
from benchmarks.peers.shares import (
    EVEN,
    MESH_FIGURES,
    MOVED_MESHES,
    POINTS,
    SUBSET_MESHES,
    Blocks,
    Row,
    against,
    best_of,
    blocks_of,
    by_column,
    fair,
    geometric_mean,
    ratio_to,
    read,
)  # fmt: skip

COLUMNS = (
    ("mesh", "rms"),
    ("mesh", "both"),
    ("mesh", "feature"),
    ("mesh", "normal"),
    ("rebuilt", "rms"),
    ("rebuilt", "max"),
    ("rebuilt", "feature"),
    ("cover", "max"),
    ("cover", "avg"),
)
DUELS = (  # title, ours, and for each column its peers and figure
    (
        "Meshes of original vertices, against MeshLab and meshoptimizer",
        "ours, mesh",
        {name: (SUBSET_MESHES, figure) for name, figure in MESH_FIGURES.items()},
    ),
    (
        "Meshes of moved vertices, against MeshLab, fast-simplification and Blender",
        "ours, mesh, optimal placement",
        {name: (MOVED_MESHES, figure) for name, figure in MESH_FIGURES.items()},
    ),
    (
        "Clouds, against all point methods, and against voxel grid, farthest points and Poisson "
        "disk alone (even)",
        "ours, cloud",
        {
            "rms": (POINTS, ("rebuilt", "rms")),
            "at features": (POINTS, ("rebuilt", "feature")),
            "Δmax": (POINTS, ("cover", "max")),
            "Δavg": (POINTS, ("cover", "avg")),
            "rms, even": (EVEN, ("rebuilt", "rms")),
            "at features, even": (EVEN, ("rebuilt", "feature")),
        },
    ),
)
HEAD = """# All methods at equal count

`python -m benchmarks.peers.compare --models FOLDER --blender PYTHON` writes this page, `peers.json`
and the plots; docs/evidence.md says what they mean. Lengths are per cent of the diagonal of the
bounding box, distances from the original to the result:

- **mesh**: from 200 000 samples of the original surface to the mesh that the method returned;
  **both**: the largest from samples of either surface to the other; **normals**: rms angle in
  degrees between smooth normals (of vertices by the angles of faces, interpolated inside faces) at
  the samples and at the nearest places of the mesh;
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


def line(row: Row, best: dict[tuple[str, str], float]) -> str:
    """Return a method's row of the table."""
    for reason in ("left out", "missing", "unreachable"):
        if reason in row:
            return f"| {row['method']} | _{reason}: {row[reason]}_ |" + " |" * 12
    cells = [row["method"]]
    cells.append(f"{row['points']}" if fair(row) else f"_{row['points']}_")
    cells += [f"{row['seconds']:.3g}", f"{row['cpu']:.3g}", f"{row['memory'] / 2**20:.0f}"]
    for group, key in COLUMNS:
        if key not in row.get(group, {}):
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
        "| method | points | s | CPU s | MB | mesh rms | both | feature | normals "
        "| rebuilt rms | max | feature | Δmax | Δavg |",
        "|---|" + "---:|" * 13,
    ]
    return "\n".join(lines + [line(row, best) for row in rows])


def duels(blocks: Blocks) -> str:
    """Return the tables of our figures as shares of the best peer's."""
    parts = [
        "## Ours as a share of the best peer's",
        "Below 1 ours is better. Each figure is set against the best peer *for that figure*, so "
        "one row may name several winners.",
    ]
    return "\n\n".join(parts + [duel(blocks, *each) for each in DUELS])


def duel(
    blocks: Blocks,
    title: str,
    ours: str,
    columns: dict[str, tuple[tuple[str, ...], tuple[str, str]]],
) -> str:
    """Return one of these tables, and the means of its columns."""
    lines = [f"**{title}**", "", "| model | kept | " + " | ".join(columns) + " |"]
    lines.append("|---|---:|" + "---:|" * len(columns))
    shares = []
    for (model, ratio), rows in blocks.items():
        values = [against(rows, ours, *column) for column in columns.values()]
        if not all(map(math.isnan, values)):
            has_faces = any("mesh" in row for row in rows)
            shares.append((has_faces, values))
            cells = ["" if math.isnan(value) else f"{value:.2f}" for value in values]
            lines.append(f"| {model} | {ratio:.0%} | " + " | ".join(cells) + " |")
    return "\n".join(lines + means(shares))


def means(shares: list[tuple[bool, list[float]]]) -> list[str]:
    """Return the rows below a table of shares: means, the worst, and how often ours is ahead."""
    columns = by_column([values for _, values in shares])
    rows = {"geometric mean": [f"{geometric_mean(column):.2f}" for column in columns]}
    if not all(has_faces for has_faces, _ in shares):
        of_meshes = by_column([values for has_faces, values in shares if has_faces])
        rows["of the meshes' points"] = [f"{geometric_mean(column):.2f}" for column in of_meshes]
    rows["worst"] = [f"{max(column, default=math.nan):.2f}" for column in columns]
    rows["ahead"] = [f"{sum(share < 1 for share in each)} of {len(each)}" for each in columns]
    return [f"| **{name}** | | " + " | ".join(cells) + " |" for name, cells in rows.items()]


def each_peer(blocks: Blocks) -> str:
    """Return the table of our figures as shares of each peer's, over all models and ratios."""
    lines = [
        "## Ours as a share of each peer's",
        "",
        "Geometric means over the models and ratios where both met the count (*cases*), and the "
        "worst single figure. Surfaces: of meshes the mesh, of points the rebuilt surface. *Not "
        "refined* is our own cut before edges are flipped and places fitted.",
        "",
        "| ours | peer | cases | rms | worst | at features | worst | both ways | normals | Δmax "
        "| Δavg | CPU time | memory |",
        "|---|---|" + "---:|" * 11,
    ]
    sides = (
        ("ours, mesh", (*SUBSET_MESHES, "ours, mesh, not refined"), "mesh"),
        (
            "ours, mesh, optimal placement",
            (*MOVED_MESHES, "ours, mesh, optimal placement, not refined", "ours, mesh"),
            "mesh",
        ),
        ("ours, cloud", (*POINTS, "MeshLab QEM, original vertices"), "rebuilt"),
    )
    for ours, peers, surface in sides:
        for peer in peers:
            cells = []
            for group, key, worst in (
                (surface, "rms", True),
                (surface, "feature", True),
                (surface, "both", False),
                (surface, "normal", False),
                ("cover", "max", False),
                ("cover", "avg", False),
                ("", "cpu", False),
                ("", "memory", False),
            ):
                found = [ratio_to(rows, ours, peer, group, key) for rows in blocks.values()]
                found = [share for share in found if 0 < share < math.inf]
                cells += [] if cells else [f"{len(found)}"]
                cells += summary(found, worst)
            lines.append(f"| {ours} | {peer} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def summary(shares: list[float], worst: bool) -> list[str]:
    """Return the geometric mean of shares, and the largest if asked for."""
    if not shares:
        return [""] * (1 + worst)
    return [f"{geometric_mean(shares):.3g}", f"{max(shares):.2f}"][: 1 + worst]


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
    data = read(figures)
    rows = data["rows"]
    blocks = blocks_of(rows)
    order = list(METHODS)
    for block in blocks.values():
        block.sort(key=lambda row: order.index(row["method"]))
    versions = {
        f"{METHODS[row['method']].package} {row['version']}" for row in rows if "version" in row
    }
    with_versions = ", ".join(sorted(versions))
    absent = sorted({f"{row['method']} ({row['missing']})" for row in rows if "missing" in row})
    parts = [HEAD, f"{said(data['build'])} Versions: {with_versions}."]
    older = sorted({row["model"] for row in rows if row["core"] != data["build"]["core"]})
    if older:
        parts.append("Rows of another core: " + ", ".join(older) + ".")
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
