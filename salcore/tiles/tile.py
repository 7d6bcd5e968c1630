# SPDX-License-Identifier: GPL-3.0-or-later
"""What is worked out for one tile: its maps and surface, and the order in which its core goes.

A tile has the points of its core and of a halo, so that whatever the core's points look at is
there. Only the core counts in statistics and results.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.blocks import set_workers
from ..arrays.types import Floats, Indices, Ints, Mask
from ..arrays.vectors import dot, face_normals
from ..decimation.order import eliminate
from ..decimation.surface import elimination_surface
from ..decimation.weights import weigh_cloud
from ..input.geometry import clean
from ..method.frames import build_frames
from ..method.graph import build_graph
from ..method.saliency import build_saliency
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .merge import Statistics, Whole


@dataclass(frozen=True, eq=False)
class Tile:
    """What of an analysed tile its order needs, over its n distinct points.

    Attributes
    ----------
    points : (n, 3) float64
        In the unit of the clean whole, in the order of a k-d tree.
    number : (n,) intp
        Place of each in the order of the input, which decides ties.
    input_of : (n,) intp
        Input point that each is: of equal ones the first.
    saliency : (n,) float64
        Before it is scaled.
    faces : (m, 3) int32
        Triangles on which neighbouring stars agree.
    low, high : (l,) int32
        Links along which points without triangles may go.
    core : (n,) bool
        Points that are no halo.
    normals : (n, 3) float64 or None
        For errors; the order does not need them.
    """

    points: Floats
    number: Indices
    input_of: Indices
    saliency: Floats
    faces: Ints
    low: Ints
    high: Ints
    core: Mask
    normals: Floats | None = None

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all but the normals as named arrays; ``Tile(**arrays)`` takes them back."""
        names = [field.name for field in dataclasses.fields(self) if field.name != "normals"]
        return {name: getattr(self, name) for name in names}

    def statistics(self) -> Statistics:
        """Return what this tile adds to the whole."""
        first = self.number[self.faces].argmin(axis=1)  # the corner whose tile counts a face
        mine = self.core[self.faces[np.arange(len(self.faces)), first]]
        double = face_normals(self.points, self.faces[mine])
        return Statistics.of_core(self.saliency[self.core], 0.5 * np.sqrt(dot(double, double)))


@dataclass(frozen=True, eq=False)
class Order:
    """When the points of a tile go, on the scale of the whole.

    Attributes
    ----------
    step : (n,) int32
        Step of the threshold; `LAST_STEP` for those that never go.
    cost : (n,) float64
        Of removal.
    error : (n,) float64
        Estimate of the error of the surface once each is gone, in the unit of the clean whole.
    """

    step: Ints
    cost: Floats
    error: Floats


def analyse_tile(
    points: Floats,
    core: Mask,
    box: tuple[Floats, Floats],
    parameters: Parameters,
    progress: Progress = SILENT,
) -> Tile:
    """Return a tile with its saliency and surface.

    Parameters
    ----------
    points : (N, 3) float64
        Of core and halo, in the order of the whole cloud; equal points are welded.
    core : (N,) bool
        Points of the core. One of several equal ones is enough: these lie in the same place.
    box : ((3,) float64, (3,) float64)
        Lowest and highest coordinates of the whole cloud.
    parameters : Parameters
    progress : Progress, optional

    Notes
    -----
    O(N log N) time, as `salcore.analyze`.
    """
    with set_workers(parameters.workers):
        geometry = clean(points, None, None, parameters, box)
        graph = build_graph(geometry, parameters, progress.part(0.0, 0.6, "Graph"))
        frames = build_frames(geometry, graph, parameters, progress.part(0.6, 0.75, "Normals"))
        part = progress.part(0.75, 0.9, "Saliency")
        saliency = build_saliency(geometry.points, graph, frames, parameters, part)
        part = progress.part(0.9, 1.0, "Surface")
        faces, links = elimination_surface(geometry, graph, parameters, part)
    return Tile(
        geometry.points,
        geometry.number,
        geometry.input_of,
        saliency.raw,
        faces,
        *links,
        core[geometry.input_of],
        frames.normals,
    )


def order_tile(
    tile: Tile, whole: Whole, parameters: Parameters, progress: Progress = SILENT
) -> Order:
    """Return when the input points of a tile go.

    Parameters
    ----------
    tile : Tile
    whole : Whole
        From `merge_statistics` of all tiles.
    parameters : Parameters
    progress : Progress, optional

    Notes
    -----
    Of equal points the first stands for all; the others go at once, at step `LOWEST`, and points
    that are not finite before them.
    """
    with set_workers(parameters.workers):
        elimination = eliminate(
            tile.points,
            tile.faces,
            (tile.low, tile.high),
            weigh_cloud(whole.scaled(tile.saliency), parameters),
            progress=progress,
            priority=tile.number,
            scale=whole.scale,
        )
    assert elimination.step is not None
    assert elimination.cost is not None
    return Order(elimination.step, elimination.cost, elimination.error)
