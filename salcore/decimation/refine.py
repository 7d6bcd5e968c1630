# SPDX-License-Identifier: GPL-3.0-or-later
"""A cut is improved before it is handed over: edges are flipped to where the original lies."""

from __future__ import annotations

import numpy as np

from ..arrays.edges import edge_key, pairs_at_edges
from ..arrays.types import Floats, Indices, Integers, Keys, Mask
from ..progress import SILENT, Progress
from .flips import FlipMesh, Quads, gains, independent, nearer_of_two
from .nearest_faces import Assignment, Triangles
from .samples import Samples

ROUNDS = 6
"""Rounds of flips; the first three gain nine tenths of what there is to gain."""
STIFFNESS = 0.02
"""Weight of the squared differences of normals, times the area of two faces, against the squared
distances: more lowers the angles between the faces and the original, and raises the distances."""
MIDDLES, MIDDLE_STEP = 0.3, 4
"""Share of the weight of samples that the middles of faces have, of which there is one in so many:
most of the time goes into samples."""
LEAST_GAIN = 1e-10
"""Gain of a flip, as a share of its area, up to which it might be rounding."""


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
    mesh: FlipMesh,
    points: Floats,
    samples: Samples,
    source: Indices,
    progress: Progress = SILENT,
) -> None:
    """Flip edges of a cut where that brings it nearer to its original.

    Parameters
    ----------
    mesh : FlipMesh
        The cut.
    points : (n, 3) float64
        Of the original.
    samples : Samples
        Of the original.
    source : (n,) intp
        Kept vertex that stands for each vertex of the original.
    progress : Progress, optional

    Notes
    -----
    O(s + k log k) for s samples and k faces. In each round the flips that gain most among their
    neighbours are done; after that only edges round these are looked at. The topology stays.
    """
    chosen = samples.standing_for(mesh.faces, source, kept=False, middles=MIDDLES, step=MIDDLE_STEP)
    at = Assignment.of(chosen, points, mesh.faces)
    progress(0.4)
    flip_edges(mesh, points, chosen, at, ROUNDS, progress.part(0.4, 1.0))


def flip_edges(
    mesh: FlipMesh,
    points: Floats,
    samples: Samples,
    at: Assignment,
    rounds: int,
    progress: Progress = SILENT,
    flatness: float = 0.0,
) -> None:
    """Flip edges of a mesh over points (n, 3), and assign samples anew along with it.

    `flatness` weighs the angle between the faces at an edge, times their area, against the samples
    of a face.
    """
    count = len(mesh.faces)
    mesh.forget()
    touched = np.ones(count, dtype=bool)
    sides, gain = np.empty(0, dtype=np.intp), np.empty(0)
    for turn in range(rounds):
        progress(turn / rounds)
        quads = mesh.quads(mesh.sides_of(touched))
        quads = quads.take(mesh.legal(quads, points))
        fresh = gains(quads, points, samples, at, STIFFNESS, flatness, count)
        area = Triangles.of(points, mesh.faces[quads.left // 3]).areas()
        good = fresh > LEAST_GAIN * area
        # Flips that waited for better ones beside them stay good where nothing has changed.
        waiting = ~(touched[sides // 3] | touched[mesh.twins[sides] // 3])
        sides = np.concatenate([sides[waiting], quads.left[good]])
        gain = np.concatenate([gain[waiting], fresh[good]])
        quads = mesh.quads(sides)
        legal = mesh.legal(quads, points)
        quads, sides, gain = quads.take(legal), sides[legal], gain[legal]
        if not len(sides):
            break
        flips = quads.take(independent(quads, gain, len(points)))
        _follow(flips, points, samples, at, count)
        mesh.flip(flips)
        touched[:] = False
        touched[flips.left // 3] = touched[flips.right // 3] = True


def _follow(flips: Quads, points: Floats, samples: Samples, at: Assignment, count: int) -> None:
    """Assign the samples of faces that are flipped to the nearer of the new ones."""
    faces = np.concatenate([flips.left, flips.right]) // 3
    flip = np.full(count, -1)
    flip[faces] = np.tile(np.arange(len(flips.left)), 2)
    sample = np.flatnonzero(flip[at.face] >= 0)
    both = Triangles.of(points, np.concatenate(flips.flipped()))
    queries = samples.points.take(sample, axis=1)
    square, chosen = nearer_of_two(both, queries, flip[at.face[sample]], len(flips.left))
    at.put(sample, samples, both, chosen, square, faces[chosen])
