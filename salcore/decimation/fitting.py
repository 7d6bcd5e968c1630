# SPDX-License-Identifier: GPL-3.0-or-later
"""The vertices of a cut move to where its faces lie nearest to the original.

In the manner of Hoppe, DeRose, Duchamp, McDonald and Stuetzle, Mesh optimization, SIGGRAPH 1993: in
turns, edges are flipped, samples of the original are projected onto the faces, and all vertices
move at once to where the sum of squares is least, each sample held to its place in its face. As in
Pottmann, Leopoldseder and Hofer, Approximation with active B-spline curves and surfaces, 2002,
distances count across a face, and hardly along it, so that faces may slide on the original.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import face_normals, sum_by_label, unit
from ..progress import SILENT, Progress
from .flips import FlipMesh, cosines, folds
from .legality import turned_over
from .nearest_faces import Assignment, Triangles
from .overshoot import pull_back
from .refine import ROUNDS, flip_edges
from .samples import Samples

MIDDLES, SAMPLES = 0.75, 12
"""Share of the weight of samples that the middles of faces have, and most of them on a face; three
quarters integrate polynomials of the second degree exactly."""
TURNS = 4
"""Times that all vertices move."""
ROUNDS_BETWEEN = 1
"""Rounds of flips after each move but the last; more gain nothing."""
SLIDE = 0.1
"""Weight of squared distances along a face, against those across it."""
SMOOTH = 0.01
"""Weight of the squared heights of a face's sides along the mean normal of its samples."""
FLATNESS = 0.001
"""Weight of the angle between the faces at an edge against their samples: it unfolds folds, which
stand out from all samples. Kept points, which hold their faces, do not need it."""
STAY = 0.02
"""Weight of staying where a vertex is, against that of its samples."""
DAMPING = 10.0
"""Factor on this for a vertex whose faces a move has brought farther from the original; it stays
for that turn (Levenberg and Marquardt)."""
TOLERANCE, ITERATIONS = 1e-2, 15
"""Of the conjugate gradients."""
UNDO_ROUNDS = 8
"""Rounds in which the corners of faces that turn over go back; in each, others may turn."""


def fit_positions(
    mesh: FlipMesh,
    positions: Floats,
    samples: Samples,
    source: Indices,
    held: Mask,
    original: tuple[Floats, Indices],
    progress: Progress = SILENT,
) -> Floats:
    """Return positions (n, 3) of vertices at which their faces lie nearest to the original.

    Parameters
    ----------
    mesh : FlipMesh
        The faces; their edges are flipped on the way.
    positions : (n, 3) float64
        Where the vertices start, such as at the minima of their quadrics.
    samples : Samples
        Of the original.
    source : (n,) intp
        Kept vertex that stands for each vertex of the original.
    held : (n,) bool or (n, 3) bool
        Vertices that do not move, or coordinates of them.
    original : ((n, 3) float64, (m, 3) intp)
        Points and faces.
    progress : Progress, optional

    Notes
    -----
    O(m + s + k log k) for s samples and k faces. No face turns over, no move brings the faces
    round a vertex farther from the samples that they have, no vertex ends much farther from the
    original than that from its faces, and the topology stays.
    """
    count = len(positions)
    step = max(1, (len(samples.owner) - samples.vertices) // max(SAMPLES * len(mesh.faces), 1))
    samples = samples.standing_for(mesh.faces, source, kept=True, middles=MIDDLES, step=step)
    if not len(mesh.faces) or held[mesh.faces].all():
        return positions
    damping = np.full(count, STAY)
    at = Assignment.of(samples, positions, mesh.faces)
    flip_edges(mesh, positions, samples, at, ROUNDS, flatness=FLATNESS)
    for turn in range(TURNS):
        progress(turn / TURNS)
        before = _energies(mesh.faces, samples, at, count)
        moves = _Squares.of(positions, mesh.faces, samples, at, damping, held).least()
        moved = _undo_turned(positions, positions + moves, mesh)
        at.renew(samples, moved, mesh.faces, _differ(moved, positions))
        worse = _energies(mesh.faces, samples, at, count) > before
        damping[worse] *= DAMPING
        fitted = moved.copy()
        fitted[worse] = positions[worse]
        positions = _undo_turned(positions, fitted, mesh)
        at.renew(samples, positions, mesh.faces, _differ(positions, moved))
        if turn < TURNS - 1:
            flip_edges(mesh, positions, samples, at, ROUNDS_BETWEEN, flatness=FLATNESS)
    free = np.unique(mesh.faces)
    free = free[~held[free].reshape(len(free), -1).any(axis=1)]
    near = pull_back(positions, free, _farthest(mesh.faces, at, count), *original)
    near = _undo_turned(positions, near, mesh)
    at.renew(samples, near, mesh.faces, _differ(near, positions))
    flip_edges(mesh, near, samples, at, ROUNDS, flatness=FLATNESS)
    return near


def _differ(first: Floats, second: Floats) -> Mask:
    """Return which rows (n,) differ."""
    return np.asarray((first != second).any(axis=1))


def _farthest(faces: Indices, at: Assignment, count: int) -> Floats:
    """Return the largest squared distance (count,) of samples to the faces round vertices."""
    of_face, result = np.zeros(len(faces)), np.zeros(count)
    np.maximum.at(of_face, at.face, at.square)
    for corner in faces.T:
        np.maximum.at(result, corner, of_face)
    return result


def _energies(faces: Indices, samples: Samples, at: Assignment, count: int) -> Floats:
    """Return the sum (count,) of the squared distances of samples of the faces round vertices."""
    of_face = np.bincount(at.face, samples.weights * at.square, len(faces))
    energies: Floats = np.zeros(count)
    for corner in faces.T:
        energies += np.bincount(corner, of_face, count)
    return energies


def _undo_turned(before: Floats, after: Floats, mesh: FlipMesh) -> Floats:
    """Return positions `after`, but `before` at the corners of faces that would turn or fold."""
    faces = mesh.faces
    old = face_normals(before, faces)
    side = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    one, other = side // 3, mesh.twins[side] // 3
    old_cosine = cosines(old[one], old[other])
    result = after.copy()
    for _ in range(UNDO_ROUNDS):
        new = face_normals(result, faces)
        turned = turned_over(old, new) & old.any(axis=1)
        folded = folds(old_cosine, cosines(new[one], new[other]))
        # What has gone back already folds as much as before, but for rounding.
        turned[one[folded]] = turned[other[folded]] = True
        turned &= (result[faces] != before[faces]).any(axis=(1, 2))
        if not turned.any():
            return result
        back = np.unique(faces[turned])
        result[back] = before[back]
    return before.copy()


@dataclass(frozen=True, eq=False)
class _Squares:
    """Sums of squares of samples' distances, as a function of how the u used vertices move.

    The matrix is a sum over faces: of `across` times the projection on the face's normal, `both`
    times the identity, `smooth` times the projection on the samples' mean normal.

    Attributes
    ----------
    used : (u,) intp
        Vertices of faces.
    count : int
        Number of all vertices.
    corners : (3, k) intp
        Corners of the faces, numbered as in `used`.
    normals, means : (3, k) float64
        Unit normals of faces, and mean ones of their samples.
    across, both, smooth : (3, 3, k) float64
        Weights of the products of the moves of two corners.
    pull : (3, u) float64
        Half the downward gradient where nothing moves.
    stay : (u,) float64
        Weight of staying.
    free : (u,) bool or (3, u) bool
        What is not held.
    diagonal : (u,) float64
        Of the matrix without `stay`, roughly.
    """

    used: Indices
    count: int
    corners: Indices
    normals: Floats
    means: Floats
    across: Floats
    both: Floats
    smooth: Floats
    pull: Floats
    stay: Floats
    free: Mask
    diagonal: Floats

    @classmethod
    def of(
        cls,
        positions: Floats,
        faces: Indices,
        samples: Samples,
        at: Assignment,
        damping: Floats,
        held: Mask,
    ) -> _Squares:
        """Set up the sums with every sample held to its place in its face."""
        used, corners = np.unique(faces.T, return_inverse=True)
        corners = np.ascontiguousarray(corners.reshape(3, -1))
        count = len(faces)
        triangles = Triangles.of(positions, faces)
        share, inside = triangles.project(samples.points, at.face)
        across, both = (np.empty((3, 3, count)) for _ in range(2))
        for i in range(3):
            for j in range(i, 3):
                weight = samples.weights * share[i] * share[j]
                within = np.bincount(at.face, weight * inside, count)
                total = np.bincount(at.face, weight, count)
                across[i, j] = across[j, i] = (1.0 - SLIDE) * within
                both[i, j] = both[j, i] = total - (1.0 - SLIDE) * within
        normals = triangles.normals
        means = unit(sum_by_label((samples.weights * samples.normals).T, at.face, count)).T
        smooth = np.empty((3, 3, count))
        smooth[:] = -SMOOTH * np.bincount(at.face, samples.weights, count)
        for i in range(3):
            smooth[i, i] *= -2.0
        rest = samples.points.copy()
        for axis in range(3):
            for i in range(3):
                rest[axis] -= share[i] * positions[:, axis].take(faces[:, i].take(at.face))
        height = (1.0 - SLIDE) * np.where(inside, _dot(rest, normals[:, at.face]), 0.0)
        rest *= np.where(inside, SLIDE, 1.0)
        rest += height * normals[:, at.face]
        heights = [_dot(positions[corner].T, means) for corner in faces.T]
        pull, diagonal = np.zeros((3, len(used))), np.zeros(len(used))
        for i, corner in enumerate(corners):
            slope = sum(smooth[i, j] * heights[j] for j in range(3))
            weights = samples.weights * share[i]
            on_sample = corner.take(at.face)
            for axis in range(3):
                pull[axis] += np.bincount(on_sample, weights * rest[axis], len(used))
                pull[axis] -= np.bincount(corner, slope * means[axis], len(used))
            own = across[i, i] + both[i, i] + smooth[i, i]
            diagonal += np.bincount(corner, own, len(used))
        stay = damping[used] * (diagonal + 0.1 * diagonal.mean()) + np.finfo(np.float64).tiny
        return cls(
            used, len(positions), corners, normals, means, across, both, smooth, pull, stay,
            ~held[used].T, diagonal,
        )  # fmt: skip

    def least(self) -> Floats:
        """Return the moves (count, 3) of all vertices that make the sum least."""
        size = 3 * len(self.used)
        free, stay = self.free, self.stay
        scale = np.tile(1.0 / (self.diagonal + stay), 3)

        def multiply(flat: Floats) -> Floats:
            moves = flat.reshape(3, -1)
            return ((self._multiply(moves) + stay * moves) * free).ravel()

        matrix = LinearOperator((size, size), matvec=multiply, dtype=np.float64)
        inverse = LinearOperator((size, size), matvec=lambda flat: scale * flat, dtype=np.float64)
        right = (self.pull * free).ravel()
        moves, _ = cg(matrix, right, rtol=TOLERANCE, maxiter=ITERATIONS, M=inverse)
        result = np.zeros((self.count, 3))
        result[self.used] = moves.reshape(3, -1).T
        return result

    def _multiply(self, moves: Floats) -> Floats:
        """Return the product of the matrix, without `stay`, and moves (3, u)."""
        at_corner = [moves.take(corner, axis=1) for corner in self.corners]
        along = [(_dot(move, self.normals), _dot(move, self.means)) for move in at_corner]
        result = np.zeros_like(moves)
        for i, corner in enumerate(self.corners):
            on_normal = sum(self.across[i, j] * along[j][0] for j in range(3))
            on_mean = sum(self.smooth[i, j] * along[j][1] for j in range(3))
            for axis in range(3):
                value = on_normal * self.normals[axis] + on_mean * self.means[axis]
                for j in range(3):
                    value += self.both[i, j] * at_corner[j][axis]
                result[axis] += np.bincount(corner, value, moves.shape[1])
        return result


def _dot(first: Floats, second: Floats) -> Floats:
    """Return the scalar products (k,) of vectors (3, k)."""
    result: Floats = first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
    return result
