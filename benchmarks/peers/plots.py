# SPDX-License-Identifier: GPL-3.0-or-later
"""The plots of peers.json: error against count, error against time, time against size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

mpl.use("Agg")
mpl.rcParams |= {"svg.fonttype": "none", "svg.hashsalt": "salient", "font.size": 10}

Row = dict[str, Any]

OURS = "#d62728"
MORE_TIME = (
    ("ours, mesh, not refined", "ours, mesh"),
    ("ours, mesh, not refined", "ours, mesh, optimal placement, not refined"),
    ("ours, mesh, optimal placement, not refined", "ours, mesh, optimal placement"),
)
MARKS = "osD^v<>phX"


def style(methods: list[str]) -> dict[str, dict[str, Any]]:
    """Return a colour and a mark for each method; ours are red and thick in every plot."""
    colours = plt.get_cmap("tab10")
    others = [colours(i) for i in (0, 1, 2, 4, 5, 6, 7, 8, 9)]
    result, mine, theirs = {}, 0, 0
    for method in methods:
        if method.startswith("ours"):
            result[method] = {"color": OURS, "marker": "*odsv^"[mine % 6], "lw": 2.2, "ms": 8}
            mine += 1
        else:
            result[method] = {
                "color": others[theirs % len(others)],
                "marker": MARKS[theirs % len(MARKS)],
                "lw": 1.2,
                "ms": 5,
            }
            theirs += 1
    return result


def axis(axes: Axes, title: str, x: str, y: str) -> None:
    """Give an axis its title, units and scale."""
    axes.set(xscale="log", yscale="log", title=title, xlabel=x, ylabel=y)
    axes.grid(True, which="both", lw=0.3, alpha=0.6)


def finish(figure: Figure, path: Path) -> None:
    """Write a figure; without a date, so that the same figures give the same file."""
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def curves(axes: Axes, rows: list[Row], column: tuple[str, str]) -> None:
    """Draw a figure of every method over the count."""
    group, key = column
    rows = [row for row in rows if group in row]
    methods = list(dict.fromkeys(row["method"] for row in rows))
    for method, look in style(methods).items():
        mine = sorted((r["points"], r[group][key]) for r in rows if r["method"] == method)
        axes.plot(*zip(*mine, strict=True), label=method, **look)


def error_against_count(rows: list[Row], figures: Path) -> None:
    """Draw one model's errors over the count: returned meshes, and rebuilt surfaces."""
    if not rows:
        return
    rows = [row for row in rows if not row["method"].startswith("ours, threshold")]
    rows = [row for row in rows if not row["method"].endswith("not refined")]
    point = [row for row in rows if "mesh" not in row]
    figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained", sharex=True)
    kinds = (("rms", "rms error"), ("feature", "rms error at features"))
    for row, (key, name) in enumerate(kinds):
        curves(axes[row, 0], rows, ("mesh", key))
        curves(axes[row, 1], point, ("rebuilt", key))
        axis(
            axes[row, 0],
            f"{rows[0]['model']}: the mesh returned",
            "points kept",
            f"{name}, % of diagonal",
        )
        axis(
            axes[row, 1],
            f"{rows[0]['model']}: rebuilt from the points",
            "points kept",
            f"{name}, % of diagonal",
        )
    for side in axes[0]:
        side.legend(fontsize=8)
    finish(figure, figures / "error_against_count.svg")


def error_against_time(rows: list[Row], figures: Path, ratio: float = 0.1) -> None:
    """Draw the error of every method over its time, on four models.

    Lines lead from our cuts to what more time makes of them.
    """
    rows = [row for row in rows if row.get("ratio") == ratio and "seconds" in row]
    models = ("bun_zipper", "fandisk", "lion_takanawa_341989", "dragon_vrip")
    looks = style(list(dict.fromkeys(row["method"] for row in rows)))
    figure, axes = plt.subplots(2, 2, figsize=(12, 9.5), layout="constrained")
    for model, side in zip(models, axes.flat, strict=True):
        for row in (row for row in rows if row["model"] == model):
            group = "mesh" if "mesh" in row else "rebuilt"
            look = dict(looks[row["method"]], ls="")
            hollow = {} if group == "mesh" else {"mfc": "none"}
            side.plot(
                max(row["cpu"], 1e-3), row[group]["rms"], label=row["method"], **look, **hollow
            )
        for before, after in MORE_TIME:
            ends = [
                r for m in (before, after) for r in rows if (r["model"], r["method"]) == (model, m)
            ]
            places = [(row["cpu"], row["mesh"]["rms"]) for row in ends]
            if len(places) == 2:
                side.plot(*zip(*places, strict=True), color=OURS, lw=1.2, zorder=0)
        axis(
            side,
            f"{model}, {ratio:.0%} kept",
            "CPU time, s (0.001 or less at the left)",
            "rms error, % of diagonal",
        )
    entries = {}
    for side in axes.flat:
        handles, labels = side.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    figure.legend(
        entries.values(),
        entries.keys(),
        loc="outside lower center",
        ncols=4,
        fontsize=9,
        title="filled: the mesh returned; hollow: surface rebuilt from points",
    )
    finish(figure, figures / "error_against_time.svg")


def time_against_points(rows: list[Row], figures: Path) -> None:
    """Draw time and memory over the number of points."""
    rows = [row for row in rows if "seconds" in row]
    if not rows:
        return
    figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    for method, look in style(list(dict.fromkeys(row["method"] for row in rows))).items():
        mine = sorted((r for r in rows if r["method"] == method), key=lambda r: r["of"])
        sizes = [row["of"] for row in mine]
        axes[0].plot(sizes, [max(row["cpu"], 1e-4) for row in mine], label=method, **look)
        axes[1].plot(sizes, [row["memory"] / 2**20 for row in mine], label=method, **look)
    title = "airborne LiDAR, a tenth kept"
    axis(axes[0], title, "points of the cloud", "CPU time, s")
    axis(axes[1], title, "points of the cloud", "growth of peak memory, MB")
    axes[0].legend(fontsize=8)
    finish(figure, figures / "time_against_points.svg")
