# SPDX-License-Identifier: GPL-3.0-or-later
"""A tree of oriented bounding boxes around triangles, level by level in arrays.

Slivers and fans are why the boxes are turned: a box along the axes around a long oblique triangle
holds mostly air, and every query would look into thousands of such boxes.

References
----------
Gottschalk, Lin, Manocha: OBBTree, a hierarchical structure for rapid interference detection,
SIGGRAPH 1996.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import BLOCK, run_blocks
from ..arrays.types import Floats, Indices
from ..arrays.vectors import cross, dot, unit
from ..progress import SILENT, Progress
from .triangles import square_edges

BRANCHES = 8
"""Children of a box. Fewer mean more rounds, more mean more boxes looked at in vain."""

_LONG = 64.0
"""Square of a long edge over the mean area of all triangles: such triangles are cut."""

_SLACK = 16 * float(np.finfo(np.float64).eps)
"""Share of the coordinates by which boxes are widened, so that rounding leaves no corner out."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """Oriented boxes.

    Attributes
    ----------
    centres : (m, 3) float64
    axes : (m, 3, 3) float64
        Unit vectors, one a row.
    halves : (m, 3) float64
        Half of the length along each axis.
    """

    centres: Floats
    axes: Floats
    halves: Floats

    def fill(self, start: int, stop: int, centres: Floats, axes: Floats, halves: Floats) -> None:
        """Set the boxes from `start` to `stop`."""
        self.centres[start:stop], self.axes[start:stop] = centres, axes
        self.halves[start:stop] = halves

    def square_distances(self, points: Floats, boxes: Indices) -> Floats:
        """Return the squared distance (p,) of each of the points (p, 3) to its box."""
        offsets = points - self.centres[boxes]
        outside = np.abs(np.einsum("pad,pd->pa", self.axes[boxes], offsets))
        outside -= self.halves[boxes]
        np.maximum(outside, 0.0, out=outside)
        return dot(outside, outside)


def cut_long_triangles(
    corners: Floats, most: int, progress: Progress = SILENT
) -> tuple[Floats, Indices]:
    """Cut triangles with long edges into shorter ones, the longest first.

    Parameters
    ----------
    corners : (m, 3, 3) float64
    most : int
        Number of pieces that is not passed, unless there are more triangles already.

    Returns
    -------
    pieces : (p, 3, 3) float64
        Triangles that together cover the given ones.
    triangle : (p,) intp
        The triangle that each piece is of.

    Notes
    -----
    Each round halves all edges longer than half of the longest. Triangles of about the size that
    their number and the whole area lead to expect stay whole.
    """
    squares, areas = np.empty(len(corners)), np.empty(len(corners))

    def measure(start: int, stop: int) -> None:
        block = corners[start:stop]
        squares[start:stop] = square_edges(block).max(axis=1)
        normals = cross(block[:, 1] - block[:, 0], block[:, 2] - block[:, 0])
        areas[start:stop] = np.sqrt(dot(normals, normals)) / 2

    run_blocks(measure, len(corners), progress)
    pieces, triangle = corners, np.arange(len(corners))
    while True:
        limit = max(float(squares.max()) / 4, _LONG * float(areas.mean()))
        long = np.flatnonzero(squares > limit)
        if not len(long) or len(pieces) + len(long) > most:
            return pieces, triangle
        edge = square_edges(pieces[long]).argmax(axis=1)
        first, second, third = (pieces[long, (edge + k) % 3] for k in range(3))
        middle = (first + second) / 2
        one = np.stack([first, middle, third], axis=1)
        other = np.stack([middle, second, third], axis=1)
        pieces = np.concatenate([pieces, other])
        pieces[long] = one
        squares[long] = square_edges(one).max(axis=1)
        squares = np.concatenate([squares, square_edges(other).max(axis=1)])
        triangle = np.concatenate([triangle, triangle[long]])


def build_boxes(corners: Floats, progress: Progress = SILENT) -> list[Boxes]:
    """Return boxes around triangles, around every eight of these boxes, and so on.

    Parameters
    ----------
    corners : (m, 3, 3) float64
        Triangles in an order in which neighbours are near, such as that of a k-d tree.

    Returns
    -------
    list of Boxes
        From one box a triangle to at most eight boxes. The children of box b of a level are the
        boxes 8 b to 8 b + 7 of the level before, as far as there are so many.

    Notes
    -----
    O(m) time and memory.
    """
    levels = [_empty(len(corners))]

    def enclose_triangles(start: int, stop: int) -> None:
        levels[0].fill(start, stop, *_around_triangles(corners[start:stop]))

    run_blocks(enclose_triangles, len(corners), progress.part(0.0, 0.7))
    while len(levels[-1].centres) > BRANCHES:
        levels.append(_enclose_boxes(levels[-1], progress.part(0.7, 1.0)))
    return levels


def _empty(count: int) -> Boxes:
    return Boxes(np.empty((count, 3)), np.empty((count, 3, 3)), np.empty((count, 3)))


def _enclose_boxes(boxes: Boxes, progress: Progress) -> Boxes:
    """Return a box around every eight boxes."""
    count = len(boxes.centres)
    parents = _empty(-(-count // BRANCHES))

    def enclose(start: int, stop: int) -> None:
        inner = slice(BRANCHES * start, min(BRANCHES * stop, count))
        of = boxes.centres[inner], boxes.axes[inner], boxes.halves[inner]
        parents.fill(start, stop, *_around_boxes(*of))

    run_blocks(enclose, len(parents.centres), progress, BLOCK // BRANCHES)
    return parents


def _around_triangles(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Return centres, axes and halves of boxes along the longest edge and across it."""
    row = np.arange(len(corners))
    longest = square_edges(corners).argmax(axis=1)
    first, second, third = (corners[row, (longest + k) % 3] for k in range(3))
    along = unit(second - first)
    along[~along.any(axis=1)] = (1.0, 0.0, 0.0)
    across = _perpendicular(third - first, along)
    flat = ~across.any(axis=1)  # no area: any direction across will do
    least = np.eye(3)[np.abs(along[flat]).argmin(axis=1)]
    across[flat] = _perpendicular(least, along[flat])
    # The third corner lies beside the longest edge, so that this and the height make the box.
    length, height = dot(second - first, along), np.abs(dot(third - first, across))
    high = np.stack([length, height, np.zeros(len(corners))], axis=1)
    axes = np.stack([along, across, cross(along, across)], axis=1)
    return _boxes(first, axes, np.zeros_like(high), high)


def _perpendicular(vectors: Floats, axes: Floats) -> Floats:
    """Return unit vectors of what `vectors` have across unit vectors `axes`, zero for nothing."""
    across = unit(vectors - dot(vectors, axes)[:, None] * axes)
    return unit(across - dot(across, axes)[:, None] * axes)  # again: rounding in slivers


def _around_boxes(centres: Floats, axes: Floats, halves: Floats) -> tuple[Floats, Floats, Floats]:
    """Return centres, axes and halves of boxes around every eight boxes.

    The axes are the principal ones of the boxes' mass if each box weighs the same.
    """
    starts = np.arange(0, len(centres), BRANCHES)
    size = np.diff(np.append(starts, len(centres)))
    middles = np.add.reduceat(centres, starts) / size[:, None]
    offsets = centres - np.repeat(middles, size, axis=0)
    arms = halves[:, :, None] * axes
    spread = np.matmul(arms.transpose(0, 2, 1), arms)
    spread += offsets[:, :, None] * offsets[:, None, :]
    principal = np.linalg.eigh(np.add.reduceat(spread, starts))[1].transpose(0, 2, 1)
    outer = np.repeat(principal, size, axis=0)
    centre = np.matmul(outer, offsets[:, :, None])[:, :, 0]
    reach = np.abs(np.matmul(outer, arms.transpose(0, 2, 1))).sum(axis=2)
    low, high = (
        np.minimum.reduceat(centre - reach, starts),
        np.maximum.reduceat(centre + reach, starts),
    )
    return _boxes(middles, principal, low, high)


def _boxes(
    origins: Floats, axes: Floats, low: Floats, high: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return centres, axes and halves of boxes from `low` to `high` along axes from an origin."""
    centres = origins + np.einsum("mad,ma->md", axes, (low + high) / 2)
    size = np.abs(centres).max(axis=1, keepdims=True) + (high - low).max(axis=1, keepdims=True)
    return centres, axes, (high - low) / 2 + _SLACK * size


def children(parents: Indices, count: int) -> tuple[Indices, Indices]:
    """Return, for boxes (p,), their children among `count`, and whose child each is in (p,)."""
    child = (BRANCHES * parents[:, None] + np.arange(BRANCHES)).ravel()
    parent = np.repeat(np.arange(len(parents)), BRANCHES)
    there = child < count
    return child[there], parent[there]
