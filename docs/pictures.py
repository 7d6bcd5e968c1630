# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the pictures of the documentation from a generated model.

    python -m docs.pictures

The model is a stone tablet with an inscription: the sort of detail that uniform thinning loses.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextPath
from PIL import Image
from scipy.ndimage import gaussian_filter

import salcore
from meshlab_filter.cli.demo import panels
from meshlab_filter.cli.picture import Panel, save_picture

FOLDER = Path(__file__).parent / "pictures"


def tablet(columns: int = 420, rows: int = 210) -> tuple[np.ndarray, np.ndarray]:
    """Return points and faces of a gently curved, slightly rough tablet with a carved word."""
    x, y = np.meshgrid(np.linspace(0.0, 2.0, columns), np.linspace(0.0, 1.0, rows))
    text = TextPath((0, 0), "SALIENT", size=1.0, prop=FontProperties(weight="bold"))
    low, high = text.get_extents().get_points()
    fitted = (text.vertices - low) / (high - low) * [1.5, 0.42] + [0.25, 0.3]
    carved = Outline(fitted, text.codes).contains_points(np.column_stack([x.ravel(), y.ravel()]))
    depth = gaussian_filter(carved.reshape(x.shape).astype(float), 1.2)
    rough = gaussian_filter(np.random.default_rng(0).normal(size=x.shape), 2.0)
    z = 0.12 * np.sin(np.pi * x / 2.0) - 0.03 * depth + 0.004 * rough
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.column_stack([corner, corner + 1, corner + columns + 1])
    second = np.column_stack([corner, corner + columns + 1, corner + columns])
    return points, np.concatenate([first, second])


def main() -> None:
    """Write every picture."""
    points, faces = tablet()
    analysis = salcore.analyze(points, faces)
    result = analysis.simplify(alpha=40)
    original, saliency, regions, kept = panels("tablet", points, faces, analysis, result)
    FOLDER.mkdir(exist_ok=True)
    save_picture(FOLDER / "relief.png", [[original, saliency], [regions, kept]])
    save_picture(FOLDER / "levels.png", [[level(analysis, points, r) for r in (0.1, 0.02, 0.005)]])


def level(analysis: salcore.Analysis, points: np.ndarray, ratio: float) -> Panel:
    """Return a level of detail as a mesh, each face in the light of its own normal."""
    result = analysis.simplify(ratio=ratio)
    assert result.faces is not None
    corners = points[result.indices][result.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    loose = np.arange(3 * len(corners)).reshape(-1, 3)
    title = f"{ratio:.1%}: {len(result.indices):,} points, {len(corners):,} faces"
    return Panel(title, corners.reshape(-1, 3), loose, np.repeat(normals, 3, axis=0))


def save_small(figure: Any, path: Path, colors: int = 96) -> None:
    """Write a figure as PNG with a palette: a third of the size, and it looks the same."""
    path.parent.mkdir(parents=True, exist_ok=True)
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    Image.open(drawn).convert("RGB").quantize(colors).save(path, optimize=True)


if __name__ == "__main__":
    main()
