# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of the original surface: its vertices and the middles of its faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Floats, Indices, Integers
from ..arrays.vectors import dot, face_normals, unit


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a surface.

    Attributes
    ----------
    points : (3, s) float64
        By columns.
    normals : (3, s) float64
        Of a face at its middle; zero at a vertex, where the surface may have a crease.
    weights : (s,) float64
        Areas that they stand for, times what matters there; those of the middles and those of the
        vertices are one on the average of the vertices.
    owner : (s,) intp
        A vertex near which the nearest face is sought.
    vertices : int
        How many of the first samples are vertices.
    """

    points: Floats
    normals: Floats
    weights: Floats
    owner: Indices
    vertices: int

    @classmethod
    def of_surface(cls, points: Floats, faces: Integers, factor: Floats) -> Samples:
        """Return all vertices and all middles of faces, in O(n + m).

        Parameters
        ----------
        points : (n, 3) float64
        faces : (m, 3) int
        factor : (n,) float64
            Multiplies the areas of vertices.
        """
        double = face_normals(points, faces)
        size = np.sqrt(dot(double, double))
        corners = np.ascontiguousarray(faces.T)
        at_vertices = np.zeros(len(points))
        middle, at_middles = np.zeros((3, len(faces))), np.zeros(len(faces))
        columns = np.ascontiguousarray(points.T)
        for corner in corners:
            at_vertices += np.bincount(corner, size, len(points))
            middle += columns.take(corner, axis=1)
            at_middles += factor.take(corner)
        at_vertices *= factor
        at_middles *= size
        total = at_vertices.sum() or 1.0  # of the middles, too
        return cls(
            np.concatenate([columns, middle / 3.0], axis=1),
            np.concatenate([np.zeros_like(columns), unit(double).T], axis=1),
            np.concatenate([at_vertices, at_middles]) * (len(points) / total),
            np.concatenate([np.arange(len(points)), corners[0]]),
            len(points),
        )

    def standing_for(
        self, faces: Indices, source: Indices, *, kept: bool, middles: float, step: int
    ) -> Samples:
        """Return the samples for a cut.

        Parameters
        ----------
        faces : (k, 3) intp
            Faces of the cut.
        source : (n,) intp
            Kept vertex that stands for each; samples where it has no face are left out.
        kept : bool
            Whether kept vertices are samples, too.
        middles : float
            Share of the weight that the middles of faces have. Details are made of small faces,
            whose vertices lie close: less favours them.
        step : int
            Of so many middles one is taken.
        """
        used = np.zeros(len(source), dtype=bool)
        used[faces] = True
        at_vertices = used[source]
        if not kept:
            at_vertices &= source != np.arange(len(source))
        vertices = np.flatnonzero(at_vertices)
        centres = np.arange(self.vertices, len(self.owner), step)
        centres = centres[used[source[self.owner[centres]]]]
        chosen = np.concatenate([vertices, centres])
        weights = self.weights.take(chosen)
        weights[: len(vertices)] *= 1.0 - middles
        weights[len(vertices) :] *= middles * step
        return Samples(
            self.points.take(chosen, axis=1),
            self.normals.take(chosen, axis=1),
            weights,
            source.take(self.owner.take(chosen)),
            len(vertices),
        )
