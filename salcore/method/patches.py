# SPDX-License-Identifier: GPL-3.0-or-later
"""Local patches of normal deviation (paper §3.1 and §3.2, equations 3.1 to 3.3).

All functions work on the edges (i, j) of a block of vertices in compressed sparse rows: `indptr`
bounds each vertex's edges, `row` numbers the vertex of every edge from the block's start.
"""

from __future__ import annotations

import numpy as np

from ..arrays.rows import row_max, row_sum
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import cross, dot

FULL_TURN = 360.0
PERCENT = 100.0  # λ of (3.3)
ROUNDING = 1e-6
"""Degrees that rounded coordinates turn the normals of a plane by; such angles count as none."""


def normal_angle(first: Floats, second: Floats, oriented: Mask, *, squared: bool = False) -> Floats:
    """Return the angle between pairs of unit normals, (3.2).

    Parameters
    ----------
    first, second : (e, 3) float64
        Unit normals; a zero normal is unknown and deviates from nothing.
    oriented : (e,) bool
        Where True the normals' signs count and angles reach 180 degrees; elsewhere the angle is
        that between lines, at most 90 degrees.
    squared : bool
        Take the arc cosine of the squared product, as printed: about √2 times small angles.

    Returns
    -------
    (e,) float64
        Degrees.
    """
    product = dot(first, second)
    normal = cross(first, second)
    sine = np.sqrt(dot(normal, normal))
    if squared:
        # The arc cosine of the square, by a form that keeps the digits of small angles.
        angle = np.arctan2(sine * np.sqrt(1.0 + product**2), product**2)
    else:
        # The arc cosine alone loses half the digits of a small angle.
        angle = np.arctan2(sine, np.where(oriented, product, np.abs(product)))
    degrees = np.degrees(angle)
    known = (sine > 0.0) | (product != 0.0)
    return np.where(known & (degrees > ROUNDING), degrees, 0.0)


def deviation_factor(angle: Floats, *, whole_percent: bool = False) -> Floats:
    """Return the deviation factor DF of angles in degrees, in per cent of a full turn, (3.3)."""
    factor = angle / FULL_TURN * PERCENT
    return np.floor(factor) if whole_percent else factor


def patch_side(u: Floats, v: Floats, indptr: Integers) -> Floats:
    """Return the side L of each patch, (3.1).

    Twice the distance of the farthest projected neighbour, so that every neighbour falls into
    the square centred on the vertex; the printed square of a length does not scale.

    Parameters
    ----------
    u, v : (e,) float64
        Neighbours projected on the principal directions, relative to their vertex.
    indptr : (b + 1,) int

    Returns
    -------
    (b,) float64
    """
    return 2.0 * np.sqrt(row_max(u * u + v * v, indptr))


def patch_cells(u: Floats, v: Floats, side: Floats, cells: int) -> Indices:
    """Return the cell of each projected neighbour in its patch's lattice of cells².

    Parameters
    ----------
    u, v : (e,) float64
    side : (e,) float64
        Side of the patch of each edge's vertex. The outer cells include the patch's border.
    cells : int
        Cells along a side, n.

    Returns
    -------
    (e,) intp in [0, cells²)
    """
    width = np.where(side > 0.0, side, 1.0) / cells
    column = np.clip((u / width + 0.5 * cells).astype(np.intp), 0, cells - 1)
    line = np.clip((v / width + 0.5 * cells).astype(np.intp), 0, cells - 1)
    return line * cells + column


def mean_of_cells(
    deviation: Floats, cell: Indices, row: Integers, indptr: Integers, cells: int
) -> Floats:
    """Return A, the mean over a patch's filled cells of each cell's mean deviation factor.

    Parameters
    ----------
    deviation : (e,) float64
    cell : (e,) intp
    row : (e,) int
    indptr : (b + 1,) int
    cells : int

    Returns
    -------
    (b,) float64
        Zero for a patch without neighbours.

    Notes
    -----
    With m members in a neighbour's cell, cells' means sum to Σ DF/m and filled cells to Σ 1/m.
    """
    key = row * cells**2 + cell
    members = np.bincount(key)[key] if len(key) else np.empty(0)
    filled = row_sum(1.0 / members, indptr)
    return row_sum(deviation / members, indptr) / np.maximum(filled, 1.0)
