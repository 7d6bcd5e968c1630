# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that elimination works on: a mesh's faces, and a cloud's triangles."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry
from .graph import Graph, build_graph
from .parameters import Parameters
from .progress import Steps
from .triangles import star_triangles

Ints = NDArray[np.int32]


GUESSED_BORDER = 0.1
"""Factor on the weight of a cloud's borders: many are only gaps between stars that disagree."""


def elimination_surface(
    geometry: Geometry, graph: Graph, parameters: Parameters
) -> Steps[tuple[Ints, tuple[Ints, Ints]]]:
    """Return triangles over all vertices, and links for vertices that no triangle uses, with rests.

    Faces stay as they are. Points that no face uses get the triangles on which their stars agree;
    where no two stars agree, a point is linked to its star.

    Returns
    -------
    (m, 3) int32
    ((l,) int32, (l,) int32)
        Ends of the links, each once.
    """
    count = len(geometry.points)
    stars = graph.stars
    if stars is None and np.bincount(geometry.faces.ravel(), minlength=count).min(initial=1) == 0:
        surface = dataclasses.replace(parameters, graph="surface", level=1)
        stars = (yield from build_graph(geometry, surface)).stars
    faces = geometry.faces.astype(np.int32)
    yield None
    if stars is None:
        nothing = np.empty(0, dtype=np.int32)
        return faces, (nothing, nothing)
    faces = np.concatenate([faces, (yield from star_triangles(stars, parameters.workers))])
    yield None
    bare = np.bincount(faces.ravel(), minlength=count) == 0
    yield None
    row, slot = np.nonzero((stars >= 0) & bare[:, None])
    yield None
    ends = np.sort(np.column_stack([row, stars[row, slot]]).astype(np.int32), axis=1)
    low, high = np.unique(ends, axis=0).T
    return faces, (np.ascontiguousarray(low), np.ascontiguousarray(high))
