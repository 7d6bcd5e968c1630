# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact distances of points to a mesh, and to the tangent planes of a cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..arrays.blocks import BLOCK, run_blocks, worker_count
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import dot, unit
from ..progress import SILENT, Progress


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
    to_point, nearest = nearest_points(queries, surface.points)
    progress(0.2)
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


def nearest_points(queries: Floats, points: Floats) -> tuple[Floats, Indices]:
    """Return the distance to the nearest of `points`, and its index (-1 and infinity for none)."""
    if not len(points) or not len(queries):
        return np.full(len(queries), np.inf), np.full(len(queries), -1, dtype=np.intp)
    tree = cKDTree(points, balanced_tree=False)
    distance, index = map(np.asarray, tree.query(queries, workers=worker_count()))
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
    Faces are sorted into classes of like size, each with a tree of its face centres. A face that
    is nearer than the best so far must have its centre within that distance plus the class's
    largest radius; each query asks for more and more centres until that is passed.
    """
    best = bound.copy()
    triangles = _Triangles.prepare(surface.points[surface.faces])
    # First the one face with the nearest centre, whatever its size: it brings most distances down
    # so far that hardly another face has to be looked at closely.
    groups = [(triangles, True)]
    classes = np.frexp(triangles.radii)[1]
    groups += [(triangles.take(classes == size), False) for size in np.unique(classes)]
    for number, (group, once) in enumerate(groups):
        tree = cKDTree(group.centres, balanced_tree=False)

        def tighten(
            start: int, stop: int, group: _Triangles = group, tree: cKDTree = tree,
            once: bool = once,
        ) -> None:  # fmt: skip
            best[start:stop] = _tighten(queries[start:stop], best[start:stop], group, tree, once)

        share = number / len(groups), (number + 1) / len(groups)
        run_blocks(tighten, len(queries), progress.part(*share), BLOCK // 2)
    return best


@dataclass(frozen=True, eq=False)
class _Triangles:
    """Triangles, and what sorts out most of them without measuring.

    Attributes
    ----------
    corners : (m, 3, 3) float64
    centres : (m, 3) float64
    radii : (m,) float64
        Distance of the farthest corner from the centre.
    edge_planes : (m, 4, 3) float64
        Unit vectors out of the triangle across its edges, in its plane, and its normal.
    """

    corners: Floats
    centres: Floats
    radii: Floats
    edge_planes: Floats

    @classmethod
    def prepare(cls, corners: Floats) -> _Triangles:
        """Work out centres, radii and edge planes, in blocks."""
        centres, radii = np.empty((len(corners), 3)), np.empty(len(corners))
        planes = np.empty((len(corners), 4, 3))

        def measure(start: int, stop: int) -> None:
            block = corners[start:stop]
            centres[start:stop] = block.mean(axis=1)
            away = block - centres[start:stop, None]
            radii[start:stop] = np.sqrt((away**2).sum(axis=2).max(axis=1))
            edges = np.roll(block, -1, axis=1) - block
            normals = unit(np.cross(edges[:, 0], edges[:, 1]))[:, None]
            planes[start:stop, :3] = unit(np.cross(edges, normals))
            planes[start:stop, 3:] = normals

        run_blocks(measure, len(corners))
        return cls(corners, centres, radii, planes)

    def take(self, chosen: Mask) -> _Triangles:
        """Return some of the triangles."""
        return _Triangles(
            self.corners[chosen], self.centres[chosen], self.radii[chosen], self.edge_planes[chosen]
        )


def _tighten(
    queries: Floats, best: Floats, triangles: _Triangles, tree: cKDTree, once: bool
) -> Floats:
    """Lower the distances `best` by those to triangles, whose centres are in `tree`.

    With `once` only the triangle with the nearest centre is looked at.
    """
    radii = triangles.radii
    reach = np.append(radii, -np.inf)  # for the centres that a query does not find
    active, width = np.arange(len(queries)), 1 if once else min(8, tree.n)
    while len(active):
        least = best[active]
        bound = np.full(len(active), np.inf) if once else least + radii.max()
        furthest = float(bound.max())
        answer = tree.query(queries[active], np.arange(1, width + 1), distance_upper_bound=furthest)
        away, found = map(np.asarray, answer)
        query, slot = np.nonzero(away < least[:, None] + reach[found])
        face, query = found[query, slot], active[query]
        for plane in (3, 0, 1, 2):  # no corner is nearer than a plane that lies between
            offset = queries[query] - triangles.corners[face, plane % 3]
            beyond = dot(offset, triangles.edge_planes[face, plane])
            near = (np.abs(beyond) if plane == 3 else beyond) <= best[query]
            query, face = query[near], face[near]
        np.minimum.at(best, query, triangle_distances(queries[query], triangles.corners[face]))
        more = (away[:, -1] < bound) & (width < tree.n) & (not once)
        active, width = active[more], min(2 * width, tree.n)
    return best


def triangle_distances(queries: Floats, corners: Floats) -> Floats:
    """Return the distance (m,) of each query (m, 3) to its triangle (m, 3 corners, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    square = dot(normal, normal)
    inside = square > 0.0
    nearest = np.full(len(queries), np.inf)
    for k in range(3):
        start, edge = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        offset = queries - start
        inside &= dot(np.cross(edge, offset), normal) >= 0.0
        length = dot(edge, edge)
        along = dot(offset, edge)
        share = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
        rest = offset - np.clip(share, 0.0, 1.0)[:, None] * edge
        nearest = np.minimum(nearest, dot(rest, rest))
    height = dot(queries - corners[:, 0], normal) ** 2
    plane = np.divide(height, square, out=np.zeros_like(height), where=inside)
    result: Floats = np.sqrt(np.where(inside, plane, nearest))
    return result
