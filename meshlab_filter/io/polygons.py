# SPDX-License-Identifier: GPL-3.0-or-later
"""Cut polygons into triangles, corner by corner."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .layer import Floats

MAX_APEXES = 32
"""Corners that are tried as the one from which a polygon is cut."""


def triangulate(
    points: Floats, corners: NDArray[Any], counts: NDArray[Any]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut polygons into fans of triangles.

    A fan begins at the corner from which its flattest turn against the polygon's normal is least,
    so a quad that is not convex is cut along its inner diagonal.

    Parameters
    ----------
    points : (N, 3) float64
    corners : (C,) int
        Points at the corners of all polygons, one polygon after the other.
    counts : (P,) int
        Corners of each polygon; those with less than three are left out.

    Returns
    -------
    corner : (T, 3) int64
        Positions in `corners`, in the order of the polygons.
    polygon : (T,) int64

    Notes
    -----
    O(C) for polygons of bounded size.
    """
    start = np.cumsum(counts) - counts
    found, owner = [np.empty((0, 3), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for count in np.unique(counts[counts >= 3]):
        polygon = np.flatnonzero(counts == count)
        apex = np.zeros(len(polygon), dtype=np.int64)
        if count > 3:
            apex = _best_apex(points[corners[start[polygon][:, None] + np.arange(count)]])
        step = np.arange(1, count - 1)
        local = np.stack([np.zeros_like(step), step, step + 1], axis=1)  # (count - 2, 3)
        turned = (local[None] + apex[:, None, None]) % count
        found.append((start[polygon][:, None, None] + turned).reshape(-1, 3))
        owner.append(np.repeat(polygon, count - 2))
    corner, polygons = np.concatenate(found), np.concatenate(owner)
    order = np.argsort(polygons, kind="stable")
    return corner[order], polygons[order]


def _best_apex(loops: Floats) -> NDArray[np.int64]:
    """Return for polygons (P, n, 3) the corner whose fan folds least."""
    count = loops.shape[1]
    ahead = np.roll(loops, -1, axis=1)
    with np.errstate(invalid="ignore", over="ignore"):
        normal = np.cross(loops - loops[:, :1], ahead - loops[:, :1]).sum(axis=1)
        score = np.full((len(loops), min(count, MAX_APEXES)), -np.inf)
        for apex in range(score.shape[1]):
            fan = np.roll(loops, -apex, axis=1)
            spokes = fan[:, 1:] - fan[:, :1]
            areas = np.cross(spokes[:, :-1], spokes[:, 1:])
            lengths = np.linalg.norm(areas, axis=2)
            heights = np.einsum("pkc,pc->pk", areas, normal) / np.maximum(lengths, 1e-300)
            score[:, apex] = heights.min(axis=1)
        score = np.round(score / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None], 6)
    best = np.argmax(np.nan_to_num(score, nan=-2.0, neginf=-2.0), axis=1)
    return np.asarray(best, dtype=np.int64)
