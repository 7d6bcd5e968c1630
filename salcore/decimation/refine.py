# SPDX-License-Identifier: GPL-3.0-or-later
"""A cut is improved before it is handed over: edges are flipped to where the original lies."""

from __future__ import annotations

import numpy as np

from ..arrays.edges import edge_key, pairs_at_edges
from ..arrays.types import Floats, Indices, Integers, Keys, Mask
from .flips import Quads, gains, independent
from .samples import Assignment, Samples, Triangles

ROUNDS = 8
STIFFNESS = 0.0
LEAST_GAIN = 1e-15


def fixed_edges(
    faces: Indices,
    source: Indices,
    seams: Integers,
    protect: Mask,
    wedges: Indices | None = None,
) -> Keys:
    """Return the keys (f,) of the edges of a cut that may not be flipped, ascending.

    Parameters
    ----------
    faces : (k, 3) intp
        Faces of the cut.
    source : (n,) intp
        Kept vertex that stands for each.
    seams : (s, 2) int
        Edges of the original: what is left of them stays.
    protect : (n,) bool
        Edges between two of these vertices stay.
    wedges : (k, 3) int, optional
        Wedges of the corners: edges stay on whose two sides they differ.
    """
    low, high = source[seams.astype(np.intp)].T
    keys = [edge_key(low, high, len(source))[low != high]]
    if protect.any():
        for start, end in zip(faces.T, np.roll(faces, -1, axis=1).T, strict=True):
            both = protect[start] & protect[end]
            keys.append(edge_key(start[both], end[both], len(source)))
    if wedges is not None:
        edges, edge, *ends = pairs_at_edges(faces, np.arange(len(faces)), len(source))
        apart = np.zeros(len(edge), dtype=bool)
        for one, other in ends:
            apart |= wedges.ravel()[one] != wedges.ravel()[other]
        edge = edge[apart]
        keys.append(edge_key(edges.low[edge], edges.high[edge], len(source)))
    return np.unique(np.concatenate(keys))


def refine_faces(
    points: Floats, faces: Indices, corners: Indices, samples: Samples, fixed: Keys
) -> tuple[Indices, Indices]:
    """Flip edges of a cut where that brings it nearer to its original.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (k, 3) intp
    corners : (k, 3) intp
        Corner of the original that each corner comes from.
    samples : Samples
        Of the original.
    fixed : (f,) int64
        Keys of edges that stay, ascending.

    Returns
    -------
    faces, corners : (k, 3) intp
        A flip puts the two new faces in place of the old ones, and moves their corners along.

    Notes
    -----
    O(s + k log k) for s samples. In each round the flips that gain most among their neighbours are
    done, after that only edges round these are looked at. The topology stays.
    """
    faces, corners = faces.copy(), corners.copy()
    if not len(faces) or not len(samples.points):
        return faces, corners
    at = Assignment.of(samples, points, faces)
    touched = np.ones(len(faces), dtype=bool)
    for _ in range(ROUNDS):
        quads, keys = Quads.find(faces, len(points), fixed)
        quads = quads.take(touched[quads.left // 3] | touched[quads.right // 3])
        quads = quads.take(quads.legal(points, keys))
        gain = gains(quads, points, samples, at, STIFFNESS)
        good = np.flatnonzero(gain > LEAST_GAIN)
        if not len(good):
            break
        quads = quads.take(good)
        touched[:] = False
        touched[quads.left // 3] = touched[quads.right // 3] = True
        flips = quads.take(independent(quads, gain[good], len(points)))
        _follow(flips, points, samples, at)
        left, right = flips.left // 3, flips.right // 3
        faces[left], faces[right] = flips.flipped()
        corners[left], corners[right] = flips.flipped_corners(corners)
    return faces, corners


def _follow(flips: Quads, points: Floats, samples: Samples, at: Assignment) -> None:
    """Assign the samples of faces that are flipped to the nearer of the new ones."""
    one, other = flips.flipped()
    count = len(one)
    left, right = flips.left // 3, flips.right // 3
    flip = np.full(at.count, -1)
    flip[left] = flip[right] = np.arange(count)
    sample = np.flatnonzero(flip[at.face] >= 0)
    flip = flip[at.face[sample]]
    both = Triangles.of(points, np.concatenate([one, other]))
    queries = samples.points.take(sample, axis=0)
    square, second = (both.square_distances(queries, flip + k * count) for k in (0, 1))
    nearer = second < square
    at.put(sample, samples, both, flip + count * nearer, np.where(nearer, second, square))
    at.face[sample] = np.where(nearer, right[flip], left[flip])
