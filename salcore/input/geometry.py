# SPDX-License-Identifier: GPL-3.0-or-later
"""Input checking and cleaning: arrays are checked, cleaned, welded and centred once.

`Geometry` holds distinct, finite, centred points. Its two index maps lead back to the input, so
results can speak of the input's own indices whatever was dropped or welded on the way in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ..arrays.blocks import run_blocks
from ..arrays.check import indices, real_numbers
from ..arrays.types import Floats, Indices, Integers, Mask
from ..arrays.vectors import sum_by_label, unit
from ..errors import GeometryError
from ..parameters import Parameters, checked
from .backs import Backs, find_backs, make_backs

MAX_EXPONENT = 1024
"""Exponent of the largest doubles."""
UNDERFLOW = 2.0**-200
"""Share of the diagonal below which a centred coordinate counts as zero: the fourth power of any
difference that is left, such as an area's square, is a normal double."""

SCATTERED = 1 << 14
"""Points of a cloud from which on they are put into the order of a k-d tree; fewer lie in the
processor's cache in any order."""


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane of symmetry at which a half of a geometry ends.

    Attributes
    ----------
    on_plane : (n,) bool
        Vertices on it.
    axis : int
        It is where this coordinate is constant.
    at : float
        The coordinate, of the clean points.
    """

    on_plane: Mask
    axis: int
    at: float


@dataclass(frozen=True, eq=False)
class Geometry:
    """Clean geometry.

    Attributes
    ----------
    points : (n, 3) float64
        Distinct finite points, centred on their bounding box and scaled by a power of two
        (exactly) to a diagonal in [0.5, 1); less where the input's is no normal double.
    faces : (m, 3) intp
        Faces without repeated corners; empty for a cloud.
    face_of : (m,) intp
        Input face that each face is.
    normals : (n, 3) float64 or None
        Given normals, unit or zero.
    to_unit : float
        Factor from the input's unit of length to that of `points`. A power of two.
    centre : (3,) float64
        Input positions are ``points / to_unit + centre``.
    vertex_of : (N,) intp
        Vertex that stands for each input point, -1 where the point was dropped.
    input_of : (n,) intp
        Input point that stands for each vertex: the first, or one that a face uses if not all do.
    number : (n,) intp
        Number of each vertex in the order of the input, which decides ties. The vertices of a large
        cloud are in the order of a k-d tree, so that neighbours lie together in memory (a fifth of
        the time on LiDAR); others stay as they are.
    loose : (N,) bool
        Input points that no face uses.
    corner_points : (m, 3) intp or None
        Input points at the corners of `faces`, where these use several that are equal.
    given_faces : int
        Number of faces of the input.
    coordinates : (N, 3) float64
        The input's points as they are, for positions that must not be rounded.
    backs : Backs or None
        Faces that are others turned over, which are not among `faces`.
    plane : Plane or None
        Where this is one half of a symmetrical whole: where it ends, without ending there.
    """

    points: Floats
    faces: Indices
    face_of: Indices
    normals: Floats | None
    to_unit: float
    centre: Floats
    vertex_of: Indices
    input_of: Indices
    number: Indices
    loose: Mask
    coordinates: Floats
    corner_points: Indices | None = None
    given_faces: int = 0
    backs: Backs | None = None
    plane: Plane | None = None

    @property
    def input_count(self) -> int:
        """Number of input points."""
        return len(self.vertex_of)

    @property
    def priority(self) -> Indices | None:
        """`number` where it is not the order of the vertices themselves."""
        in_order = len(self.faces) or len(self.number) < SCATTERED
        return None if in_order else self.number

    @property
    def available(self) -> int:
        """Number of points to choose from: equal ones that faces use count once."""
        standing = np.zeros(self.input_count, dtype=bool)
        standing[self.input_of] = True
        others = (self.vertex_of >= 0) & self.loose & ~standing
        return len(self.points) + int(np.count_nonzero(others))

    def input_corners(self, corners: Integers) -> NDArray[np.int64]:
        """Return the corners of the input's faces that corners of the clean ones are."""
        face, corner = np.divmod(corners, 3)
        return 3 * self.face_of[face].astype(np.int64) + corner

    @property
    def face_count(self) -> int:
        """Number of valid faces, backs included."""
        return len(self.faces) + (0 if self.backs is None else len(self.backs.face))

    @property
    def unit_diagonal(self) -> float:
        """Diagonal of the clean points' bounding box, in their own unit."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0))) if len(self.points) else 0.0


def clean(
    points: ArrayLike,
    faces: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    parameters: Parameters | None = None,
    box: tuple[Floats, Floats] | None = None,
) -> Geometry:
    """Check input arrays and bring them into the form that everything else trusts.

    Parameters
    ----------
    points : (N, 3) array_like of real numbers
        Coordinates in any unit. Rows with NaN or infinity are dropped, or refused with
        ``invalid="refuse"``. Equal points are welded.
    faces : (F, 3) array_like of integers, optional
        Corners of triangles. Faces with a dropped point or a repeated corner are left out.
    normals : (N, 3) array_like of real numbers, optional
        Of any length; zero or invalid normals are treated as absent.
    parameters : Parameters, optional
        Only `invalid` matters here.
    box : ((3,) float64, (3,) float64), optional
        Lowest and highest coordinates of the whole that the points are a part of: they are centred
        and scaled as the whole is.

    Raises
    ------
    GeometryError
        If an array has the wrong shape or type, an index is out of range, or an invalid point is
        refused.

    Notes
    -----
    O(N log N) time, about 150 bytes a point. Points count as equal that are within 1e-60 of the
    diagonal of each other, which only happens next to the box's centre.
    """
    parameters = checked(parameters)
    coordinates = _matrix(points, "points")
    triangles = indices(faces, "faces", "triangles", 3, len(coordinates))
    given = _check_normals(normals, len(coordinates))
    finite = np.asarray(np.isfinite(coordinates).all(axis=1))
    if parameters.invalid == "refuse" and not finite.all():
        bad = np.flatnonzero(~finite)
        raise GeometryError(
            f"points: {len(bad)} of {len(finite)} are NaN or infinite (the first is number "
            f"{bad[0]}); remove them, or set invalid='drop'"
        )
    kept = np.flatnonzero(finite)
    centred, to_unit, centre = _centre(coordinates[kept], box)
    welded, first = weld_points(centred)
    number = np.arange(len(first))
    if not len(triangles) and len(first) >= SCATTERED:
        number = cKDTree(centred[first], balanced_tree=False).indices
        first = first[number]
        welded = np.argsort(number)[welded]
    vertex_of = np.full(len(finite), -1, dtype=np.intp)
    vertex_of[kept] = welded
    corners, face_of = _clean_faces(triangles, vertex_of)
    used = triangles[face_of].astype(np.intp)
    input_of = kept[first]
    input_of[corners.ravel()[::-1]] = used.ravel()[::-1]
    loose = np.ones(len(finite), dtype=bool)
    loose[used] = False
    backs = None
    back, front = find_backs(corners, len(first))
    if len(back):
        backs = make_backs(corners, face_of, used, back, front)
        fronts = np.ones(len(corners), dtype=bool)
        fronts[back] = False
        corners, face_of, used = corners[fronts], face_of[fronts], used[fronts]
        input_of[corners.ravel()[::-1]] = used.ravel()[::-1]
    split = (input_of[corners] != used).any()
    return Geometry(
        points=centred[first],
        faces=corners,
        face_of=face_of,
        normals=_clean_normals(given, kept, welded, len(first)),
        to_unit=to_unit,
        centre=centre,
        vertex_of=vertex_of,
        input_of=input_of,
        number=number,
        loose=loose,
        coordinates=coordinates,
        corner_points=used if split else None,
        given_faces=len(triangles),
        backs=backs,
    )


def _matrix(values: ArrayLike, name: str) -> Floats:
    """Return `values` as a contiguous (N, 3) float64 array."""
    array = real_numbers(values, name, "an array of real numbers of shape (N, 3)")
    if array.shape in ((0,), (0, 0)):
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise GeometryError(f"{name} of shape {array.shape}: give an array of shape (N, 3)")
    return array


def box_frame(low: Floats, high: Floats) -> tuple[int, Floats, int]:
    """Return the exponents and the centre that bring a box to a diagonal in [0.5, 1).

    Positions become ``(position * 2**-first - centre) * 2**-second``. Powers of two round nothing,
    and the first keeps the largest and least doubles in range.

    Raises
    ------
    GeometryError
        If the diagonal is no double.
    """
    first = int(np.frexp(np.maximum(np.abs(low), np.abs(high)).max())[1])
    low, high = np.ldexp(low, -first), np.ldexp(high, -first)
    second = int(np.frexp(np.linalg.norm(high - low))[1])
    if first + second > MAX_EXPONENT:
        raise GeometryError(
            "points: the diagonal of their bounding box is beyond the largest double, "
            f"{np.finfo(np.float64).max:.2g}; scale them down"
        )
    return first, 0.5 * (low + high), max(second, -MAX_EXPONENT + 1 - first)


def _centre(points: Floats, box: tuple[Floats, Floats] | None) -> tuple[Floats, float, Floats]:
    """Move the bounding box's centre to the origin and scale its diagonal into [0.5, 1).

    The factor is a power of two, so scaling rounds nothing.
    """
    if not len(points):
        return points, 1.0, np.zeros(3)
    low, high = (points.min(axis=0), points.max(axis=0)) if box is None else box
    if (low == high).all():
        return np.zeros_like(points), 1.0, low
    first, centre, second = box_frame(low, high)
    centred = np.empty_like(points)

    def move(start: int, stop: int) -> None:
        block = np.ldexp(np.ldexp(points[start:stop], -first) - centre, -second)
        block[np.abs(block) < UNDERFLOW] = 0.0
        centred[start:stop] = block

    run_blocks(move, len(points))
    return centred, float(np.ldexp(1.0, -first - second)), np.ldexp(centre, first)


def weld_points(points: Floats) -> tuple[Indices, Indices]:
    """Return the vertex of each point and the first point of each vertex, in input order."""
    order = np.lexsort(points.T)  # stable: equal points stay in input order
    ordered = points[order]
    distinct = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))[: len(order)]
    first = order[distinct]
    rank = np.empty(len(first), dtype=np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    vertex = np.empty(len(order), dtype=np.intp)
    vertex[order] = rank[np.cumsum(distinct) - 1]
    return vertex, np.sort(first)


def _clean_faces(faces: Integers, vertex_of: Indices) -> tuple[Indices, Indices]:
    """Return faces over vertices, and their input numbers.

    Those that lost a corner, or repeat one, are left out.
    """
    corners = vertex_of[faces.astype(np.intp)]
    a, b, c = corners.T
    sound = np.flatnonzero((corners >= 0).all(axis=1) & (a != b) & (b != c) & (c != a))
    return np.ascontiguousarray(corners[sound]), sound


def _check_normals(normals: ArrayLike | None, count: int) -> Floats | None:
    """Return given normals as a (count, 3) array."""
    if normals is None:
        return None
    given = _matrix(normals, "normals")
    if len(given) != count:
        raise GeometryError(f"normals: {len(given)} rows for {count} points; give one a point")
    return given


def _clean_normals(
    given: Floats | None, kept: Indices, welded: Indices, vertices: int
) -> Floats | None:
    """Return one unit (or zero) normal a vertex: the direction of the sum over welded points."""
    if given is None:
        return None
    valid = np.asarray(np.isfinite(given).all(axis=1))
    directions = unit(np.where(valid[:, None], given, 0.0)[kept])
    total = sum_by_label(directions, welded, vertices)
    return unit(total) if total.any() else None
