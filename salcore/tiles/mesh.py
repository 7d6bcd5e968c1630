# SPDX-License-Identifier: GPL-3.0-or-later
"""What is worked out for one tile of a mesh: its saliency, and the order in which vertices go.

A mesh goes in passes. The first has tiles of the mesh as it is, and leaves more than is wanted in
the end; the next ones have what is left, in fewer boxes that are turned against the first, so that
what was held at the borders of tiles lies inside. What a vertex stands for goes along with it, so
that the passes are one elimination (`pieces`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays.blocks import set_workers
from ..arrays.edges import find_edges
from ..arrays.types import Floats, Indices, Integers, Ints, Mask
from ..arrays.vectors import dot, face_normals
from ..decimation.costs import FLAT_EVENNESS, Costs, Weights
from ..decimation.cut import cut_faces, last_ancestors
from ..decimation.half_edges import HalfEdges
from ..decimation.order import Elimination, number_vertices, run_rounds
from ..decimation.parts import Parts
from ..decimation.quadrics import monomials, vertex_quadrics
from ..decimation.rounds import State
from ..decimation.targets import count_for_faces
from ..decimation.thresholds import Thresholds, first_step
from ..input.geometry import Geometry, clean
from ..method.frames import build_frames
from ..method.graph import build_graph
from ..method.saliency import build_saliency
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .merge import Statistics, Whole
from .pieces import Numbers, Piece, first_corner_owned

EARLIER = 24
"""Steps by which the first threshold is below that of clouds: a tenth. What was held at the borders
of tiles is dense, and goes in the order of its costs, too. On a scan errors are 2 % smaller."""


@dataclass(frozen=True, eq=False)
class MeshTile:
    """A tile of a mesh that has been analysed: n vertices and m faces, of core and next to it.

    Attributes
    ----------
    number : (n,) int64
        Input point of each vertex.
    points : (n, 3) float64
    saliency : (n,) float64
        Before it is scaled.
    owned : (n,) bool
        Vertices of the core.
    faces : (m, 3) int32
        All that have a vertex of the core.
    face_number : (m,) int64
    copies : (2, c) int64
        Input points in the core that equal another, which stands for them, and these.
    backs : int
        Faces of the core that are others turned over, and are left out.
    """

    number: Numbers
    points: Floats
    saliency: Floats
    owned: Mask
    faces: Ints
    face_number: Numbers
    copies: Numbers
    backs: int

    def statistics(self) -> Statistics:
        """Return what this tile adds to the whole."""
        mine = first_corner_owned(self.points, self.faces, self.owned)
        double = face_normals(self.points, self.faces[mine])
        return Statistics.of_core(self.saliency[self.owned], 0.5 * np.sqrt(dot(double, double)))


def analyse_mesh_tile(
    points: Floats,
    faces: Integers,
    number: Numbers,
    face_number: Numbers,
    core: Mask,
    box: tuple[Floats, Floats],
    parameters: Parameters,
    progress: Progress = SILENT,
) -> MeshTile:
    """Return a tile with its saliency.

    Parameters
    ----------
    points : (N, 3) float64
        Corners of the faces. Equal ones are welded, those that are not finite dropped.
    faces : (F, 3) int
        All that reach into the core's box or a halo round it.
    number : (N,) int64
        Of each point in the whole, ascending.
    face_number : (F,) int64
    core : (N,) bool
        Points in the core's box.
    box : ((3,) float64, (3,) float64)
        Lowest and highest coordinates of the whole.
    parameters : Parameters
    progress : Progress, optional

    Notes
    -----
    O(N log N) time, as `salcore.analyze`.
    """
    with set_workers(parameters.workers):
        geometry = clean(points, faces, None, parameters, box)
        graph = build_graph(geometry, parameters, progress.part(0.0, 0.4, "Graph"))
        frames = build_frames(geometry, graph, parameters, progress.part(0.4, 0.6, "Normals"))
        part = progress.part(0.6, 1.0, "Saliency")
        saliency = build_saliency(geometry.points, graph, frames, parameters, part).raw
        del graph, frames
    return _core_of(geometry, saliency, number, face_number, core)


def _core_of(
    geometry: Geometry, saliency: Floats, number: Numbers, face_number: Numbers, core: Mask
) -> MeshTile:
    """Return the faces of a tile with a vertex in its core, and their vertices."""
    owned, standing = core[geometry.input_of], geometry.input_of
    chosen = owned[geometry.faces].any(axis=1)
    used = np.zeros(len(owned), dtype=bool)
    used[geometry.faces[chosen]] = True
    place = (np.cumsum(used) - 1).astype(np.int32)
    other = np.flatnonzero(core & (geometry.vertex_of >= 0) & ~geometry.loose)
    other = other[standing[geometry.vertex_of[other]] != other]
    backs = 0
    if geometry.backs is not None:
        fronts = geometry.faces[geometry.backs.front]
        backs = int(first_corner_owned(geometry.points, fronts, owned).sum())
    # Vertices are in the order of their first points, which need not be those that stand for them.
    order = np.argsort(number[standing[used]], kind="stable")
    rank = np.empty(len(order), dtype=np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    kept = np.flatnonzero(used)[order]
    return MeshTile(
        number[standing[kept]],
        geometry.points[kept],
        saliency[kept],
        owned[kept],
        rank[place[geometry.faces[chosen]]],
        face_number[geometry.face_of[chosen]],
        number[np.stack([other, standing[geometry.vertex_of[other]]])],
        backs,
    )


def start_piece(tile: MeshTile, whole: Whole, parameters: Parameters) -> Piece:
    """Return a tile as the first pass begins with it.

    Parameters
    ----------
    tile : MeshTile
    whole : Whole
        From `merge_statistics` of all tiles.
    parameters : Parameters
    """
    count = len(tile.points)
    with set_workers(parameters.workers):
        edges = find_edges(tile.faces, count)
        quadrics, areas = vertex_quadrics(
            tile.points,
            tile.faces,
            edges,
            parameters.border_weight,
            mean_face=whole.scale.mean_face,
        )
        factor = 1.0 + parameters.detail * whole.scaled(tile.saliency)
        weights = Weights(
            factor,
            evenness=np.full(count, FLAT_EVENNESS),
            guessed_surface=np.zeros(count, dtype=bool),
            protected=np.zeros(count, dtype=bool),
            border=parameters.border_weight,
        )
        costs = Costs.of_vertices(tile.points, quadrics, areas, weights, whole.scale.mean_area)
    return Piece(
        tile.number,
        tile.points,
        costs.quadric,
        costs.area,
        costs.self_error,
        factor,
        tile.owned,
        tile.faces,
        tile.face_number,
    )


def order_piece(
    piece: Piece,
    held: Mask,
    parameters: Parameters,
    mean_area: float,
    *,
    alone: bool = False,
    keep_topology: bool = False,
    progress: Progress = SILENT,
) -> Elimination:
    """Return the order in which the vertices of a piece go.

    Parameters
    ----------
    piece : Piece
    held : (n,) bool
        Vertices that stay.
    parameters : Parameters
    mean_area : float
        Mean area that a vertex of the whole stands for: steps and costs are on one scale for all.
    alone : bool
        Whether the piece is all there is, so that parts may go whole, holes close, and all vertices
        go but one. In one of several pieces the topology stays.
    keep_topology : bool
        Whether it stays in any case.
    progress : Progress, optional

    Notes
    -----
    O(n log n) time, some 550 bytes a vertex.
    """
    count = len(piece.points)
    with set_workers(parameters.workers):
        costs = Costs(
            piece.points,
            monomials(piece.points),
            piece.quadric.copy(),
            piece.area.copy(),
            piece.error.copy(),
            piece.factor,
            held,
        )
        edges = find_edges(piece.faces, count)
        nowhere = np.zeros(len(edges.low), dtype=bool)
        state = State(
            costs,
            HalfEdges.of_edges(edges.low, edges.high, nowhere, costs, None),
            corners=[np.array(corner, dtype=np.int32, order="C") for corner in piece.faces.T],
            degree=np.bincount(edges.low, minlength=count)
            + np.bincount(edges.high, minlength=count),
            guessed=np.zeros(count, dtype=bool),
            vertex_id=np.arange(count),
            cluster_size=np.ones(count),
            parent=np.full(count, -1, dtype=np.intp),
            mean_square=np.zeros(count),
            living=count,
            thresholds=Thresholds(first_step(mean_area) - EARLIER),
            is_tile=not alone,
            keep_topology=keep_topology or not alone,
        )
        if not state.keep_topology:
            weights = Weights(piece.factor, np.zeros(0), state.guessed, held, 0.0)
            state.parts = Parts.find((edges.low, edges.high), costs, weights, None)
        del edges
        run_rounds(state, progress)
        return number_vertices(state)


def falling_faces(piece: Piece) -> NDArray[np.uint8]:
    """Return how many faces go with each vertex (n,) as long as the topology stays.

    One on a border, two elsewhere.
    """
    edges = find_edges(piece.faces, len(piece.number))
    single = edges.uses == 1
    result = np.full(len(piece.number), 2, dtype=np.uint8)
    result[edges.low[single]] = result[edges.high[single]] = 1
    return result


def count_for_piece(piece: Piece, elimination: Elimination, faces: int) -> int:
    """Return the most vertices of a piece that is alone which leave no more faces than these."""
    corners = piece.faces.astype(np.intp)

    def measure(count: int) -> int:
        source = sources_of(elimination.parent, elimination.rank < count)
        return len(cut_faces(corners, source)[1])

    return max(count_for_faces(faces, measure, len(piece.number)), 1)


def sources_of(parent: Indices, kept: Mask) -> Indices:
    """Return the kept vertex (n,) that each vertex went into; `kept` (n,) is any cut."""
    return last_ancestors(np.where(kept, np.arange(len(kept)), parent))[0]
