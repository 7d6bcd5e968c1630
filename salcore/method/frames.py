# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame at every vertex: normal, principal directions, curvature, radius (paper §2.2, 3.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.blocks import BLOCK, run_blocks
from ..arrays.rows import row_max, row_mean
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import dot
from ..input.geometry import Geometry
from ..parameters import Parameters
from ..progress import SILENT, Progress
from .graph import Graph
from .planes import covariance, fit_normals, tangent_basis, vertex_normals

MAX_OPPOSED_SHARE = 0.01
"""Share of edges that may join normals over 90 degrees apart on a consistently oriented surface:
sharp folds do so too, but they are few."""


@dataclass(frozen=True, eq=False)
class Frames:
    """What is known of the surface at each vertex.

    Attributes
    ----------
    normals : (n, 3) float64
        Unit normals, zero where there is none.
    oriented : (n,) bool
        Whether the normal's sign means something: a given normal or one of faces, where
        neighbours rarely disagree or ``angle="oriented"`` asks for it.
    curvature : (n,) float64
        Mean curvature K in reciprocal lengths, positive where the surface bends towards the
        normal.
    radius : (n,) float64
        Distance σ of the farthest neighbour, (3.5); zero without neighbours.
    """

    normals: Floats
    oriented: Mask
    curvature: Floats
    radius: Floats


def build_frames(
    geometry: Geometry, graph: Graph, parameters: Parameters, progress: Progress = SILENT
) -> Frames:
    """Return the frame of every vertex.

    Notes
    -----
    The mean curvature is the mean over D(i) of the normal curvatures
    ``2 (v_j - v_i)·N_i / |v_j - v_i|²`` (Euler's theorem: the mean over all directions is the mean
    curvature). It is exact on spheres and approximate where the neighbours lie unevenly.

    O(e) time for e edges; 41 bytes a vertex for the result.
    """
    points, count = geometry.points, len(geometry.points)
    normals, oriented = _known_normals(geometry, graph, parameters)
    if parameters.angle != "oriented" and not _consistent(normals, oriented, graph):
        oriented = np.zeros(count, dtype=bool)
    curvature, radius = np.empty(count), np.empty(count)

    def fit(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        row, indptr, block = edges.local, edges.indptr, edges.vertices
        offsets = points[edges.other] - points[block][row]
        unknown = ~normals[block].any(axis=1)
        if unknown.any():
            normals[block][unknown] = fit_normals(covariance(offsets, row, indptr)[unknown])
        square = dot(offsets, offsets)
        height = dot(offsets, normals[block][row])
        curvature[block] = row_mean(2.0 * height / square, indptr)
        radius[block] = neighborhood_radius(square, indptr)

    run_blocks(fit, count, progress)
    return Frames(normals, oriented, curvature, radius)


def _known_normals(geometry: Geometry, graph: Graph, parameters: Parameters) -> tuple[Floats, Mask]:
    """Return given normals, else those of the faces, else those of the stars' planes, else zero."""
    normals = np.zeros((len(geometry.points), 3))
    if parameters.normals == "best":
        if geometry.normals is not None:
            normals = geometry.normals.copy()
        elif len(geometry.faces):
            normals = vertex_normals(geometry.points, geometry.faces)
    oriented = np.asarray(normals.any(axis=1))
    if graph.plane_normals is not None and parameters.normals == "best":
        normals[~oriented] = graph.plane_normals[~oriented]
    return normals, oriented


def _consistent(normals: Floats, oriented: Mask, graph: Graph) -> bool:
    """Return whether hardly any edges join oriented normals of opposite sense."""
    if not oriented.any():
        return False
    opposed = np.zeros(len(normals) // BLOCK + 1, dtype=np.intp)

    def look(start: int, stop: int) -> None:
        edges = graph.edges(start, stop)
        row, other = edges.row, edges.other
        against = (dot(normals[row], normals[other]) < 0.0) & oriented[row] & oriented[other]
        opposed[start // BLOCK] = np.count_nonzero(against)

    run_blocks(look, len(normals))
    return int(opposed.sum()) <= MAX_OPPOSED_SHARE * len(graph.indices)


def neighborhood_radius(square: Floats, indptr: Integers) -> Floats:
    """Return σ (b,) of (3.5), the distance of the farthest neighbour, from squared distances."""
    return np.sqrt(row_max(square, indptr))


def principal_directions(
    offsets: Floats, normals: Floats, row: Indices, indptr: Integers
) -> tuple[Floats, Floats]:
    """Return the directions c0 and c1 (b, 3) of least and greatest spread in the tangent plane.

    They are the eigenvectors of the covariance (2.2) of the projected neighbours, by the closed
    form for 2x2 matrices; for a normal fitted to D(i) they are those of the 3x3 matrix itself.
    Their signs are arbitrary.

    Parameters
    ----------
    offsets : (e, 3) float64
        Neighbours, relative to their vertex.
    normals : (b, 3) float64
    row : (e,) int
        Vertex of each offset, counted from the block's first.
    indptr : (b + 1,) int
    """
    first, second = tangent_basis(normals)
    u, v = dot(offsets, first[row]), dot(offsets, second[row])
    mean_u, mean_v = row_mean(u, indptr), row_mean(v, indptr)
    uu = row_mean(u * u, indptr) - mean_u**2
    vv = row_mean(v * v, indptr) - mean_v**2
    uv = row_mean(u * v, indptr) - mean_u * mean_v
    angle = 0.5 * np.arctan2(2.0 * uv, uu - vv)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return cosine * second - sine * first, cosine * first + sine * second
