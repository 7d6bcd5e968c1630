# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw meshes and clouds with matplotlib, without a window."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import FileError
from ..io.staging import write

Floats = NDArray[np.float64]

GREY = np.array([0.72, 0.72, 0.7])
LIGHT = np.array([0.35, 0.45, 0.82])
FORWARD = {"y": np.eye(3), "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])}
"""Rotations of the upward axis to the picture's y; the viewer looks along -z."""


@dataclass(frozen=True)
class Panel:
    """One drawing in a picture.

    Attributes
    ----------
    title : str
    points : (n, 3) float64
    faces : (m, 3) int or None
    normals : (n, 3) float64
        For the shading of a cloud; signs do not matter.
    colors : (n, 3) float64 in [0, 1], or None for grey
    shown : (k,) int or None
        Draw these points alone, as dots, where no others hide them.
    """

    title: str
    points: Floats
    faces: NDArray[Any] | None
    normals: Floats
    colors: Floats | None = None
    shown: NDArray[Any] | None = None


def check_picture(path: Path) -> None:
    """Refuse a picture that cannot be drawn; called before any work is done.

    Raises
    ------
    FileError
        If matplotlib is not installed, or does not know the ending.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
    except ImportError as error:
        raise FileError(
            "pictures need matplotlib: install it with pip install 'salient-simplify[plot]'"
        ) from error
    known = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix.lower().removeprefix(".") not in known:
        raise FileError(f"{path}: no format for pictures; name a file such as map.png")


def save_picture(path: Path, rows: list[list[Panel]], *, up: str = "y") -> None:
    """Draw rows of panels and write them to a file, whose ending says in which format.

    Raises
    ------
    FileError
        If matplotlib is not installed, or does not know the ending.
    """
    check_picture(path)
    from matplotlib.figure import Figure

    columns = max(map(len, rows))
    shape = [_extent(row[0].points @ FORWARD[up].T) for row in rows]
    heights = [min(4.8 * height / width, 9.0) for width, height in shape]
    figure = Figure(figsize=(5.0 * columns, sum(heights) + 0.5 * len(rows)), dpi=140)
    grid = figure.subplots(
        len(rows), columns, squeeze=False, gridspec_kw={"height_ratios": heights}
    )
    for axes, row in zip(grid, rows, strict=True):
        for axis in axes:
            axis.axis("off")
        for axis, panel in zip(axes, row, strict=False):
            _draw(axis, panel, FORWARD[up])
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.01, top=0.95, wspace=0.03, hspace=0.12)
    write(path, figure.savefig)


def _extent(points: Floats) -> tuple[float, float]:
    """Return width and height of the points, neither less than a tenth of the other."""
    width, height = np.ptp(points[:, :2], axis=0)
    return max(width, 0.1 * height, 1e-30), max(height, 0.1 * width, 1e-30)


def _draw(axis: Any, panel: Panel, rotation: Floats) -> None:
    """Draw one panel: faces or points from back to front, shaded."""
    points, normals = panel.points @ rotation.T, panel.normals @ rotation.T
    colors = np.broadcast_to(GREY, points.shape) if panel.colors is None else panel.colors
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    margin = 0.02 * (high - low) + 1e-30
    axis.set_xlim(low[0] - margin[0], high[0] + margin[0])
    axis.set_ylim(low[1] - margin[1], high[1] + margin[1])
    axis.set_aspect("equal")
    axis.set_title(panel.title, fontsize=11)
    if panel.shown is not None:
        visible = panel.shown[_visible(points)[panel.shown]]
        _draw_points(axis, points[visible], colors[visible], 0.2 * _dot_size(axis, points[visible]))
    elif panel.faces is not None and len(panel.faces):
        _draw_faces(axis, points, panel.faces, colors)
    else:
        _draw_points(axis, points, colors * _shade(np.abs(normals)), _dot_size(axis, points))


def _draw_faces(axis: Any, points: Floats, faces: NDArray[Any], colors: Floats) -> None:
    """Draw the faces turned to the viewer."""
    from matplotlib.collections import PolyCollection

    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = normals[:, 2] > 0.0
    order = np.flatnonzero(front)[np.argsort(corners[front][:, :, 2].mean(axis=1))]
    length = np.linalg.norm(normals[order], axis=1, keepdims=True)
    shade = _shade(normals[order] / np.maximum(length, 1e-300))
    paint = np.clip(colors[faces[order]].mean(axis=1) * shade, 0.0, 1.0)
    # Edges in the colour of their faces close the hairlines between these.
    axis.add_collection(
        PolyCollection(corners[order][:, :, :2], facecolors=paint, edgecolors=paint, linewidths=0.2)
    )


def _draw_points(axis: Any, points: Floats, colors: Floats, size: float) -> None:
    """Draw points as dots of a size in points squared."""
    order = np.argsort(points[:, 2])
    paint = np.clip(colors[order], 0.0, 1.0)
    axis.scatter(*points[order, :2].T, s=size, c=paint, linewidths=0, rasterized=True)


def _shade(normals: Floats) -> Floats:
    """Return Lambert shading (n, 1) with some ambient light."""
    light = LIGHT / np.linalg.norm(LIGHT)
    shade: Floats = 0.3 + 0.75 * np.clip(normals @ light, 0.0, 1.0)[:, None]
    return shade


def _spacing(points: Floats) -> float:
    """Return the median distance to the third nearest point, over some thousand points."""
    if len(points) < 4:
        return 1.0
    some = points[:: max(len(points) // 4000, 1)]
    distance = np.asarray(cKDTree(points).query(some, k=4)[0])
    return float(np.median(distance[:, -1]))


def _dot_size(axis: Any, points: Floats) -> float:
    """Return the size of dots that just cover the surface between them."""
    box = axis.get_position()
    width = box.width * axis.figure.get_figwidth() * 72.0
    span = np.ptp(axis.get_xlim())
    return float(np.clip((1.6 * _spacing(points) * width / span) ** 2, 0.5, 200.0))


def _visible(points: Floats) -> NDArray[np.bool_]:
    """Return which points no others hide, by a depth buffer with cells two spacings wide."""
    spacing = max(_spacing(points), 1e-30)
    cell = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / (2.0 * spacing)).astype(np.int64)
    _, number = np.unique(cell, axis=0, return_inverse=True)
    front = np.full(number.max() + 1, -np.inf)
    np.maximum.at(front, number.ravel(), points[:, 2])
    visible: NDArray[np.bool_] = points[:, 2] >= front[number.ravel()] - 4.0 * spacing
    return visible
