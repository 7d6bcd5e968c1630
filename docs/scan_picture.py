# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw docs/pictures/scan.png: airborne LiDAR before and after.

    python -m docs.scan_picture autzen_crop_1M.ply

The scan is PDAL's Autzen (Watershed Sciences, CC BY 4.0). Each panel is the
shaded surface through the points.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LightSource
from matplotlib.figure import Figure
from plyfile import PlyData
from scipy.interpolate import LinearNDInterpolator

import salcore

PICTURE = Path(__file__).parent / "pictures" / "scan.png"
RATIO = 0.05
INCHES, ROWS = (14.0, 4.6), 420
WINDOW = ((0.02, 0.4), (0.98, 0.98))
"""Corners of what is shown, as shares of the scan."""


def relief(points: np.ndarray, window: np.ndarray) -> np.ndarray:
    """Return the shaded heights (rows, columns) of the surface through points in a window."""
    low, high = window
    margin = 0.1 * (high - low)
    points = points[((points[:, :2] > low - margin) & (points[:, :2] < high + margin)).all(axis=1)]
    rows = np.linspace(high[1], low[1], ROWS)
    columns = np.linspace(low[0], high[0], int(ROWS * (high - low)[0] / (high - low)[1]))
    surface = LinearNDInterpolator(points[:, :2] - low, points[:, 2])
    height = surface(*np.meshgrid(columns - low[0], rows - low[1]))
    step = (high - low)[1] / ROWS
    return LightSource(315, 40).hillshade(height, dx=step, dy=step)


def main() -> None:
    """Simplify, and draw the same part of the scan before and after."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scan", type=Path)
    vertex = PlyData.read(str(parser.parse_args().scan))["vertex"]
    points = np.column_stack([vertex[axis] for axis in "xyz"])
    light = salcore.simplify(points, ratio=RATIO).indices
    corner, size = points[:, :2].min(axis=0), np.ptp(points, axis=0)[:2]
    window = corner + np.array(WINDOW) * size
    figure = Figure(INCHES, layout="constrained")
    FigureCanvasAgg(figure)
    panels = [
        (f"{len(points):,} points", points),
        (f"{len(light):,}", points[light]),
    ]
    for axes, (title, kept) in zip(figure.subplots(1, 2), panels, strict=True):
        axes.imshow(relief(kept, window), cmap="gray", vmin=0, vmax=1)
        axes.set_title(title)
        axes.set_axis_off()
    figure.savefig(PICTURE, dpi=100)


if __name__ == "__main__":
    main()
