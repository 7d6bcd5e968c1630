# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of the original surface, and the face of a cut that each lies nearest to.

The samples are the vertices of the original with the areas they stand for. A sample is looked for
among the faces round the kept vertex that stands for it, so that nothing is searched over the whole
mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.rows import row_entries
from ..arrays.types import Floats, Indices, Integers
from ..arrays.vectors import dot, face_normals, sum_by_label, unit

PAIR_BLOCK = 1 << 13
"""Samples whose faces are looked at together: some ten arrays of six faces a sample."""
FLAT = 1e-12
"""Squared sine of the angle of a triangle's sides, below which it counts as a line."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a surface.

    Attributes
    ----------
    points, normals : (s, 3) float64
        Normals are unit vectors, or zero.
    weights : (s,) float64
        Areas that they stand for.
    owner : (s,) intp
        Kept vertex that stands for each.
    """

    points: Floats
    normals: Floats
    weights: Floats
    owner: Indices

    @classmethod
    def of_vertices(cls, points: Floats, faces: Integers) -> Samples:
        """Return all vertices of a mesh, each its own owner, weighing one on the average."""
        double = face_normals(points, faces)
        size = np.sqrt(dot(double, double))
        normals, areas = np.zeros((len(points), 3)), np.zeros(len(points))
        for corner in faces.T:
            normals += sum_by_label(double, corner, len(points))
            areas += np.bincount(corner, size, len(points))
        mean = areas.mean() if areas.any() else 1.0
        return cls(points, unit(normals), areas / mean, np.arange(len(points)))

    def standing_for(self, faces: Indices, source: Indices) -> Samples:
        """Return those vertices that a cut removes, as samples for its faces.

        Parameters
        ----------
        faces : (k, 3) intp
            Faces of the cut.
        source : (n,) intp
            Kept vertex that stands for each.
        """
        used = np.zeros(len(source), dtype=bool)
        used[faces] = True
        away = np.flatnonzero(used[source] & (source != np.arange(len(source))))
        return Samples(
            self.points.take(away, axis=0),
            self.normals.take(away, axis=0),
            self.weights.take(away),
            source.take(away),
        )


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles, and what a distance to them needs.

    Attributes
    ----------
    start, first, second : (t, 3) float64
        A corner, and the sides from there.
    squares : (t, 3) float64
        Products of the sides: first with first, with second, second with second.
    normals : (t, 3) float64
        Unit normals; zero where a triangle has no area.
    """

    start: Floats
    first: Floats
    second: Floats
    squares: Floats
    normals: Floats

    @classmethod
    def of(cls, points: Floats, faces: Integers) -> Triangles:
        """Return the triangles of faces (t, 3)."""
        a, b, c = (points.take(corner, axis=0) for corner in faces.T)
        first, second = b - a, c - a
        squares = np.stack([dot(first, first), dot(first, second), dot(second, second)], axis=1)
        return cls(a, first, second, squares, unit(face_normals(points, faces)))

    def square_distances(self, queries: Floats, chosen: Integers) -> Floats:
        """Return the squared distance (q,) of each query (q, 3) to its triangle (q,)."""
        offset, along, other, squares = self._measure(queries, chosen)
        p, m, q = squares
        nearest = offset - _descend(along, p)
        np.minimum(nearest, offset - _descend(other, q), out=nearest)
        across = other - along + p - m
        far = offset - 2.0 * along + p - _descend(across, p + q - 2.0 * m)
        np.minimum(nearest, far, out=nearest)
        area = p * q - m * m
        u, v = q * along - m * other, p * other - m * along
        inside = (u > 0.0) & (v > 0.0) & (u + v < area) & (area > FLAT * p * q)
        height = dot(queries - self.start.take(chosen, axis=0), self.normals.take(chosen, axis=0))
        return np.where(inside, height * height, np.maximum(nearest, 0.0))

    def _measure(
        self, queries: Floats, chosen: Integers
    ) -> tuple[Floats, Floats, Floats, tuple[Floats, Floats, Floats]]:
        """Return the squared offset from the start, and its products with both sides."""
        offset = queries - self.start.take(chosen, axis=0)
        along = dot(offset, self.first.take(chosen, axis=0))
        other = dot(offset, self.second.take(chosen, axis=0))
        p, m, q = self.squares.take(chosen, axis=0).T
        return dot(offset, offset), along, other, (p, m, q)


def _descend(along: Floats, square: Floats) -> Floats:
    """Return by how much a squared distance falls on the way along a side, to the nearest point."""
    share = np.divide(along, square, out=np.zeros_like(along), where=square > 0.0)
    np.clip(share, 0.0, 1.0, out=share)
    return share * (2.0 * along - share * square)


@dataclass(eq=False)
class Assignment:
    """The face that each sample lies nearest to.

    Attributes
    ----------
    face : (s,) intp
    square : (s,) float64
        Squared distance to it.
    cosine : (s,) float64
        Of the angle between the normals of sample and face.
    count : int
        Number of faces.
    """

    face: Indices
    square: Floats
    cosine: Floats
    count: int

    @classmethod
    def of(cls, samples: Samples, points: Floats, faces: Indices) -> Assignment:
        """Look among the faces round each sample's kept vertex, which must have some."""
        triangles = Triangles.of(points, faces)
        around = np.argsort(faces.ravel(), kind="stable") // 3
        bounds = np.zeros(len(points) + 1, dtype=np.intp)
        np.cumsum(np.bincount(faces.ravel(), minlength=len(points)), out=bounds[1:])
        result = cls(
            np.empty(len(samples.points), dtype=np.intp),
            np.empty(len(samples.points)),
            np.empty(len(samples.points)),
            len(faces),
        )

        def search(start: int, stop: int) -> None:
            block = slice(start, stop)
            places, ends = row_entries(bounds, samples.owner[block])
            size = np.diff(ends)
            face = around[places]
            queries = np.repeat(samples.points[block], size, axis=0)
            square = triangles.square_distances(queries, face)
            least = np.minimum.reduceat(square, ends[:-1])
            hit = np.flatnonzero(square == np.repeat(least, size))
            first = hit[np.searchsorted(hit, ends[:-1])]
            result.put(block, samples, triangles, face[first], least)

        run_blocks(search, len(samples.points), size=PAIR_BLOCK)
        return result

    def put(
        self,
        where: slice | Indices,
        samples: Samples,
        triangles: Triangles,
        face: Indices,
        square: Floats,
    ) -> None:
        """Assign samples to faces, at squared distances."""
        self.face[where], self.square[where] = face, square
        self.cosine[where] = dot(samples.normals[where], triangles.normals.take(face, axis=0))

    def by_face(self) -> tuple[Indices, Indices]:
        """Return the samples in the order of their faces, and the bounds of each face's."""
        bounds = np.zeros(self.count + 1, dtype=np.intp)
        np.cumsum(np.bincount(self.face, minlength=self.count), out=bounds[1:])
        return np.argsort(self.face, kind="stable"), bounds
