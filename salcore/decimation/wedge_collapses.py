# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the wedges of removed vertices go: each into that of its own chart at the kept vertex.

A face that vanishes with its edge has a corner at both ends, and tells which wedge goes into which.
A collapse tears charts if it leaves a wedge without a target, or with two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.rows import row_entries
from ..arrays.types import Indices, Integers, Ints, Mask
from ..input.wedges import Wedges
from .one_rings import Corners, OneRings


@dataclass(eq=False)
class WedgeCollapses:
    """The wedges of the faces that are left, and where all others have gone.

    Attributes
    ----------
    wedges : Wedges
    corners : list of (f,) int32
        Wedges of the first, second and third corners of the living faces.
    parent : (w,) int32
        Wedge that each went into; -1 while its vertex lives.
    """

    wedges: Wedges
    corners: Corners
    parent: Ints

    @classmethod
    def of_faces(cls, wedges: Wedges, faces: Integers) -> WedgeCollapses:
        """Return the wedges of a whole surface, whose first faces are those of the wedges."""
        further = wedges.first[faces[len(wedges.corners) :]]
        corners = [np.concatenate(pair) for pair in zip(wedges.corners.T, further.T, strict=True)]
        return cls(wedges, corners, np.full(int(wedges.first[-1]), -1, dtype=np.int32))

    def tearing(self, rings: OneRings, vertex_id: Indices) -> Mask:
        """Return which collapses (s,) tear charts."""
        several = np.diff(self.wedges.first) > 1
        divided = several[vertex_id[rings.removed]] | several[vertex_id[rings.kept]]
        row = np.flatnonzero(divided[rings.face_owner])
        gone, kept = self._removed(rings, row), self._kept(rings, row)
        vanishing = rings.vanishing[row]
        self.parent[gone[vanishing]] = kept[vanishing]
        strays = self.parent[gone] < 0
        strays |= vanishing & (self.parent[gone] != kept)
        self.parent[gone] = -1
        torn = np.zeros(len(rings.removed), dtype=bool)
        torn[rings.face_owner[row[strays]]] = True
        return torn

    def perform(self, rings: OneRings, performed: Mask, vertex_id: Indices) -> None:
        """Send the wedges of the removed to those of the kept, in faces as well.

        Wedges that no vanishing face sends anywhere go into the most alike at the kept vertex.
        """
        row = np.flatnonzero(performed[rings.face_owner])
        gone, vanishing = self._removed(rings, row), rings.vanishing[row]
        self.parent[gone[vanishing]] = self._kept(rings, row[vanishing])
        self._send(vertex_id[rings.removed[performed]], vertex_id[rings.kept[performed]])
        moving = row[~vanishing]
        corner, face, target = rings.corner[moving], rings.faces[moving], gone[~vanishing]
        for k, wedges in enumerate(self.corners):
            here = corner == k
            wedges[face[here]] = self.parent[target[here]]
        left = np.ones(len(self.corners[0]), dtype=bool)
        left[rings.faces[row[vanishing]]] = False
        self.corners = [wedges[left] for wedges in self.corners]

    def _send(self, removed: Indices, kept: Indices) -> None:
        """Give the wedges of removed vertices, as far as they have none, parents at the kept."""
        wedges, bounds = row_entries(self.wedges.first, removed)
        place = np.repeat(kept, np.diff(bounds))
        lost = self.parent[wedges] < 0
        wedges, place = wedges[lost], place[lost]
        self.parent[wedges] = self.wedges.nearest(wedges, place)

    def _removed(self, rings: OneRings, row: Indices) -> Ints:
        """Return the wedges (r,) of faces at the removed vertex."""
        return self._gather(rings.corner[row], rings.faces[row])

    def _kept(self, rings: OneRings, row: Indices) -> Ints:
        """Return the wedges (r,) of faces at the kept vertex; any other if it is none of theirs."""
        step = np.where(rings.left[row] == rings.kept[rings.face_owner[row]], 1, 2)
        return self._gather((rings.corner[row] + step) % 3, rings.faces[row])

    def _gather(self, corner: Integers, face: Indices) -> Ints:
        """Return the wedges (r,) of corners of faces."""
        found = np.empty(len(face), dtype=np.int32)
        for k, wedges in enumerate(self.corners):
            here = corner == k
            found[here] = wedges[face[here]]
        return found


def last_wedges(wedges: Wedges, parent: Ints, kept: Mask) -> Indices:
    """Return the wedge (w,) at a kept vertex that each wedge went into.

    Parameters
    ----------
    wedges : Wedges
    parent : (w,) int32
    kept : (n,) bool
        Vertices that are kept.
    """
    here = kept[wedges.vertex]
    ancestor = np.where(here, np.arange(len(parent)), parent)
    while True:
        further = ancestor[ancestor]
        if np.array_equal(further, ancestor):
            return ancestor
        ancestor = further
