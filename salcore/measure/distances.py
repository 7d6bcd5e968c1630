# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact distances of points to a mesh, and to the tangent planes of a cloud."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .blocks import BLOCK, rest_blocks
from .geometry import Floats, Indices, unit
from .progress import Rests, finish


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
    queries: Floats, surface: Surface, *, workers: int = 0
) -> Rests[tuple[Floats, Floats]]:
    """Return the distances of points to the nearest point and to the surface, with rests.

    Parameters
    ----------
    queries : (q, 3) float64
    surface : Surface
    workers : int
        Threads; 0 takes one per processor.

    Returns
    -------
    (q,) float64, (q,) float64
        Infinite where `surface` has no point.
    """
    to_point, nearest = yield from nearest_points(queries, surface.points, workers=workers)
    if not len(surface.points) or not len(queries):
        return to_point, to_point.copy()
    if len(surface.faces):
        to_surface = yield from surface_distances_steps(queries, surface, to_point, workers=workers)
        return to_point, to_surface
    to_surface = to_point.copy()
    if surface.normals is not None:

        def kernel(start: int, stop: int) -> None:
            block = slice(start, stop)
            to_surface[block] = plane_distances(
                queries[block], surface, nearest[block], to_point[block]
            )

        yield from rest_blocks(kernel, len(queries), workers=workers)
    return to_point, to_surface


def nearest_points(
    queries: Floats, points: Floats, *, workers: int = 0
) -> Rests[tuple[Floats, Indices]]:
    """Return the distance to the nearest of `points`, and its index (-1 and infinity for none)."""
    distance = np.full(len(queries), np.inf)
    index = np.full(len(queries), -1, dtype=np.intp)
    if not len(points) or not len(queries):
        return distance, index
    yield
    tree = cKDTree(points, balanced_tree=False)
    yield

    def kernel(start: int, stop: int) -> None:
        distance[start:stop], index[start:stop] = tree.query(queries[start:stop])

    yield from rest_blocks(kernel, len(queries), workers=workers)
    return distance, index


def plane_distances(
    queries: Floats, surface: Surface, nearest: Indices, to_point: Floats
) -> Floats:
    """Return the distances to the tangent planes at the nearest points."""
    assert surface.normals is not None
    normals = surface.normals[nearest]
    height = np.abs(np.einsum("qc,qc->q", queries - surface.points[nearest], normals))
    return np.where(normals.any(axis=1), height, to_point)


def surface_distances(
    queries: Floats, surface: Surface, bound: Floats, *, workers: int = 0
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
    return finish(surface_distances_steps(queries, surface, bound, workers=workers))


def surface_distances_steps(
    queries: Floats, surface: Surface, bound: Floats, *, workers: int = 0
) -> Rests[Floats]:
    """Rest between the parts of the work, and return what `surface_distances` returns."""
    best = bound.copy()
    corners = surface.points[surface.faces]
    yield
    centres, radii = np.empty((len(corners), 3)), np.empty(len(corners))
    walls = np.empty((len(corners), 4, 3))

    def prepare(start: int, stop: int) -> None:
        block = slice(start, stop)
        centres[block] = corners[block].mean(axis=1)
        away = corners[block] - centres[block, None]
        radii[block] = np.sqrt((away**2).sum(axis=2).max(axis=1))
        walls[block] = _walls(corners[block])

    yield from rest_blocks(prepare, len(corners), workers=workers)
    classes = np.frexp(radii)[1]
    yield
    # First the one face with the nearest centre, whatever its size: it brings most distances down
    # so far that hardly another face has to be looked at closely.
    groups = [(cKDTree(centres, balanced_tree=False), True, corners, radii, walls)]
    yield
    for size in np.unique(classes):
        members = np.flatnonzero(classes == size)
        yield
        tree = cKDTree(centres[members], balanced_tree=False)
        yield
        groups.append((tree, False, corners[members], radii[members], walls[members]))
    for group in groups:

        def kernel(start: int, stop: int, group: Any = group) -> None:
            block = slice(start, stop)
            best[block] = _refine(queries[block], best[block], *group)

        yield from rest_blocks(kernel, len(queries), workers=workers, size=BLOCK // 2)
    return best


def _walls(corners: Floats) -> Floats:
    """Return four unit vectors (m, 4, 3) a triangle (m, 3, 3).

    Those through its edges, pointing out of it in its plane, and its normal.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    normals = unit(np.cross(edges[:, 0], edges[:, 1]))[:, None]
    return np.concatenate([unit(np.cross(edges, normals)), normals], axis=1)


def _refine(
    queries: Floats, best: Floats, tree: Any, once: bool, corners: Floats, radii: Floats,
    walls: Floats,
) -> Floats:  # fmt: skip
    """Lower the distances `best` by those to triangles with centres in `tree`.

    With `once` only the triangle with the nearest centre is looked at.
    """
    reach = np.append(radii, -np.inf)  # for the centres that a query does not find
    active, width = np.arange(len(queries)), 1 if once else min(8, tree.n)
    while len(active):
        least = best[active]
        bound = np.full(len(active), np.inf) if once else least + radii.max()
        away, found = tree.query(
            queries[active], k=np.arange(1, width + 1), distance_upper_bound=float(bound.max())
        )
        query, slot = np.nonzero(away < least[:, None] + reach[found])
        face, query = found[query, slot], active[query]
        for wall in (3, 0, 1, 2):
            offset = queries[query] - corners[face, wall % 3]
            beyond = np.einsum("mc,mc->m", offset, walls[face, wall])
            near = (np.abs(beyond) if wall == 3 else beyond) <= best[query]
            query, face = query[near], face[near]
        np.minimum.at(best, query, triangle_distances(queries[query], corners[face]))
        more = (away[:, -1] < bound) & (width < tree.n) & (not once)
        active, width = active[more], min(2 * width, tree.n)
    return best


def triangle_distances(queries: Floats, corners: Floats) -> Floats:
    """Return the distance (m,) of each query (m, 3) to its triangle (m, 3 corners, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    square = np.einsum("mc,mc->m", normal, normal)
    inside = square > 0.0
    nearest = np.full(len(queries), np.inf)
    for k in range(3):
        start, edge = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        offset = queries - start
        inside &= np.einsum("mc,mc->m", np.cross(edge, offset), normal) >= 0.0
        length = np.einsum("mc,mc->m", edge, edge)
        along = np.einsum("mc,mc->m", offset, edge)
        share = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
        rest = offset - np.clip(share, 0.0, 1.0)[:, None] * edge
        nearest = np.minimum(nearest, np.einsum("mc,mc->m", rest, rest))
    height = np.einsum("mc,mc->m", queries - corners[:, 0], normal) ** 2
    plane = np.divide(height, square, out=np.zeros_like(height), where=inside)
    result: NDArray[np.float64] = np.sqrt(np.where(inside, plane, nearest))
    return result
