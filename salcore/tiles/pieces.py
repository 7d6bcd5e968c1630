# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces of a mesh: what each vertex stands for so far, and how pieces are cut up and joined.

Every vertex of the whole is owned by one piece, the one in whose box it lies. A piece has all faces
with a vertex that it owns; their other vertices are foreign. Vertices that it owns and that have a
foreign neighbour are held: they stay where they are, and so do all faces between pieces. Nothing
that a piece does within them can be seen from another, so that pieces fit together whatever each
does (`held_vertices`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..arrays.edges import find_edges
from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from ..arrays.vectors import sum_by_label
from ..decimation.cut import cut_faces
from ..decimation.quadrics import monomials
from .plan import within

TURN, AXIS = 0.65, (1.0, 2.0, 3.0)
"""Angle and axis by which the boxes of each pass are turned against those of the last. What was
held along the sides of these lies inside, but for the few places where sides of two passes cross on
the surface, which lie inside in the pass after that."""
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a mesh with n vertices and m faces.

    Attributes
    ----------
    number : (n,) int64
        Of each vertex in the whole, ascending.
    points : (n, 3) float64
        In the unit of the clean geometry; no two are equal.
    quadric : (n, 10) float64
        Sum of the quadrics of all that a vertex stands for.
    area, error, factor : (n,) float64
        What it stands for besides, as in `Costs`: `error` is that of its quadric at itself.
    owned : (n,) bool
        Whether the piece owns the vertex.
    faces : (m, 3) int32
    face_number : (m,) int64
        Of each face in the whole.
    """

    number: Numbers
    points: Floats
    quadric: Floats
    area: Floats
    error: Floats
    factor: Floats
    owned: Mask
    faces: Ints
    face_number: Numbers

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all of it as named arrays, for a file; `from_arrays` takes them back."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Piece:
        """Return the piece of these arrays."""
        return cls(**{field.name: arrays[field.name] for field in dataclasses.fields(cls)})

    def own_faces(self) -> Mask:
        """Return which faces (m,) are this piece's and no other's."""
        return first_corner_owned(self.points, self.faces, self.owned)

    def take(self, vertices: Indices, faces: Mask) -> Piece:
        """Return some vertices, and some faces between these."""
        place = np.full(len(self.number), -1, dtype=np.int32)
        place[vertices] = np.arange(len(vertices), dtype=np.int32)
        values = {name: value[vertices] for name, value in self.arrays().items() if name in ROWS}
        return Piece(
            faces=place.take(self.faces[faces]), face_number=self.face_number[faces], **values
        )


ROWS = ("number", "points", "quadric", "area", "error", "factor", "owned")
"""Arrays with a row for each vertex."""


def first_corner_owned(points: Floats, faces: Integers, owned: Mask) -> Mask:
    """Return for which faces (m,) the first corner in space is owned: one piece's of several."""
    rank = np.empty(len(points), dtype=np.int32)
    rank[np.lexsort(points.T)] = np.arange(len(points), dtype=np.int32)
    corner = rank.take(faces).argmin(axis=1)
    result: Mask = owned[faces[np.arange(len(faces)), corner]]
    return result


def held_vertices(piece: Piece, keep_border: bool = False) -> Mask:
    """Return the vertices (n,) that stay: foreign ones, their neighbours, and borders if asked.

    A vertex that may go has owned neighbours only, and so has, or is, whatever it goes into. Hence
    the edges that a collapse makes lie between vertices that the piece owns, of which it knows all
    edges: the link condition is checked as on the whole, and no edge or face between pieces
    changes.
    """
    foreign = ~piece.owned
    mixed = foreign[piece.faces].any(axis=1)
    held = foreign.copy()
    held[piece.faces[mixed]] = True
    if keep_border:
        edges = find_edges(piece.faces, len(foreign))
        single = edges.uses == 1
        held[edges.low[single]] = held[edges.high[single]] = True
    return held


def cut_piece(piece: Piece, source: Indices) -> Piece:
    """Return what is left of a piece when every vertex joins its source (n,), a kept vertex.

    Faces that another piece has as its own are left out, and vertices that no face then needs
    unless the piece owns them.
    """
    count = len(source)
    merged = np.bincount(source, minlength=count) > 1
    quadric = sum_by_label(piece.quadric, source, count)
    area = np.bincount(source, piece.area, count)
    error = np.where(merged, np.einsum("nk,nk->n", quadric, monomials(piece.points)), piece.error)
    faces, left = cut_faces(piece.faces.astype(np.intp), source)
    whole = dataclasses.replace(
        piece,
        quadric=np.where(merged[:, None], quadric, piece.quadric),
        area=np.where(merged, area, piece.area),
        error=error.clip(min=0.0),
        faces=faces.astype(np.int32),
        face_number=piece.face_number[left],
    )
    mine = whole.own_faces()
    needed = np.zeros(count, dtype=bool)
    needed[whole.faces[mine]] = True
    needed[source] |= piece.owned[source]
    return whole.take(np.flatnonzero(needed), mine)


def part_in_box(piece: Piece, turn: int, box: Floats) -> Piece:
    """Return the faces with a corner in a box (2, 3), and the vertices of these and in the box.

    Parameters
    ----------
    piece : Piece
        As `cut_piece` returns it.
    turn : int
        Number of the pass, by which boxes are turned.
    box : (2, 3) float64
    """
    inside = within(turned(piece.points, turn), box)
    chosen: Mask = np.asarray(inside[piece.faces].any(axis=1))
    needed = inside & piece.owned
    needed[piece.faces[chosen]] = True
    return piece.take(np.flatnonzero(needed), chosen)


def renumbered(piece: Piece, copies: Numbers) -> Piece:
    """Return a piece whose vertices bear the numbers of the points that stand for them.

    Parameters
    ----------
    piece : Piece
    copies : (2, c) int64
        Points that equal another, ascending, and these (`MeshTile.copies`). A piece that does not
        own a vertex may know a copy only.
    """
    if not copies.shape[1]:
        return piece
    place = np.minimum(np.searchsorted(copies[0], piece.number), copies.shape[1] - 1)
    is_copy = copies[0, place] == piece.number
    return dataclasses.replace(piece, number=np.where(is_copy, copies[1, place], piece.number))


def join_parts(parts: Sequence[Piece], turn: int, box: Floats) -> Piece:
    """Return the piece in a box, of the parts of all that the box reaches.

    Parameters
    ----------
    parts : sequence of Piece
        From `part_in_box`.
    turn, box
        As there.
    """
    number = np.concatenate([part.number for part in parts])
    stale = ~np.concatenate([part.owned for part in parts])
    # What a vertex stands for is known where it was owned.
    order = np.lexsort((stale, number))
    first = np.append(True, np.diff(number[order]) > 0)[: len(order)]
    place = np.empty(len(order), dtype=np.int32)
    place[order] = np.cumsum(first) - 1
    chosen = order[first]
    start = np.cumsum([0, *(len(part.number) for part in parts)])
    faces = [place[part.faces + at] for part, at in zip(parts, start[:-1], strict=True)]
    rows = {name: np.concatenate([getattr(part, name) for part in parts])[chosen] for name in ROWS}
    rows["owned"] = within(turned(rows["points"], turn), box)
    face_number = np.concatenate([part.face_number for part in parts])
    in_order = np.argsort(face_number, kind="stable")
    return Piece(faces=np.concatenate(faces)[in_order], face_number=face_number[in_order], **rows)


def turned(points: Floats, turn: int) -> Floats:
    """Return points (n, 3) in the frame of the boxes of a pass."""
    if not turn:
        return points
    axis = np.array(AXIS) / np.linalg.norm(AXIS)
    # Products of matrices may differ with the number of rows; sums of columns do not.
    matrix = Rotation.from_rotvec(TURN * turn * axis).as_matrix()
    columns = [sum(matrix[i, j] * points[:, j] for j in range(3)) for i in range(3)]
    result: Floats = np.stack(columns, axis=1)
    return result
