# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh that is simplified by tiles, and the passes that this takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .job import Job
from .ply_blocks import Layout

FACES = 4_000_000
"""Faces that one task spills."""
SHARES = (2 / 3, 1.05, 1.01, 1.0)
"""What the passes leave: the first the ratio to the power of this, so that each has a like share of
the work; the others so many times the points that are wanted, less and less, for the borders of the
last stay as they are. A pass whose mesh fits into one tile is the last."""
ROOM = 1.5
"""What a further pass leaves if that fits into one tile, and the next pass is the last: there the
borders of this one become like all else."""


@dataclass(frozen=True, kw_only=True)
class MeshJob(Job):
    """A run on a mesh. It pickles.

    Attributes
    ----------
    layout : Layout
    keep_border, keep_topology : bool
        As in `salcore.Analysis.simplify`.
    """

    layout: Layout
    keep_border: bool = False
    keep_topology: bool = False

    def manifest(self) -> dict[str, object]:
        """Return what two runs that share a folder must have in common."""
        base = Job(
            self.folder, self.sources, self.parameters, self.target, self.value, self.most
        )  # the layout follows from the file
        kept = {"keep_border": self.keep_border, "keep_topology": self.keep_topology}
        return base.manifest() | kept

    def face_ranges(self) -> list[tuple[int, int]]:
        """Return the bounds of the faces that tasks spill."""
        total = self.layout.faces.length
        return [(start, min(start + FACES, total)) for start in range(0, total, FACES)]


@dataclass(frozen=True, eq=False)
class Pass:
    """One pass over the mesh, or what the last one left of it.

    Attributes
    ----------
    turn : int
        Its number, from 0; boxes are turned by it.
    boxes : (t, 2, 3) float64
        Corners of the tiles: of the file in the first pass, then of the clean geometry.
    sources : list of list of int
        For each tile, those of the last pass that it takes from.
    """

    turn: int
    boxes: NDArray[np.float64]
    sources: list[list[int]]

    def reached_by(self, job: MeshJob, boxes: NDArray[np.float64]) -> list[list[int]]:
        """Return which tiles each box (t, 2, 3) of the next pass takes from, once this is done."""
        tiles = range(len(self.boxes))
        ends = []
        for tile in tiles:
            with np.load(job.path(f"left-{self.turn}-{tile}.npz")) as found:
                ends.append((found["low"], found["high"]))
        return [
            [k for k in tiles if (ends[k][0] <= box[1]).all() and (ends[k][1] >= box[0]).all()]
            for box in boxes
        ]

    @property
    def alone(self) -> bool:
        """Whether there is one tile only, which is the whole."""
        return len(self.boxes) == 1
