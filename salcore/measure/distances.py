# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact distances of points to a mesh, and to the tangent planes of a cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..arrays.blocks import run_blocks
from ..arrays.types import Floats, Indices
from ..arrays.vectors import dot
from ..progress import SILENT, Progress
from .face_search import lower_to_faces
from .triangles import triangle_distances as triangle_distances


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh or a cloud to measure distances to.

    Attributes
    ----------
    points : (n, 3) float64
    faces : (m, 3) intp
        May be empty.
    normals : (n, 3) float64 or None
        Unit normals for the tangent planes of a cloud; without them, and where they are zero,
        the distance to the nearest point stands in.
    """

    points: Floats
    faces: Indices
    normals: Floats | None = None


def distances(
    queries: Floats, surface: Surface, progress: Progress = SILENT
) -> tuple[Floats, Floats]:
    """Return the distances of points to the nearest point and to the surface.

    Parameters
    ----------
    queries : (q, 3) float64
    surface : Surface

    Returns
    -------
    (q,) float64, (q,) float64
        Infinite where `surface` has no point.
    """
    to_point, nearest = nearest_points(queries, surface.points, progress.part(0.0, 0.2))
    if not len(surface.points) or not len(queries):
        return to_point, to_point.copy()
    if len(surface.faces):
        part = progress.part(0.2, 1.0)
        return to_point, surface_distances(queries, surface, to_point, part)
    to_surface = to_point.copy()
    if surface.normals is not None:

        def measure(start: int, stop: int) -> None:
            block = slice(start, stop)
            to_surface[block] = plane_distances(
                queries[block], surface, nearest[block], to_point[block]
            )

        run_blocks(measure, len(queries), progress.part(0.2, 1.0))
    return to_point, to_surface


def nearest_points(
    queries: Floats, points: Floats, progress: Progress = SILENT
) -> tuple[Floats, Indices]:
    """Return the distance to the nearest of `points`, and its index (-1 and infinity for none)."""
    distance, index = np.full(len(queries), np.inf), np.full(len(queries), -1, dtype=np.intp)
    if not len(points) or not len(queries):
        return distance, index
    tree = cKDTree(points, balanced_tree=False)
    progress(0.1)

    def find(start: int, stop: int) -> None:
        block = slice(start, stop)
        distance[block], index[block] = tree.query(queries[block])

    run_blocks(find, len(queries), progress.part(0.1, 1.0))
    return distance, index


def plane_distances(
    queries: Floats, surface: Surface, nearest: Indices, to_point: Floats
) -> Floats:
    """Return the distances to the tangent planes at the nearest points."""
    assert surface.normals is not None
    normals = surface.normals[nearest]
    height = np.abs(dot(queries - surface.points[nearest], normals))
    return np.where(normals.any(axis=1), height, to_point)


def surface_distances(
    queries: Floats, surface: Surface, bound: Floats, progress: Progress = SILENT
) -> Floats:
    """Return the exact distances to the faces and to the points that no face uses.

    Parameters
    ----------
    queries : (q, 3) float64
    surface : Surface
        With at least one face.
    bound : (q,) float64
        Distance to the nearest of all the surface's points: an upper bound.

    Returns
    -------
    (q,) float64

    Notes
    -----
    Long triangles are cut into pieces, and the pieces put into a tree of bounding boxes. The
    piece with the nearest centre brings most distances down so far that few boxes are nearer.
    About O((m + q) log m) time for m faces, and O(m + q) memory. Queries that are equally far
    from many faces, such as those on the axis of a cone, have to look at all of these.
    """
    result = bound.copy()
    away = np.flatnonzero(bound > 0.0)  # a query at a point of the surface is done
    if len(away):
        corners = surface.points[surface.faces]
        result[away] = lower_to_faces(queries[away], bound[away], corners, progress)
    return result
