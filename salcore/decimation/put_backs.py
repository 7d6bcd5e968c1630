# SPDX-License-Identifier: GPL-3.0-or-later
"""Put the backs of kept faces into a result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Indices
from ..input.geometry import Geometry


@dataclass(frozen=True, eq=False)
class TwoSided:
    """Faces of a result, and the backs of those that have one, in the order of the fronts.

    Attributes
    ----------
    indices : (M,) int64
        Kept input points: those of the backs as well.
    place : (m,) int64
        Where the points that were kept before are among them.
    faces, face_source, corner_origin, face_corners
        As in `Simplification`.
    """

    indices: Indices
    place: Indices
    faces: Indices
    face_source: Indices
    corner_origin: Indices
    face_corners: Indices


def put_backs(
    geometry: Geometry,
    indices: Indices,
    faces: Indices,
    face_source: Indices,
    corner_origin: Indices,
    face_corners: Indices,
) -> TwoSided | None:
    """Return a result with backs; None where no kept face has one.

    Each corner of a back takes its values from the back of the face that the front's corner takes
    its own from; where that has none, from the front.
    """
    backs = geometry.backs
    if backs is None:
        return None
    back_of = np.full(len(geometry.faces), -1, dtype=np.intp)
    back_of[backs.front] = np.arange(len(backs.front))
    front = np.flatnonzero(back_of[np.searchsorted(geometry.face_of, face_source)] >= 0)
    if not len(front):
        return None
    back = back_of[np.searchsorted(geometry.face_of, face_source[front])]
    # Corners in the order of the back that the front's face has.
    order = backs.corner[back]
    at = np.take_along_axis(faces[front], order, axis=1)
    origin = np.take_along_axis(corner_origin[front], order, axis=1)
    corner = np.take_along_axis(face_corners[front], order, axis=1)
    back_corner = np.full(3 * geometry.given_faces, -1, dtype=np.intp)
    behind = 3 * geometry.face_of[backs.front][:, None] + backs.corner
    back_corner[behind] = 3 * backs.face[:, None] + np.arange(3)
    point_of = np.full(3 * geometry.given_faces, -1, dtype=np.intp)
    point_of[3 * backs.face[:, None] + np.arange(3)] = backs.points
    has = back_corner[corner] >= 0
    corner = np.where(has, back_corner[corner], corner)
    origin = np.where(back_corner[origin] >= 0, back_corner[origin], origin)
    points = np.where(has, point_of[corner], indices[at])
    stays = np.zeros(geometry.input_count, dtype=bool)
    stays[indices] = stays[points] = True
    position = np.cumsum(stays) - 1
    slot = np.concatenate([np.arange(len(faces)), front])
    rows = np.argsort(slot, kind="stable")

    def merge(fronts: Indices, others: Indices) -> Indices:
        both: Indices = np.concatenate([fronts, others])[rows].astype(np.int64)
        return both

    return TwoSided(
        np.flatnonzero(stays).astype(np.int64),
        position[indices],
        merge(position[indices][faces], position[points]),
        merge(face_source, backs.face[back]),
        merge(corner_origin, origin),
        merge(face_corners, corner),
    )
