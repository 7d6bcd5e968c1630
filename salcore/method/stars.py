# SPDX-License-Identifier: GPL-3.0-or-later
"""Stars in the Delaunay triangulation of the tangent plane: the neighbours on a cloud (§2.1)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..arrays.blocks import run_blocks
from ..arrays.types import Floats, Indices, Ints, Mask
from ..arrays.vectors import hash01
from ..progress import SILENT, Progress
from .planes import fit_normals, tangent_basis

STAR_BLOCK = 4096
WEIGHT_JITTER = 2.5e-5
"""Weight of a point in the regular triangulation, as a share of the squared distance to the nearest
point: it tells points apart that lie on one circle. Like weights on all its four points let a
square's two triangles be the same in all stars, and keep rounding from choosing between them. They
follow from the numbers of the points: a lattice's diagonals are the same wherever it lies, but not
in whatever order its points come."""
COCIRCULAR = 1e-9
FEWEST = 3
"""Nearest points that a star is sought among at least, though it be a tie which they are."""


def build_stars(
    points: Floats, number: Indices, neighbors: int, progress: Progress = SILENT
) -> tuple[Ints, Floats]:
    """Return the star of every point of a cloud, and the normal of the plane it lies in.

    Parameters
    ----------
    points : (n, 3) float64
        Neighbours should lie together in memory.
    number : (n,) intp
        Numbers that decide between points on one circle.
    neighbors : int
        Nearest points among which each star is sought.

    Returns
    -------
    stars : (n, w) int32
        Members by angle in the plane, filled up with -1.
    normals : (n, 3) float64
        Of arbitrary sign; zero where there is no plane.
    """
    count = len(points)
    width = min(neighbors, count - 1)
    normals = np.zeros((count, 3))
    if width < 1:
        return np.empty((count, 0), dtype=np.int32), normals
    tree = cKDTree(points, balanced_tree=False)
    nearest = np.empty((count, width), dtype=np.int32)
    weights, reach = np.empty(count), np.empty(count)
    stars = np.full((count, width), -1, dtype=np.int32)

    def search(start: int, stop: int) -> None:
        block = slice(start, stop)
        distance, found = map(np.asarray, tree.query(points[block], k=width + 2))
        nearest[block] = _without_self(found[:, :-1], np.arange(start, stop))
        reach[block] = distance[:, -1] ** 2
        weights[block] = WEIGHT_JITTER * distance[:, 1] ** 2 * hash01(number[block])

    def choose(start: int, stop: int) -> None:
        block = slice(start, stop)
        other = nearest[block]
        offsets = points[other] - points[block, None, :]
        square = np.einsum("bkc,bkc->bk", offsets, offsets)
        near = _nearer(square, reach[block])
        power = square + weights[block, None] - weights[other]
        normals[block], row, slot = fit_stars(offsets, power, near)
        place = np.arange(len(row)) - np.searchsorted(row, row)
        stars[block][row, place] = other[row, slot]

    run_blocks(search, count, progress.part(0.0, 0.45), STAR_BLOCK)
    run_blocks(choose, count, progress.part(0.45, 1.0), STAR_BLOCK)
    widest = int(np.count_nonzero(stars >= 0, axis=1).max())
    return np.ascontiguousarray(stars[:, :widest]), normals


def _without_self(found: Indices, block: Indices) -> Indices:
    """Drop each point itself from its nearest points (else the farthest), keeping the order."""
    keep = found != block[:, None]
    keep[keep.all(axis=1), -1] = False
    other: Indices = found[keep].reshape(len(found), -1)
    return other


def _nearer(square: Floats, reach: Floats) -> Mask:
    """Return which squared distances (b, k) are less than those of the next points (b,).

    Where others are as far, rounding would decide which of them are among the k nearest, so none
    of them is; unless there would be too few left.
    """
    near: Mask = square < (1.0 - COCIRCULAR) * reach[:, None]
    near[np.count_nonzero(near, axis=1) < FEWEST] = True
    return near


def fit_stars(offsets: Floats, power: Floats, near: Mask) -> tuple[Floats, Indices, Indices]:
    """Return plane normals (b, 3) of nearest points at `offsets` (b, k, 3), and the stars.

    The stars come as the rows and slots of their members in `offsets`, by row and angle. Only the
    offsets that are `near` (b, k) count.

    The star of the origin in a Delaunay triangulation consists of the vertices of the convex hull
    of the other points after inversion in a circle round the origin. Inverting in a sphere and
    projecting then does the same in the plane, and pushes points off the plane back. Power
    distances `power` (b, k) in place of squared distances make it the regular triangulation.
    """
    centred = np.concatenate([offsets, np.zeros_like(offsets[:, :1])], axis=1)
    all_near = near.all()
    if all_near:
        centred -= centred.mean(axis=1, keepdims=True)
    else:
        weight = np.concatenate([near, np.ones_like(near[:, :1])], axis=1)[:, :, None]
        centred *= weight
        centred -= centred.sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
        centred *= weight
    normals = fit_normals(np.matmul(centred.transpose(0, 2, 1), centred))
    frame = np.stack(tangent_basis(normals), axis=2)
    inverted = np.matmul(offsets, frame) / power[:, :, None]
    x, y = inverted[:, :, 0], inverted[:, :, 1]
    order = np.argsort(_pseudo_angle(x, y), axis=1)
    width = order.shape[1]
    flat = (order + np.arange(0, order.size, width)[:, None]).ravel()
    if not all_near:
        flat = flat[near.ravel()[flat]]
    hull = _hull_vertices(x.ravel()[flat], y.ravel()[flat], flat // width)
    return normals, flat[hull] // width, flat[hull] % width


def _pseudo_angle(x: Floats, y: Floats) -> Floats:
    """Return a number that grows with the angle of (x, y), without trigonometry."""
    total = np.abs(x) + np.abs(y)
    cosine = np.divide(x, total, out=np.zeros_like(x), where=total > 0.0)
    angle: Floats = np.copysign(1.0 - cosine, y)
    return angle


def _on_ray(x: Floats, y: Floats, other_x: Floats, other_y: Floats) -> tuple[Mask, Mask]:
    """Return which points lie on the same ray from the origin as others, and which nearer to it."""
    along = x * other_x + y * other_y
    across = np.abs(x * other_y - y * other_x)
    on_ray = across <= COCIRCULAR * along
    return on_ray, on_ray & (x * x + y * y < along)


def _hull_vertices(x: Floats, y: Floats, row: Indices) -> Indices:
    """Return the positions of the hull vertices of many small point sets at once.

    Points of one set share a `row`, are sorted by angle round the origin, and the origin counts
    as a member. A point between its neighbours a and c in angle is hidden where it lies inside the
    triangle of the origin, a and c, or on the ray of a or c and nearer to the origin than that.
    Dropping all such points again and again leaves the hulls.
    """
    hull = np.ones(len(row), dtype=bool)
    alive = np.arange(len(row))
    while len(alive):
        last = np.append(row[1:] != row[:-1], True)
        first = np.roll(last, 1)
        begin, end = np.flatnonzero(first), np.flatnonzero(last)
        after, before = np.arange(1, len(row) + 1), np.arange(-1, len(row) - 1)
        after[end], before[begin] = begin, end
        ax, ay, cx, cy = x[before], y[before], x[after], y[after]
        span = ax * cy - ay * cx
        turn = (x - ax) * (cy - y) - (y - ay) * (cx - x)
        inside_triangle = (span > 0.0) & (turn < -COCIRCULAR * span)
        # The turn between two points on one ray is rounding: there the nearer to the origin goes.
        (on_a, behind_a), (on_c, behind_c) = _on_ray(x, y, ax, ay), _on_ray(x, y, cx, cy)
        hidden = (inside_triangle & ~on_a & ~on_c) | behind_a | behind_c
        hull[alive[hidden]] = False
        # Sets that lost no point are finished; the others go round again without the lost ones.
        busy = np.repeat(np.logical_or.reduceat(hidden, begin), end + 1 - begin)
        stay = np.flatnonzero(busy & ~hidden)
        alive, x, y, row = alive[stay], x[stay], y[stay], row[stay]
    return np.flatnonzero(hull)
