# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame at every vertex: normal, principal directions, curvature, scale (paper §2.2, 3.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .blocks import BLOCK, rest_blocks, run_blocks
from .geometry import Floats, Geometry
from .graph import Graph
from .parameters import Parameters
from .planes import fit_normals, tangent_basis, vertex_normals_steps
from .progress import Rests, Steps
from .rows import row_max, row_mean, row_sum

FOLDS = 0.01
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
    minor, major : (n, 3) float64
        Principal directions c0 and c1: the tangent directions in which the neighbours spread
        least and most, of arbitrary sign.
    curvature : (n,) float64
        Mean curvature K in reciprocal lengths, positive where the surface bends towards the
        normal.
    scale : (n,) float64
        Distance of the farthest neighbour, (3.5); zero without neighbours.
    """

    normals: Floats
    oriented: NDArray[np.bool_]
    minor: Floats
    major: Floats
    curvature: Floats
    scale: Floats


def build_frames(geometry: Geometry, graph: Graph, parameters: Parameters) -> Steps[Frames]:
    """Yield the fraction done and return the frame of every vertex.

    Notes
    -----
    The mean curvature is the mean over D(i) of the normal curvatures
    ``2 (v_j - v_i)·N_i / |v_j - v_i|²`` (Euler's theorem: the mean over all directions is the mean
    curvature). It is exact on spheres and approximate where the neighbours lie unevenly.

    O(e) time for e edges; 100 bytes a vertex for the result.
    """
    points, count = geometry.points, len(geometry.points)
    normals, oriented = yield from _known_normals(geometry, graph, parameters)
    yield None
    asked = parameters.angle == "oriented"
    if not asked and not (yield from _consistent(normals, oriented, graph, parameters.workers)):
        oriented = np.zeros(count, dtype=bool)
    minor, major = np.empty((count, 3)), np.empty((count, 3))
    curvature, scale = np.empty(count), np.empty(count)

    def kernel(start: int, stop: int) -> None:
        edges, row, other = graph.edges(start, stop)
        indptr = graph.indptr[start : stop + 1] - edges.start
        block, row = slice(start, stop), row - start
        offsets = points[other] - points[block][row]
        unknown = ~normals[block].any(axis=1)
        if unknown.any():
            normals[block][unknown] = fit_normals(_covariance(offsets, row, indptr)[unknown])
        square = np.einsum("ec,ec->e", offsets, offsets)
        height = np.einsum("ec,ec->e", offsets, normals[block][row])
        curvature[block] = row_mean(2.0 * height / square, indptr)
        scale[block] = np.sqrt(row_max(square, indptr))
        minor[block], major[block] = _principal_directions(offsets, normals[block], row, indptr)

    yield from run_blocks(kernel, count, workers=parameters.workers)
    return Frames(normals, oriented, minor, major, curvature, scale)


def _known_normals(
    geometry: Geometry, graph: Graph, parameters: Parameters
) -> Rests[tuple[Floats, NDArray[np.bool_]]]:
    """Return given normals, else those of the faces, else those of the stars' planes, else zero."""
    count = len(geometry.points)
    normals = np.zeros((count, 3))
    if parameters.normals == "best":
        if geometry.normals is not None:
            normals = geometry.normals.copy()
        elif len(geometry.faces):
            faces, workers = geometry.faces, parameters.workers
            normals = yield from vertex_normals_steps(geometry.points, faces, workers)
    yield
    oriented = np.asarray(normals.any(axis=1))
    if graph.plane_normals is not None and parameters.normals == "best":
        normals[~oriented] = graph.plane_normals[~oriented]
    return normals, oriented


def _consistent(
    normals: Floats, oriented: NDArray[np.bool_], graph: Graph, workers: int
) -> Rests[bool]:
    """Return whether at most `FOLDS` of the edges join oriented normals of opposite sense."""
    if not oriented.any():
        return False
    opposite = np.zeros(len(normals) // BLOCK + 1, dtype=np.intp)

    def look(start: int, stop: int) -> None:
        _, row, other = graph.edges(start, stop)
        product = np.einsum("ec,ec->e", normals[row], normals[other])
        against = (product < 0.0) & oriented[row] & oriented[other]
        opposite[start // BLOCK] = np.count_nonzero(against)

    yield from rest_blocks(look, len(normals), workers=workers)
    return int(opposite.sum()) <= FOLDS * len(graph.indices)


def _covariance(offsets: Floats, row: NDArray[np.intp], indptr: NDArray[np.integer]) -> Floats:
    """Return the covariance matrices (b, 3, 3) of the neighbours, (2.2), about their mean (2.1)."""
    mean = row_sum(offsets, indptr) / np.maximum(np.diff(indptr), 1)[:, None]
    x, y, z = (offsets - mean[row]).T
    result = np.empty((len(mean), 3, 3))
    for (a, b), product in zip(
        [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)],
        [x * x, x * y, x * z, y * y, y * z, z * z],
        strict=True,
    ):
        result[:, a, b] = result[:, b, a] = row_sum(product, indptr)
    return result


def _principal_directions(
    offsets: Floats, normals: Floats, row: NDArray[np.intp], indptr: NDArray[np.integer]
) -> tuple[Floats, Floats]:
    """Return the directions c0 and c1 of least and greatest spread in the tangent plane.

    They are the eigenvectors of the covariance (2.2) of the projected neighbours, by the closed
    form for 2x2 matrices; for a normal fitted to D(i) they are those of the 3x3 matrix itself.
    """
    first, second = tangent_basis(normals)
    u = np.einsum("ec,ec->e", offsets, first[row])
    v = np.einsum("ec,ec->e", offsets, second[row])
    mean_u, mean_v = row_mean(u, indptr), row_mean(v, indptr)
    uu = row_mean(u * u, indptr) - mean_u**2
    vv = row_mean(v * v, indptr) - mean_v**2
    uv = row_mean(u * v, indptr) - mean_u * mean_v
    angle = 0.5 * np.arctan2(2.0 * uv, uu - vv)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return cosine * second - sine * first, cosine * first + sine * second
