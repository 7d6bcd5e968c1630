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
from .raster import visible

Floats = NDArray[np.float64]

GREY = np.array([0.72, 0.72, 0.7])
FINER = 2
"""Rows and columns that make one of the picture's, so that outlines are smooth."""
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
    edges : bool
        Draw the edges of the faces as well.
    """

    title: str
    points: Floats
    faces: NDArray[Any] | None
    normals: Floats
    colors: Floats | None = None
    shown: NDArray[Any] | None = None
    edges: bool = False


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
    figure = Figure(figsize=(5.0 * columns, sum(heights) + 0.5 * len(rows)), dpi=110)
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
        _draw_faces(axis, points, panel.faces, colors, panel.edges)
    else:
        _draw_points(axis, points, colors * _shade(np.abs(normals)), _dot_size(axis, points))


def _draw_faces(
    axis: Any, points: Floats, faces: NDArray[Any], colors: Floats, edges: bool
) -> None:
    """Draw the faces that no others hide, each in the light of its own normal."""
    left, right = axis.get_xlim()
    bottom, top = axis.get_ylim()
    figure = axis.figure
    width = axis.get_position().width * figure.get_figwidth() * figure.dpi
    scale = FINER * width / (right - left)
    shape = (max(round(scale * (top - bottom)), 1), max(round(scale * (right - left)), 1))
    screen = (points - [left, bottom, 0.0]) * scale
    image = shaded(screen, faces, colors, shape, edges=edges)
    rows, columns = (FINER * (size // FINER) for size in shape)
    image = image[:rows, :columns].reshape(rows // FINER, FINER, columns // FINER, FINER, 3)
    axis.imshow(
        image.mean(axis=(1, 3)),
        extent=(left, left + columns / scale, bottom, bottom + rows / scale),
        origin="lower",
    )
    axis.set(xlim=(left, right), ylim=(bottom, top))


def shaded(
    points: Floats,
    faces: NDArray[Any],
    colors: Floats,
    shape: tuple[int, int],
    *,
    normals: Floats | None = None,
    edges: bool = False,
) -> Floats:
    """Return the picture (rows, columns, 3) of faces on white, seen along the third axis.

    Parameters
    ----------
    points : (n, 3) float64
        Column, row (upwards) and nearness, in pixels.
    faces : (m, 3) int
    colors : (n, 3) float64 in [0, 1]
    shape : (int, int)
        Rows and columns.
    normals : (n, 3) float64, optional
        Shade smoothly between these; each face in the light of its own normal by default.
    edges : bool
        Draw the edges of the faces as well.
    """
    corners = points[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    seen, weights = visible(points, faces, shape)
    inside = seen >= 0
    face, weight = seen[inside], weights[inside]
    normal = flat[face]
    if normals is not None:
        normal = np.einsum("nk,nkd->nd", weight, normals[faces[face]])
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    # Both sides of a face are lit: an open scan is seen from behind as well.
    light = _shade(normal * np.where(normal[:, 2:] < 0, -1.0, 1.0))
    paint = np.einsum("nk,nkd->nd", weight, colors[faces[face]]) * light
    if edges:
        sides = np.linalg.norm(np.roll(corners, 1, 1) - np.roll(corners, -1, 1), axis=2)
        height = length / np.maximum(sides, 1e-300)
        paint *= 0.55 + 0.45 * np.clip((weight * height[face]).min(axis=1) - 0.5, 0, 1)[:, None]
    image = np.ones((*shape, 3))
    image[inside] = np.clip(paint, 0.0, 1.0)
    return image


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
