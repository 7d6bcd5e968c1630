# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that elimination works on: a mesh's faces, and a cloud's triangles."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.edges import sort_rows
from ..arrays.types import Integers, Ints
from ..input.geometry import Geometry
from ..method.graph import Graph, build_graph
from ..parameters import Parameters
from ..progress import SILENT, Progress

GUESSED_BORDER = 0.1
"""Factor on the weight of a cloud's borders: many are only gaps between stars that disagree."""


def elimination_surface(
    geometry: Geometry, graph: Graph, parameters: Parameters, progress: Progress = SILENT
) -> tuple[Ints, tuple[Ints, Ints]]:
    """Return triangles over all vertices, and links for vertices that no triangle uses.

    Faces stay as they are. Points that no face uses get the triangles on which their stars agree;
    where no two stars agree, a point is linked to its star.

    Returns
    -------
    (m, 3) int32
    ((l,) int32, (l,) int32)
        Ends of the links, each once.
    """
    count = len(geometry.points)
    faces = geometry.faces.astype(np.int32)
    stars = graph.stars
    if stars is None and np.bincount(faces.ravel(), minlength=count).min(initial=1) == 0:
        surface = dataclasses.replace(parameters, graph="surface", level=1)
        stars = build_graph(geometry, surface, progress.part(0.0, 0.7)).stars
    if stars is None:
        nothing = np.empty(0, dtype=np.int32)
        return faces, (nothing, nothing)
    faces = np.concatenate(
        [faces, star_triangles(stars, geometry.priority, progress.part(0.7, 0.9))]
    )
    bare = np.bincount(faces.ravel(), minlength=count) == 0
    row, slot = np.nonzero((stars >= 0) & bare[:, None])
    ends = np.sort(np.column_stack([row, stars[row, slot]]).astype(np.int32), axis=1)
    low, high = np.unique(ends, axis=0).T
    progress(1.0)
    return faces, (np.ascontiguousarray(low), np.ascontiguousarray(high))


def star_triangles(
    stars: Ints, priority: Integers | None = None, progress: Progress = SILENT
) -> Ints:
    """Return the triangles that at least two of their corners have in their stars.

    Each star is a fan of triangles round its vertex. Where the stars agree they form a surface;
    where they do not, those of one vertex only are left out.

    Parameters
    ----------
    stars : (n, w) int32
        Neighbours of each vertex by angle, filled up with -1 (`Graph.stars`).
    priority : (n,) int, optional
        A permutation by which corners and triangles are sorted, in place of the vertices' numbers.

    Returns
    -------
    (m, 3) int32
        Corners in ascending order: the sides of the surface are not told apart.
    """
    number = np.arange(len(stars)) if priority is None else priority
    size = np.count_nonzero(stars >= 0, axis=1)
    # Two neighbours make one triangle, three or more close the fan.
    bounds = np.concatenate([[0], np.cumsum(np.where(size > 2, size, size == 2))])
    corners = np.empty((bounds[-1], 3), dtype=np.int32)

    def spread_fans(start: int, stop: int) -> None:
        block, width = stars[start:stop], size[start:stop]
        row, slot = np.nonzero(block >= 0)
        used = (slot + 1 < width[row]) | (width[row] > 2)
        row, slot = row[used], slot[used]
        after = block[row, np.where(slot + 1 < width[row], slot + 1, 0)]
        fan = np.column_stack([row + start, block[row, slot], after])
        corners[bounds[start] : bounds[stop]] = np.sort(number.take(fan), axis=1)

    run_blocks(spread_fans, len(stars), progress.part(0.0, 0.5))
    order, same = sort_rows(corners, len(stars))
    first_of_several = same & ~np.append(False, same[:-1])
    vertex_of = np.argsort(number).astype(np.int32)
    surface: Ints = vertex_of.take(corners.take(order[:-1][first_of_several], axis=0))
    return surface
