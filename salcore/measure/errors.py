# SPDX-License-Identifier: GPL-3.0-or-later
"""How far two geometries are apart (paper §5, equations 5.1 and 5.2), both ways."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.blocks import set_workers
from ..arrays.check import indices, real_numbers
from ..arrays.types import Floats
from ..errors import GeometryError
from ..input.geometry import box_frame, clean
from ..method.graph import build_graph
from ..parameters import Parameters
from ..progress import SILENT, Callback, Progress
from .distances import Surface, distances


@dataclass(frozen=True)
class Deviation:
    """Distances of one set of points to something, in the points' unit.

    Attributes
    ----------
    max, mean, rms : float
        Largest distance, Δmax of (5.1); mean, Δavg of (5.2); root of the mean square.
    """

    max: float
    mean: float
    rms: float

    @classmethod
    def of(cls, distances: Floats) -> Deviation:
        """Sum up (n,) distances; all zero for none."""
        if not len(distances):
            return cls(0.0, 0.0, 0.0)
        return cls(
            float(distances.max()),
            float(distances.mean()),
            float(np.sqrt(np.mean(distances**2))),
        )


@dataclass(frozen=True)
class Errors:
    """Errors between an original and a simplified geometry.

    Attributes
    ----------
    point : Deviation
        From the original points to the nearest simplified point.
    surface : Deviation
        From the original points to the simplified surface: its faces and the points no face uses;
        for a cloud, to the tangent plane at the nearest point.
    point_back, surface_back : Deviation
        The same from the simplified points to the original; zero for a subset.
    diagonal : float
        Diagonal of the original's bounding box, to make shares of.
    """

    point: Deviation
    surface: Deviation
    point_back: Deviation
    surface_back: Deviation
    diagonal: float

    def as_dict(self) -> dict[str, Any]:
        """Return nested dicts, ready for JSON."""
        return dataclasses.asdict(self)

    def scaled(self, exponent: int) -> Errors:
        """Return these errors times a power of two."""

        def of(length: float) -> float:
            with np.errstate(over="ignore"):  # beyond the largest double: infinite
                return float(np.ldexp(length, exponent))

        def all_of(one: Deviation) -> Deviation:
            return Deviation(of(one.max), of(one.mean), of(one.rms))

        return Errors(
            all_of(self.point),
            all_of(self.surface),
            all_of(self.point_back),
            all_of(self.surface_back),
            of(self.diagonal),
        )


def make_surface(
    points: ArrayLike, faces: ArrayLike | None = None, normals: ArrayLike | None = None
) -> Surface:
    """Check arrays and make a surface of them; a cloud without normals gets fitted ones.

    Parameters
    ----------
    points : (N, 3) array_like of real numbers
    faces : (F, 3) array_like of integers, optional
    normals : (N, 3) array_like of real numbers, optional

    Raises
    ------
    GeometryError
        If an array cannot be understood.
    """
    parameters = Parameters()
    geometry = clean(points, faces, normals, parameters)
    fitted = geometry.normals
    if fitted is None and not len(geometry.faces):
        fitted = build_graph(geometry, parameters).plane_normals
    original = real_numbers(points, "points", "points").reshape(-1, 3)[geometry.input_of]
    return Surface(original, geometry.faces, fitted)


def compare(
    original: Surface,
    simplified: Surface,
    *,
    workers: int = 0,
    progress: Callback | None = None,
) -> Errors:
    """Return the errors between two geometries, both ways.

    Parameters
    ----------
    original, simplified : Surface
        As `make_surface` returns.
    workers : int
        Threads; 0 takes one per processor.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.

    Raises
    ------
    GeometryError
        If a surface has no points where the other has some, or points that are not finite.
    Cancelled
        If `progress` returned False.

    Notes
    -----
    Distances are taken from the points, not from samples of the faces. O(n log n) time.

    Examples
    --------
    >>> import salcore
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> roof = salcore.make_surface([*square, [0.5, 0.5, 0.2]])
    >>> flat = salcore.make_surface(square, [[0, 1, 2], [0, 2, 3]])
    >>> errors = salcore.compare(roof, flat)
    >>> round(errors.surface.max, 6), round(errors.surface.mean, 6)
    (0.2, 0.04)
    """
    work = Progress(progress, "Errors")
    original, simplified = _checked(original, "original"), _checked(simplified, "simplified")
    for name, surface in (("original", original), ("simplified", simplified)):
        if not len(surface.points) and (len(original.points) or len(simplified.points)):
            raise GeometryError(f"{name}: it has no valid points; there is nothing to measure to")
    with set_workers(Parameters(workers=workers).workers):
        # In a frame of the size one: squares and products of four lengths stay in range.
        both = np.concatenate([original.points, simplified.points])
        if not len(both) or (both == both[0]).all():
            return measure(original, simplified, progress=work)
        first, centre, second = box_frame(both.min(axis=0), both.max(axis=0))

        def framed(surface: Surface) -> Surface:
            points = np.ldexp(np.ldexp(surface.points, -first) - centre, -second)
            return dataclasses.replace(surface, points=points)

        errors = measure(framed(original), framed(simplified), progress=work)
    return errors.scaled(first + second)


def _checked(surface: Surface, name: str) -> Surface:
    """Return a surface whose arrays are what they should be."""
    if not isinstance(surface, Surface):
        raise GeometryError(
            f"{name} of type {type(surface).__name__}: give a Surface, as make_surface returns"
        )
    points = real_numbers(surface.points, f"{name}.points", "an array of shape (n, 3)")
    normals = surface.normals
    if normals is not None:
        normals = real_numbers(normals, f"{name}.normals", "an array of shape (n, 3)")
    for array in (points, points if normals is None else normals):
        if array.shape != (len(points) if array.ndim else 0, 3):
            shape = f"points or normals of shape {array.shape}"
            raise GeometryError(f"{name}: {shape}; give arrays of shape (n, 3)")
        if not np.isfinite(array).all():
            raise GeometryError(
                f"{name}: points are NaN or infinite, or normals; make_surface(...) sees to them"
            )
    faces = indices(surface.faces, f"{name}.faces", "triangles", 3, len(points))
    return Surface(points, faces.astype(np.intp), normals)


def measure(
    original: Surface,
    simplified: Surface,
    *,
    subset: bool = False,
    progress: Progress = SILENT,
) -> Errors:
    """Do the work of `compare` on surfaces of about the size one.

    With `subset` the simplified points are some of the original ones, so that there is nothing to
    measure on the way back.
    """
    progress(0.0)
    there_part, back_part = progress.part(0.0, 1.0 if subset else 0.5), progress.part(0.5, 1.0)
    there_point, there_surface = distances(original.points, simplified, there_part)
    back_point = back_surface = np.zeros(len(simplified.points))
    if not subset:
        back_point, back_surface = distances(simplified.points, original, back_part)
    box = np.ptp(original.points, axis=0) if len(original.points) else np.zeros(3)
    return Errors(
        Deviation.of(there_point),
        Deviation.of(there_surface),
        Deviation.of(back_point),
        Deviation.of(back_surface),
        float(np.linalg.norm(box)),
    )
