# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker can be asked to show: values of all points, and their colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .. import salcore
from ..salcore.maps import MAPS_BEGIN
from ..salcore.progress import Progress
from .analyses import analyze

INTEREST_BEGIN = 0.4
"""Share of the time that the analysis takes, of it and a threshold."""
MAX_ROWS = 100
"""Rows of the table of regions that are handed over: the most salient ones."""
MAX_SAMPLE = 20_000
"""Points among which a mean spacing is found."""
INTEREST_COLOR, OTHER_COLOR = (0.9, 0.1, 0.05), (0.35, 0.35, 0.38)


def saliency(
    *, points: Any, faces: Any, normals: Any, parameters: dict[str, Any], work: Progress
) -> dict[str, Any]:
    """Return the saliency of every point, and its colour from blue to red."""
    analysis = analyze(points, faces, normals, parameters, work, MAPS_BEGIN)
    analysis.prepare(progress=work.portion(MAPS_BEGIN, 1.0))
    values = analysis.saliency
    return _shown(points, values.astype(np.float32), salcore.saliency_colors(values))


def regions(
    *,
    points: Any,
    faces: Any,
    normals: Any,
    parameters: dict[str, Any],
    by_saliency: bool = False,
    work: Progress,
) -> dict[str, Any]:
    """Return the region of every point, a colour for each region, and the table of regions.

    Regions have colours of their own, or those of their mean saliency. "table" has the rows of
    `Analysis.region_table`, the most salient first.
    """
    analysis = analyze(points, faces, normals, parameters, work, MAPS_BEGIN)
    analysis.prepare(regions=True, progress=work.portion(MAPS_BEGIN, 1.0))
    values, table = analysis.regions, analysis.region_table
    colors = salcore.region_colors(values)
    if by_saliency:
        colors = salcore.saliency_colors(np.append(table.mean, 0.0)[values])
    answer = _shown(points, values.astype(np.int32), colors)
    return answer | {"table": table.as_dicts()[:MAX_ROWS], "count": len(table)}


def interest(
    *,
    points: Any,
    faces: Any,
    normals: Any,
    parameters: dict[str, Any],
    alpha: float,
    work: Progress,
) -> dict[str, Any]:
    """Return whether a threshold keeps a point, and red for those it keeps."""
    analysis = analyze(points, faces, normals, parameters, work, INTEREST_BEGIN)
    result = analysis.simplify(alpha=alpha, progress=work.portion(INTEREST_BEGIN, 1.0))
    kept = np.zeros(len(result.source), dtype=bool)
    kept[result.indices] = True
    return _shown(points, kept, np.where(kept[:, None], INTEREST_COLOR, OTHER_COLOR))


def _shown(points: Any, values: NDArray[Any], rgb: Any) -> dict[str, Any]:
    """Return values, opaque colours (n, 4), and half the mean distance to the nearest point."""
    colors = np.ones((len(values), 4), dtype=np.float32)
    colors[:, :3] = rgb
    finite = points[np.isfinite(points).all(axis=1)]
    return {"values": values, "colors": colors, "radius": point_radius(finite)}


def point_radius(points: Any) -> float:
    """Return half the mean distance to the nearest other point, of a sample; 0 without any."""
    tree = cKDTree(points, balanced_tree=False)
    sample = points[:: max(len(points) // MAX_SAMPLE, 1)]
    distance = np.asarray(tree.query(sample, k=2)[0])[:, 1]
    distance = distance[np.isfinite(distance) & (distance > 0.0)]
    return 0.5 * float(distance.mean()) if len(distance) else 0.0
