# SPDX-License-Identifier: GPL-3.0-or-later
"""The faces and edges round the vertices that a round removes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays.edges import contains, edge_key
from ..arrays.types import Indices, Integers, Ints, Keys, Mask

Corners = list[Ints]
"""The first, second and third corners of all faces."""


def twin(half: Integers, edges: int) -> Integers:
    """Return the half-edges that run back along some, of twice so many edges."""
    return np.where(half < edges, half + edges, half - edges)


@dataclass(frozen=True, eq=False)
class OneRings:
    """One-rings of s vertices, no two of them neighbours: one row a face, one row an edge.

    Attributes
    ----------
    collapses : (s,) int
        The half-edges from the removed vertices to the kept ones.
    removed, kept : (s,) int32
        Their ends.
    faces, face_owner : (f,) intp
        A face with a removed vertex, and the collapse it belongs to.
    corner : (f,) int8
        Which of its corners is the removed vertex.
    left, right : (f,) int32
        Its two other corners, in order.
    vanishing : (f,) bool
        Whether the kept vertex is one of them.
    edges, edge_owner : (h,) intp
        A half-edge that begins at a removed vertex, and the collapse it belongs to.
    other, edge_kept : (h,) int32
        Its target, and the collapse's kept vertex.
    shared : (h,) bool
        Whether the target is a neighbour of the kept vertex, too.
    key : (h,) int64
        `edge_key` of the edge from the target to the kept vertex.
    count : int
        Vertices, dead ones included; keys are numbers to this base.
    """

    collapses: Integers
    removed: Ints
    kept: Ints
    faces: Indices
    face_owner: Indices
    corner: NDArray[np.int8]
    left: Ints
    right: Ints
    vanishing: Mask
    edges: Indices
    edge_owner: Indices
    other: Ints
    edge_kept: Ints
    shared: Mask
    key: Keys
    count: int

    @classmethod
    def find(cls, collapses: Integers, source: Ints, corners: Corners, count: int) -> OneRings:
        """Gather the one-rings from the sources of all half-edges and the corners of all faces."""
        removed, kept = source[collapses], source[twin(collapses, len(source) // 2)]
        owner_of = np.full(count, -1, dtype=np.int32)
        owner_of[removed] = np.arange(len(removed))
        faces, face_owner, corner, left, right = _faces_of(owner_of, corners)
        face_kept = kept[face_owner]
        edges, edge_owner, other = _edges_of(owner_of, source)
        edge_kept = kept[edge_owner]
        key = edge_key(other, edge_kept, count)
        present = _keys_between(kept, other, source, count)
        return cls(
            collapses,
            removed,
            kept,
            faces,
            face_owner,
            corner,
            left,
            right,
            vanishing=(left == face_kept) | (right == face_kept),
            edges=edges,
            edge_owner=edge_owner,
            other=other,
            edge_kept=edge_kept,
            shared=contains(present, key) & (other != edge_kept),
            key=key,
            count=count,
        )

    def count_faces(self) -> Indices:
        """Return the number of faces round each removed vertex."""
        return np.bincount(self.face_owner, minlength=len(self.removed))

    def count_edges(self) -> Indices:
        """Return the number of edges of each removed vertex."""
        return np.bincount(self.edge_owner, minlength=len(self.removed))


def _faces_of(
    owner_of: Ints, corners: Corners
) -> tuple[Indices, Indices, NDArray[np.int8], Ints, Ints]:
    """Return the faces with a corner that has an owner, owners, corners, and the other two."""
    faces, owners = [], []
    for corner in corners:
        owner = owner_of.take(corner)
        faces.append(np.flatnonzero(owner >= 0))
        owners.append(owner[faces[-1]].astype(np.intp))
    left = [corners[(k + 1) % 3][face] for k, face in enumerate(faces)]
    right = [corners[(k + 2) % 3][face] for k, face in enumerate(faces)]
    join = np.concatenate
    which = np.repeat(np.arange(3, dtype=np.int8), [len(face) for face in faces])
    return join(faces), join(owners), which, join(left), join(right)


def _edges_of(owner_of: Ints, source: Ints) -> tuple[Indices, Indices, Ints]:
    """Return the living half-edges whose sources have an owner, the owners, and the targets."""
    owner = owner_of.take(source)
    edges = np.flatnonzero(owner >= 0)
    other = source[twin(edges, len(source) // 2)]
    alive = source[edges] != other
    edges, other = edges[alive], other[alive]
    return edges, owner[edges].astype(np.intp), other


def _keys_between(some: Ints, others: Ints, source: Ints, count: int) -> Keys:
    """Return the sorted keys of the edges that lead from one of some vertices to one of others."""
    side = np.zeros(count, dtype=np.uint8)
    side[some] = 1
    side[others] |= 2
    low, high = source.reshape(2, -1)
    at_low, at_high = side.take(low), side.take(high)
    # Only 1 with 2, 1 with 3, 2 with 3 and 3 with 3 have both bits between them.
    between = np.flatnonzero(((at_low & 1) & (at_high >> 1)) | ((at_high & 1) & (at_low >> 1)))
    low, high = low[between], high[between]
    alive = low != high
    return np.sort(edge_key(low[alive], high[alive], count))
