# SPDX-License-Identifier: GPL-3.0-or-later
"""Search of the nearest face: groups of queries, then single ones, down a tree of boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..arrays.blocks import BLOCK, run_blocks
from ..arrays.types import Floats, Indices
from ..arrays.vectors import dot
from ..progress import SILENT, Progress
from .bounding_boxes import Boxes, build_boxes, children, cut_long_triangles
from .triangles import triangle_distances

_GROUP = 16
"""Queries that go down the tree together as long as boxes are larger than their group."""

_SLAB = 4 * BLOCK
"""Queries that are sorted into groups by one tree."""

_GROUPS = 128
"""Groups in a block: a few hundredths of a second for a scan."""

_PAIRS = 32768
"""Pairs of a query and a box that are looked at together: temporaries about the size of a cache."""


def lower_to_faces(
    queries: Floats, best: Floats, corners: Floats, progress: Progress = SILENT
) -> Floats:
    """Return the smaller of the distances `best` and those to the nearest triangles.

    Parameters
    ----------
    queries : (q, 3) float64
        At least one.
    best : (q,) float64
        Finite.
    corners : (m, 3, 3) float64
        Triangles, at least one.

    Returns
    -------
    (q,) float64
    """
    groups = _Groups.of(queries, progress.part(0.0, 0.05))
    queries, lowest = queries[groups.order], best[groups.order]
    most = 4 * (len(corners) + len(queries))
    pieces, triangle = cut_long_triangles(corners, most, progress.part(0.05, 0.1))
    tree = cKDTree(pieces.mean(axis=1), balanced_tree=False)
    progress(0.15)

    def look_at_nearest_centre(start: int, stop: int) -> None:
        block = slice(start, stop)
        piece = np.asarray(tree.query(queries[block])[1])
        distance = triangle_distances(queries[block], corners[triangle[piece]])
        lowest[block] = np.minimum(lowest[block], distance)

    run_blocks(look_at_nearest_centre, len(queries), progress.part(0.15, 0.3))
    order = np.asarray(tree.indices)
    levels = build_boxes(pieces[order], progress.part(0.3, 0.5))
    reach = groups.radii + np.maximum.reduceat(lowest, groups.bounds[:-1])
    search = _Search(queries, lowest, groups, reach, corners, triangle[order], levels)
    run_blocks(search.run, len(groups.radii), progress.part(0.5, 1.0), _GROUPS)
    result = np.empty_like(lowest)
    result[groups.order] = lowest
    return result


@dataclass(frozen=True, eq=False)
class _Groups:
    """Queries that lie together.

    Attributes
    ----------
    order : (q,) intp
        Queries in the order of a k-d tree.
    bounds : (g + 1,) intp
        Bounds of each group in `order`.
    centres : (g, 3) float64
    radii : (g,) float64
    """

    order: Indices
    bounds: Indices
    centres: Floats
    radii: Floats

    @classmethod
    def of(cls, queries: Floats, progress: Progress) -> _Groups:
        """Sort queries into groups of `_GROUP`."""
        # Slabs across the longest side first: a tree of a million queries would take half a
        # second without an ear for a cancel.
        order = np.argsort(queries[:, np.ptp(queries, axis=0).argmax()], kind="stable")

        def sort_slab(start: int, stop: int) -> None:
            slab = order[start:stop]
            tree = cKDTree(queries[slab], _GROUP, balanced_tree=False)
            order[start:stop] = slab[tree.indices]

        run_blocks(sort_slab, len(queries), progress, _SLAB)
        starts = np.arange(0, len(queries), _GROUP)
        bounds = np.append(starts, len(queries))
        sorted_ = queries[order]
        low, high = np.minimum.reduceat(sorted_, starts), np.maximum.reduceat(sorted_, starts)
        centres = (low + high) / 2
        away = sorted_ - np.repeat(centres, np.diff(bounds), axis=0)
        radii = np.sqrt(np.maximum.reduceat(dot(away, away), starts))
        return cls(order, bounds, centres, radii)

    def members(self, groups: Indices) -> tuple[Indices, Indices]:
        """Return the positions of all queries of groups, and the row of each one's group."""
        size = np.diff(self.bounds)[groups]
        row = np.repeat(np.arange(len(groups)), size)
        first = np.cumsum(size) - size
        return self.bounds[groups][row] + np.arange(len(row)) - first[row], row


@dataclass(frozen=True, eq=False)
class _Search:
    """What a search needs to know; `lowest` is what it lowers.

    Attributes
    ----------
    queries : (q, 3) float64
        In the order of `groups`.
    lowest : (q,) float64
    groups : _Groups
    reach : (g,) float64
        No face farther from the centre of the group than this matters to its queries.
    corners : (m, 3, 3) float64
    triangle : (p,) intp
        The triangle in each box of the first level.
    levels : list of Boxes
    """

    queries: Floats
    lowest: Floats
    groups: _Groups
    reach: Floats
    corners: Floats
    triangle: Indices
    levels: list[Boxes]

    def run(self, start: int, stop: int) -> None:
        """Lower the distances of the groups from `start` to `stop`.

        Pairs of a group, or of a query, and a box wait on a stack in portions, which bounds the
        memory and lets the first portions lower the distances for the next ones.
        """
        top = len(self.levels) - 1
        roots = len(self.levels[top].centres)
        group, box = np.divmod(np.arange(start * roots, stop * roots), roots)
        stack: list[_Portion] = []
        _push(stack, top, True, group, box)
        while stack:
            level, grouped, who, box = stack.pop()
            if grouped:
                who, box = self._step_groups(stack, level, who, box)
            else:
                square = self.levels[level].square_distances(self.queries[who], box)
                near = square < self.lowest[who] ** 2
                who, box = who[near], box[near]
            if level > 0:
                child, parent = children(box, len(self.levels[level - 1].centres))
                _push(stack, level - 1, grouped, who[parent], child)
            elif not grouped:
                corners = self.corners[self.triangle[box]]
                distance = triangle_distances(self.queries[who], corners)
                np.minimum.at(self.lowest, who, distance)

    def _step_groups(
        self, stack: list[_Portion], level: int, group: Indices, box: Indices
    ) -> tuple[Indices, Indices]:
        """Return pairs to go on with; push single queries where boxes are smaller than groups."""
        boxes, groups = self.levels[level], self.groups
        square = boxes.square_distances(groups.centres[group], box)
        near = square < self.reach[group] ** 2
        group, box = group[near], box[near]
        # The middle length, since slivers and fans have narrow boxes.
        width = np.sort(boxes.halves[box], axis=1)[:, 1]
        part = (width < groups.radii[group]) | (level == 0)
        query, row = groups.members(group[part])
        _push(stack, level, False, query, box[part][row])
        return group[~part], box[~part]


_Portion = tuple[int, bool, Indices, Indices]
"""Level, whether in groups, groups or queries, boxes."""


def _push(stack: list[_Portion], level: int, grouped: bool, who: Indices, box: Indices) -> None:
    """Put pairs on the stack in portions."""
    for start in range(0, len(who), _PAIRS):
        block = slice(start, start + _PAIRS)
        stack.append((level, grouped, who[block], box[block]))
