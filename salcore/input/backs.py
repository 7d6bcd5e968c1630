# SPDX-License-Identifier: GPL-3.0-or-later
"""Backs: faces with the corners of another, turned over. A sheet is made two-sided by them.

They are set aside and put again on the kept faces: what happens to a front happens to its back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.edges import sort_rows
from ..arrays.types import Indices, Integers


@dataclass(frozen=True, eq=False)
class Backs:
    """The b backs of a mesh, each of a front of its own.

    Attributes
    ----------
    face : (b,) intp
        Input faces that they are.
    front : (b,) intp
        Clean face that each is the back of.
    corner : (b, 3) intp
        Corner of the front (0, 1 or 2) that each corner lies on.
    points : (b, 3) intp
        Input points at their corners.
    """

    face: Indices
    front: Indices
    corner: Indices
    points: Indices


def find_backs(faces: Integers, count: int) -> tuple[Indices, Indices]:
    """Return the backs (b,) among faces (m, 3) over `count` vertices, and their fronts (b,).

    The front is the first of the faces with the same corners, the back the first that is turned
    the other way.
    """
    nothing = np.empty(0, dtype=np.intp)
    order, same = sort_rows(np.sort(faces, axis=1), count)
    if not same.any():
        return nothing, nothing
    group = np.cumsum(np.append(False, ~same))
    first = np.flatnonzero(np.append(True, ~same))
    a, b, c = faces[order].T
    even = ((a < b) & (b < c)) | ((b < c) & (c < a)) | ((c < a) & (a < b))
    turned = np.flatnonzero(even != even[first][group])
    _, once = np.unique(group[turned], return_index=True)
    back = turned[once]
    return order[back], order[first[group[back]]]


def make_backs(
    faces: Integers, face_of: Indices, points: Integers, back: Indices, front: Indices
) -> Backs:
    """Describe backs by what is left once they are out of the faces.

    Parameters
    ----------
    faces : (m, 3) int
        All faces, over vertices.
    face_of : (m,) intp
        Input face that each is.
    points : (m, 3) int
        Input points at their corners.
    back, front : (b,) intp
        As `find_backs` returns.
    """
    is_front = np.ones(len(faces), dtype=bool)
    is_front[back] = False
    number = np.cumsum(is_front) - 1
    corner = np.argmax(faces[back][:, :, None] == faces[front][:, None, :], axis=2)
    return Backs(face_of[back], number[front], corner, points[back].astype(np.intp))
