# SPDX-License-Identifier: GPL-3.0-or-later
"""The plots of `benchmarks.paper.tables`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.peers.plots import finish

LINES = {"paper": "--", "default": "-"}


def dots(axes: Axes, points: np.ndarray, title: str, colors: Any = None) -> Any:
    """Draw points as seen from the front; the far half is left out."""
    axes.set(title=title, aspect="equal")
    axes.axis("off")
    order = np.argsort(points[:, 2])
    x, y, _ = points[order].T
    if colors is None:
        return axes.scatter(x, y, s=2.5, color="#27408b", lw=0)
    return axes.scatter(x, y, s=2.5, c=colors[order], cmap="turbo", lw=0, vmin=0, vmax=1)


def front(study: Any) -> np.ndarray:
    """Return which points are turned to the viewer, by the default normals with signs made up."""
    points = study.points
    normals = study.analysis("default", 9, 0).normals
    outward = np.einsum("nc,nc->n", normals, points - points.mean(axis=0))
    return normals[:, 2] * np.where(outward < 0, -1, 1) > 0


def picture(figure: Figure, path: Path) -> None:
    """Write a picture in few colours, which keeps it small."""
    from PIL import Image

    figure.get_layout_engine().set(h_pad=0.1)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    Image.open(path).convert("RGB").quantize(128, Image.Quantize.MAXCOVERAGE).save(
        path, optimize=True
    )


def chosen(axes: Axes, study: Any, kept: np.ndarray, seen: np.ndarray, title: str) -> None:
    """Draw those of the kept points that can be seen."""
    share = len(kept) / len(study.points)
    dots(axes, study.points[kept[seen[kept]]], f"{title}: {len(kept)} ({share:.0%})")


def figure_12(study: Any, presets: Sequence[str], alphas: Sequence[float], path: Path) -> None:
    """Draw saliency, as figure 6, and the points kept at each α, as figure 12."""
    seen = front(study)
    figure, axes = plt.subplots(2, 1 + len(alphas), figsize=(14, 8), layout="constrained")
    for row, preset in zip(axes, presets, strict=True):
        saliency = study.analysis(preset, 9, 0).saliency
        shown = dots(row[0], study.points[seen], f"preset {preset}: saliency", saliency[seen])
        figure.colorbar(shown, ax=row[0], shrink=0.6, location="left", label="SL")
        for side, alpha in zip(row[1:], alphas, strict=True):
            chosen(side, study, study.kept(preset, alpha), seen, f"α = {alpha}")
    picture(figure, path)


def figure_13(study: Any, presets: Sequence[str], path: Path) -> None:
    """Draw the points kept at α = 0 for four x."""
    seen = front(study)
    figure, axes = plt.subplots(2, 4, figsize=(14, 8), layout="constrained")
    for row, preset in zip(axes, presets, strict=True):
        for side, x in zip(row, (0, 5, 9, 13), strict=True):
            chosen(side, study, study.kept(preset, 0, x), seen, f"{preset}, x = {x}")
    picture(figure, path)


def figure_14(
    rates: dict[str, Any],
    alphas: Sequence[float],
    printed: dict[str, tuple[int, ...]],
    studies: dict[str, Any],
    path: Path,
) -> None:
    """Draw the rate over α for every x, with the printed points of table 1."""
    figure, axes = plt.subplots(
        1, len(rates), figsize=(6.5 * len(rates), 6), layout="constrained", squeeze=False
    )
    for side, (name, presets) in zip(axes[0], rates.items(), strict=True):
        for preset, by_x in presets.items():
            for i, (x, values) in enumerate(by_x.items()):
                side.plot(
                    alphas, values, LINES[preset], color=f"C{i}", label=f"{preset}, x = {x:g} %"
                )
        marks = [studies[name].rate(count) for count in printed[name]]
        side.plot((0, 30, 50), marks, "k*", ms=11, label="printed, x = 9 %")
        side.set(title=name, xlabel="threshold α, %", ylabel="rate: points that went, %")
        side.set_ylim(0, 100)
        side.grid(True, lw=0.3)
        side.legend(fontsize=8, ncols=2)
    finish(figure, path)


def figure_15(found: dict[tuple[str, str], list[dict[str, float]]], path: Path) -> None:
    """Draw counts, and how much of the set survives, over noise."""
    figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    colours = {name: f"C{i}" for i, name in enumerate(dict.fromkeys(name for name, _ in found))}
    for (name, preset), rows in found.items():
        look = {"color": colours[name], "ls": LINES[preset], "marker": "o", "ms": 4}
        noise = [row["noise"] for row in rows]
        label = f"{name}, preset {preset}"
        axes[0].plot(noise, [100 * row["chance"] for row in rows], label=label, **look)
        axes[1].plot(noise, [row["beyond"] for row in rows], label=label, **look)
    axes[0].set(ylabel="points kept at α = 0, %", ylim=(0, 100))
    axes[1].set(ylabel="clean set kept beyond chance (1: all, 0: as by chance)", ylim=(-0.1, 1.05))
    for side in axes:
        side.set(xlabel="noise (standard deviation), % of the diagonal")
        side.grid(True, lw=0.3)
        side.legend(fontsize=8)
    finish(figure, path)
