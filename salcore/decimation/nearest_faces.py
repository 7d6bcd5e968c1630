# SPDX-License-Identifier: GPL-3.0-or-later
"""The face of a cut that each sample of the original lies nearest to.

It is sought among the faces round the kept vertex that stands for the sample, and from there over
the corners of faces, so that nothing is searched over the whole mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import run_blocks
from ..arrays.rows import row_entries
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import cross, dot, unit
from .samples import Samples

SAMPLE_BLOCK = 1 << 11
"""Samples whose faces are looked at together: temporaries about the size of a cache."""
MAX_STEPS = 8
"""Corners that a sample passes on the way to its nearest face."""
FLAT = 1e-12
"""Squared sine of the angle between two sides of a triangle, below which it counts as a line."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles, and what distances to them need.

    Vectors are kept by columns: each array is long, and fetched from as a whole.

    Attributes
    ----------
    start, first, second : (3, t) float64
        A corner, and the sides from there.
    normals : (3, t) float64
        Unit normals; zero where a triangle has no area.
    squares : (3, t) float64
        Products of the sides: first with first, first with second, second with second.
    """

    start: Floats
    first: Floats
    second: Floats
    normals: Floats
    squares: Floats

    @classmethod
    def of(cls, points: Floats, faces: Integers) -> Triangles:
        """Return the triangles of faces (t, 3) over points (n, 3)."""
        columns = [np.empty((3, len(faces))) for _ in range(5)]

        def fill(start: int, stop: int) -> None:
            a, b, c = (points.take(faces[start:stop, k], axis=0) for k in range(3))
            first, second = b - a, c - a
            squares = dot(first, first), dot(first, second), dot(second, second)
            normals = unit(cross(first, second))
            rows = [a.T, first.T, second.T, normals.T, np.stack(squares)]
            for column, row in zip(columns, rows, strict=True):
                column[:, start:stop] = row

        run_blocks(fill, len(faces))
        return cls(*columns)

    def areas(self) -> Floats:
        """Return the areas (t,)."""
        p, m, q = self.squares
        areas: Floats = 0.5 * np.sqrt(np.maximum(p * q - m * m, 0.0))
        return areas

    def square_distances(self, queries: Floats, chosen: Integers) -> Floats:
        """Return the squared distance (q,) of each query (3, q) to its triangle (q,)."""
        foot = _Foot.of(self, queries, chosen)
        result = product(foot.offset, self.normals, chosen) ** 2
        out = np.flatnonzero(~foot.inside)
        sides = foot.square_distances_to_sides(out)
        result[out] = np.maximum(np.minimum(np.minimum(sides[0], sides[1]), sides[2]), 0.0)
        return result

    def project(self, queries: Floats, chosen: Integers) -> tuple[Floats, Mask]:
        """Return barycentric coordinates (3, q) of the nearest points, and which are inside."""
        foot = _Foot.of(self, queries, chosen)
        whole = np.where(foot.inside, foot.area, 1.0)
        u, v = foot.u / whole, foot.v / whole
        out = np.flatnonzero(~foot.inside)
        side = np.argmin(foot.square_distances_to_sides(out), axis=0)
        first, second, third = foot.shares_of_sides(out)
        nothing = np.zeros(len(out))
        u[out] = np.choose(side, [first, nothing, 1.0 - third])
        v[out] = np.choose(side, [nothing, second, third])
        return np.stack([1.0 - u - v, u, v]), foot.inside


def product(vectors: Floats, columns: Floats, chosen: Integers) -> Floats:
    """Return the scalar products (q,) of vectors (3, q) and the chosen of columns (3, t)."""
    result: Floats = vectors[0] * columns[0].take(chosen)
    result += vectors[1] * columns[1].take(chosen)
    result += vectors[2] * columns[2].take(chosen)
    return result


@dataclass(frozen=True, eq=False)
class _Foot:
    """Where queries lie over the planes of their triangles.

    Attributes
    ----------
    offset : (3, q) float64
        From the triangle's start.
    along, other : (q,) float64
        Products of the offset with the first side and the second.
    squares : tuple of (q,) float64
        Those of the triangle.
    area, u, v : (q,) float64
        Coordinates of the foot times `area`: the square of twice the triangle's, or zero if it is
        as good as a line.
    inside : (q,) bool
        Whether the foot is inside the triangle.
    """

    offset: Floats
    along: Floats
    other: Floats
    squares: tuple[Floats, Floats, Floats]
    area: Floats
    u: Floats
    v: Floats
    inside: Mask

    @classmethod
    def of(cls, triangles: Triangles, queries: Floats, chosen: Integers) -> _Foot:
        offset = np.empty((3, len(chosen)))
        for axis in range(3):
            np.subtract(queries[axis], triangles.start[axis].take(chosen), out=offset[axis])
        along = product(offset, triangles.first, chosen)
        other = product(offset, triangles.second, chosen)
        p, m, q = (square.take(chosen) for square in triangles.squares)
        area = p * q
        line = FLAT * area
        area -= m * m
        u, v = q * along - m * other, p * other - m * along
        inside = (u > 0.0) & (v > 0.0) & (u + v < area) & (area > line)
        return cls(offset, along, other, (p, m, q), area, u, v, inside)

    def _sides(self, rows: Indices) -> tuple[tuple[Floats, Floats], ...]:
        """Return for each side the product with the offset from its start, and its square."""
        along, other, p, m, q = (x[rows] for x in (self.along, self.other, *self.squares))
        return (along, p), (other, q), (other - along + p - m, p + q - 2.0 * m)

    def shares_of_sides(self, rows: Indices) -> tuple[Floats, ...]:
        """Return the shares of each side at which its nearest points lie."""
        return tuple(_share(*side) for side in self._sides(rows))

    def square_distances_to_sides(self, rows: Indices) -> tuple[Floats, Floats, Floats]:
        """Return the squared distances of some queries to the three sides."""
        x, y, z = self.offset[:, rows]
        length = x * x + y * y + z * z
        first, second, third = self._sides(rows)
        far = length - 2.0 * first[0] + first[1]
        return length - _descend(*first), length - _descend(*second), far - _descend(*third)


def _descend(along: Floats, square: Floats) -> Floats:
    """Return by how much a squared distance falls along a side, as far as the nearest point."""
    share = _share(along, square)
    return share * (2.0 * along - share * square)


def _share(along: Floats, square: Floats) -> Floats:
    """Return the share of a side at which its nearest point lies."""
    share = np.divide(along, square, out=np.zeros_like(along), where=square > 0.0)
    return np.clip(share, 0.0, 1.0, out=share)


@dataclass(frozen=True, eq=False)
class Assignment:
    """The face that each sample lies nearest to.

    Attributes
    ----------
    face : (s,) intp
    square : (s,) float64
        Squared distance to it.
    cosine : (s,) float64
        Of the angle between the normals of sample and face; zero where there is none.
    """

    face: Indices
    square: Floats
    cosine: Floats

    @classmethod
    def of(cls, samples: Samples, points: Floats, faces: Indices) -> Assignment:
        """Assign samples to the faces (k, 3), of which their owners must have some.

        O(s) time: first the faces round the owner, then, as long as the nearest point is on the
        outline of a face, those round its nearest corner.
        """
        total = len(samples.owner)
        result = cls(np.empty(total, dtype=np.intp), np.empty(total), np.empty(total))
        result._search(samples, points, faces, np.arange(total), afresh=True)
        return result

    def renew(self, samples: Samples, points: Floats, faces: Indices, moved: Mask) -> None:
        """Assign samples anew after points (n,) have moved, from the faces they were nearest to.

        Only those of faces (k, 3) with a corner that has moved are looked at.
        """
        changed = np.asarray(moved[faces].any(axis=1))
        beside = np.flatnonzero(changed[self.face])
        self._search(samples, points, faces, beside, afresh=False)

    def _search(
        self, samples: Samples, points: Floats, faces: Indices, chosen: Indices, *, afresh: bool
    ) -> None:
        triangles = Triangles.of(points, faces)
        bounds = np.zeros(len(points) + 1, dtype=np.intp)
        np.cumsum(np.bincount(faces.ravel(), minlength=len(points)), out=bounds[1:])
        around = np.argsort(faces.ravel(), kind="stable") // 3

        def walk(start: int, stop: int) -> None:
            sample = chosen[start:stop]
            vertex, face = samples.owner[sample], self.face[sample]
            queries = samples.points.take(sample, axis=1)
            if afresh:
                face, square = _nearest(triangles, queries, vertex, around, bounds)
            else:
                square = triangles.square_distances(queries, face)
                vertex = np.full(stop - start, -1)  # round none has been looked at
            for _ in range(MAX_STEPS):
                self.put(sample, samples, triangles, face, square)
                share, inside = triangles.project(queries, face)
                corner = faces[face, share.argmax(axis=0)]
                away = np.flatnonzero(~inside & (corner != vertex))
                if not len(away):
                    break
                queries, vertex = queries[:, away], corner[away]
                sample, was = sample[away], face[away]
                face, square = _nearest(triangles, queries, vertex, around, bounds)
                new = np.flatnonzero(face != was)
                sample, queries, vertex = sample[new], queries[:, new], vertex[new]
                face, square = face[new], square[new]

        run_blocks(walk, len(chosen), size=SAMPLE_BLOCK)

    def put(
        self,
        where: Indices,
        samples: Samples,
        triangles: Triangles,
        chosen: Indices,
        square: Floats,
        face: Indices | None = None,
    ) -> None:
        """Assign samples to triangles, which are the faces of these numbers or of others."""
        self.face[where] = chosen if face is None else face
        self.square[where] = square
        self.cosine[where] = product(samples.normals[:, where], triangles.normals, chosen)

    def samples_of(self, faces: Indices, count: int) -> tuple[Indices, Indices]:
        """Return the samples of some of `count` faces, in the order of faces, and all bounds."""
        wanted = np.zeros(count, dtype=bool)
        wanted[faces] = True
        sample = np.flatnonzero(wanted[self.face])
        face = self.face[sample]
        bounds = np.zeros(count + 1, dtype=np.intp)
        np.cumsum(np.bincount(face, minlength=count), out=bounds[1:])
        return sample[np.argsort(face, kind="stable")], bounds


def _nearest(
    triangles: Triangles, queries: Floats, vertex: Indices, around: Indices, bounds: Indices
) -> tuple[Indices, Floats]:
    """Return the nearest of the faces round the vertex of each query, and the squared distance."""
    places, ends = row_entries(bounds, vertex)
    size = np.diff(ends)
    face = around[places]
    square = triangles.square_distances(np.repeat(queries, size, axis=1), face)
    least = np.minimum.reduceat(square, ends[:-1])
    hit = np.flatnonzero(square == np.repeat(least, size))
    return face[hit[np.searchsorted(hit, ends[:-1])]], least
