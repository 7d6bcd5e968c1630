# SPDX-License-Identifier: GPL-3.0-or-later
"""Write docs/parameters.md: every parameter, with its effect in a picture at three values.

    python -m docs.parameter_pictures [NAME ...]

The model is the stone tablet of docs/pictures.py. As it is a grid, its maps are drawn as images.
Without names all pictures are drawn, in about two minutes.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter

import salcore
from docs.pictures import FOLDER, save_small, tablet

COLUMNS, ROWS = 220, 110
PICTURES = FOLDER / "parameters"
PAGE = Path(__file__).parent / "parameters.md"

VALUES: dict[str, tuple[Any, ...]] = {
    "ratio": (0.2, 0.05, 0.01),
    "count": (5000, 1000, 200),
    "max_error": (0.0005, 0.002, 0.01),
    "alpha": (0.0, 20.0, 60.0),
    "graph": ("surface", "delaunay"),
    "neighbors": (6, 16, 48),
    "level": (1, 2, 4),
    "normals": ("best", "pca"),
    "cells": (1, 8, 32),
    "angle": ("oriented", "unoriented", "squared"),
    "whole_percent": (False, True),
    "deviation_threshold": (2.0, 9.0, 30.0),
    "counting": ("ramp", "step"),
    "dissimilarity": ("share", "entropy"),
    "contrast": ("level", "difference"),
    "averaging": ("weighted", "plain"),
    "scaling": ("percentile", "range"),
    "coarsest": (0.0, 1.0, 4.0),
    "finest": (0.05, 0.25, 1.0),
    "segmentation": ("islands", "basins", "components"),
    "region_contrast": (0.1, 0.25, 0.6),
    "region_size": (0.3, 1.0, 4.0),
    "persistence": (0.05, 0.17, 0.4),
    "tolerance": (0.02, 0.08, 0.3),
    "collinear_angle": (10.0, 60.0, 180.0),
    "alpha_rule": ("add", "multiply"),
    "max_gap": (0, 1, 4),
    "detail": (0.0, 3.0, 30.0),
    "interest_weight": (0.0, 1.0, 10.0),
    "regions_of_interest": (0, 1, 8),
    "interest_density": (1.0, 4.0, 16.0),
    "keep_regions": (False, True),
    "evenness": (0.0, 0.3, 3.0),
    "border_weight": (0.0, 1.0, 100.0),
    "placement": ("original", "optimal"),
}
"""What is shown of each parameter; the others change no map."""
AS_CLOUD = {"graph", "neighbors", "normals", "evenness"}
"""Parameters that matter where there are no faces."""
ALONGSIDE: dict[str, dict[str, Any]] = {
    "cells": {"coarsest": 0.0},
    "persistence": {"segmentation": "basins"},
    "tolerance": {"segmentation": "components", "coarsest": 0.0},
    "interest_density": {"regions_of_interest": 1},
}
"""What else is set where a parameter would not show."""
MAPS = {"Graph": "saliency", "Normals": "saliency", "Saliency": "saliency", "Regions": "regions"}
"""What a group's parameters are seen in; the others in the kept points."""


def shade(points: np.ndarray) -> np.ndarray:
    """Return the tablet's light and dark (rows, columns) in [0, 1]."""
    z = points[:, 2].reshape(ROWS, COLUMNS)
    slope = np.gradient(gaussian_filter(z, 0.5))
    return np.clip(0.72 + 9.0 * (slope[0] - slope[1]), 0.15, 1.0)


def image(light: np.ndarray, colors: np.ndarray | None) -> np.ndarray:
    """Return the tablet as an image, coloured or grey, its upper edge on top."""
    base = np.full((ROWS, COLUMNS, 3), 0.8) if colors is None else colors.reshape(ROWS, COLUMNS, 3)
    return np.clip(base * (0.35 + 0.75 * light[..., None]), 0.0, 1.0)


def panel(row: salcore.Parameter, value: Any, axis: Any) -> None:
    """Draw the effect of one value."""
    points, faces = tablet(COLUMNS, ROWS)
    target: dict[str, Any] = {"ratio": 0.05}
    parameters = salcore.Parameters()
    if row.group == "Target":
        target = {row.name: value}
    else:
        parameters = replace(parameters, **ALONGSIDE.get(row.name, {}), **{row.name: value})
    if row.group == "Interest points":
        target = {"alpha": 20.0}
    analysis = salcore.analyze(
        points, None if row.name in AS_CLOUD else faces, parameters=parameters
    )
    light, kind = shade(points), MAPS.get(row.group, "kept")
    title = f"{row.name} = {value}"
    if kind == "saliency":
        axis.imshow(image(light, salcore.saliency_colors(analysis.saliency)), origin="lower")
    elif kind == "regions":
        axis.imshow(image(light, salcore.region_colors(analysis.regions)), origin="lower")
        title += f": {analysis.segmentation.count:,} regions"
    else:
        result = analysis.simplify(**target)
        axis.imshow(image(light, None), origin="lower")
        places = points if result.positions is None else result.positions
        if result.positions is None:
            places = points[result.indices]
        x, y = places[:, 0] * (COLUMNS - 1) / 2.0, places[:, 1] * (ROWS - 1)
        axis.scatter(x, y, s=1.6, c="#b01818", linewidths=0)
        title += f": {len(result.indices):,} points"
    axis.set_title(title, fontsize=9)


def picture(row: salcore.Parameter) -> None:
    """Draw one parameter at its values."""
    values = VALUES[row.name]
    figure = Figure(figsize=(4.1 * len(values), 2.35), dpi=110)
    for axis, value in zip(figure.subplots(1, len(values)), values, strict=True):
        panel(row, value, axis)
        axis.axis("off")
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.89, wspace=0.02)
    save_small(figure, PICTURES / f"{row.name}.png")


def section(row: salcore.Parameter) -> str:
    """Return what the page says about one parameter."""
    words = [f"### `{row.name}`: {row.label}", "", row.sentence]
    bounds = ", ".join(row.choices)
    if row.type in (int, float):
        bounds = f"{row.minimum:g} to {row.maximum:g} {row.unit}".rstrip()
    elif row.type is bool:
        bounds = "on or off"
    facts = [f"Values: {bounds}"]
    if row.group != "Target":
        facts.append(f"default: {row.default}, preset paper: {row.paper}")
    if row.symbol:
        facts.append(f"in the paper: {row.symbol}")
    words += ["", "; ".join(facts) + "."]
    if row.name in VALUES:
        words += ["", f"![{row.name} at several values](pictures/parameters/{row.name}.png)"]
    return "\n".join([*words, ""])


def page() -> str:
    """Return the page."""
    lines = [
        "# Parameters",
        "",
        "The same names serve in Python, on the command line (`--deviation-threshold`), in the",
        "MeshLab filters (`deviationthreshold`) and in Blender's panel. Pictures show a stone",
        "tablet of 24,200 points: maps of saliency from blue to red, regions in colours, kept",
        "points in red (of a simplification to 5 %, or of the threshold α = 20 for interest",
        "points). This page is written by `python -m docs.parameter_pictures`.",
        "",
    ]
    group = ""
    for row in (*salcore.TARGETS, *salcore.TABLE):
        if row.group != group:
            group = row.group
            lines += [f"## {group}", ""]
        lines.append(section(row))
    return "\n".join(lines).rstrip() + "\n"


def main() -> None:
    """Draw the pictures asked for, or all, and write the page."""
    names = sys.argv[1:] or list(VALUES)
    for row in (*salcore.TARGETS, *salcore.TABLE):
        if row.name in names and row.name in VALUES:
            picture(row)
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
