# SPDX-License-Identifier: GPL-3.0-or-later
"""A light mesh is refined piece by piece: edges are flipped to where the original lies."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.blocks import set_workers
from ..arrays.edges import edge_key
from ..arrays.types import Floats, Indices, Mask
from ..arrays.vectors import dot, face_normals, unit
from ..decimation.flips import FlipMesh
from ..decimation.nearest_faces import Assignment
from ..decimation.refine import MIDDLE_STEP, MIDDLES, ROUNDS, flip_edges
from ..decimation.samples import Samples
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .mesh import MeshTile
from .pieces import Numbers, Piece, first_corner_owned


@dataclass(frozen=True, eq=False)
class TileSamples:
    """Samples of the surface of a tile, as `Samples` has them, by rows.

    Attributes
    ----------
    points, normals : (s, 3) float64
    weights : (s,) float64
    root : (s,) int64
        Number of the kept vertex that stands for each.
    """

    points: Floats
    normals: Floats
    weights: Floats
    root: Numbers

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all of it as named arrays, for a file."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @classmethod
    def join(cls, parts: Sequence[Mapping[str, NDArray[Any]]]) -> TileSamples:
        """Return the samples of all these arrays."""
        empty = {"points": (0, 3), "normals": (0, 3), "weights": (0,)}
        none = {name: np.empty(shape) for name, shape in empty.items()}
        every = [none | {"root": np.empty(0, dtype=np.int64)}, *parts]
        names = (field.name for field in dataclasses.fields(cls))
        return cls(*(np.concatenate([part[name] for part in every]) for name in names))

    def take(self, chosen: Mask) -> TileSamples:
        """Return some of the samples (s,)."""
        values = (getattr(self, field.name)[chosen] for field in dataclasses.fields(self))
        return TileSamples(*values)


def sample_tile(tile: MeshTile, factor: Floats, root: Numbers) -> tuple[TileSamples, Indices]:
    """Return the vertices of a tile's core that have gone, and middles of its own faces.

    Parameters
    ----------
    tile : MeshTile
    factor : (n,) float64
        Multiplies the areas that vertices stand for.
    root : (n,) int64
        Number of the kept vertex that stands for each vertex; of those in the core.

    Returns
    -------
    samples : TileSamples
    near : (s,) intp
        Vertex of the core that each is, or is next to.
    """
    points, count = tile.points, len(tile.points)
    double = face_normals(points, tile.faces)
    size = np.sqrt(dot(double, double))
    area = np.zeros(count)
    for corner in tile.faces.T:
        area += np.bincount(corner, size, count)
    gone = np.flatnonzero(tile.owned & (root != tile.number))
    mine = first_corner_owned(points, tile.faces, tile.owned) & (
        tile.face_number % MIDDLE_STEP == 0
    )
    faces = tile.faces[mine]
    # One of the corners is in the core: near what stands for it the nearest face is sought.
    near = faces[np.arange(len(faces)), tile.owned[faces].argmax(axis=1)]
    weights = size[mine] * sum(factor[corner] for corner in faces.T)
    samples = TileSamples(
        np.concatenate([points[gone], sum(points[corner] for corner in faces.T) / 3.0]),
        np.concatenate([np.zeros((len(gone), 3)), unit(double[mine])]),
        np.concatenate([(1.0 - MIDDLES) * (area * factor)[gone], MIDDLES * MIDDLE_STEP * weights]),
        np.concatenate([root[gone], root[near]]),
    )
    return samples, np.concatenate([gone, near])


def refine_piece(
    piece: Piece, samples: TileSamples, parameters: Parameters, progress: Progress = SILENT
) -> Piece:
    """Return a piece of a light mesh whose edges are flipped to where the original lies.

    Faces with foreign vertices, and their edges, stay: pieces fit together as before.

    Parameters
    ----------
    piece : Piece
    samples : TileSamples
        Of the original; those of which the piece has no vertex are left out.
    parameters : Parameters
    progress : Progress, optional

    Notes
    -----
    O(s + m log m) time for s samples and m faces.
    """
    count, faces = len(piece.number), piece.faces.astype(np.intp)
    mixed = ~piece.owned[faces].all(axis=1)
    fixed = [edge_key(faces[mixed, k], faces[mixed, (k + 1) % 3], count) for k in range(3)]
    used = np.zeros(count, dtype=bool)
    used[faces[~mixed]] = True
    owner = np.minimum(np.searchsorted(piece.number, samples.root), max(count - 1, 0))
    near = (piece.number[owner] == samples.root) & used[owner] if count else np.zeros(0, dtype=bool)
    chosen, owner = samples.take(near), owner[near]
    columns = Samples(
        np.ascontiguousarray(chosen.points.T),
        np.ascontiguousarray(chosen.normals.T),
        chosen.weights,
        owner,
        len(owner),
    )
    with set_workers(parameters.workers):
        mesh = FlipMesh.of(faces, faces, count, np.unique(np.concatenate(fixed)))
        at = Assignment.of(columns, piece.points, faces)
        progress(0.4)
        flip_edges(mesh, piece.points, columns, at, ROUNDS, progress.part(0.4, 1.0))
    return dataclasses.replace(piece, faces=mesh.faces.astype(np.int32))
