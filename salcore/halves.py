# SPDX-License-Identifier: GPL-3.0-or-later
"""A symmetrical mesh is simplified by halves: one is cut, and mirrored.

The half ends at the plane, where its vertices stay on the plane (`Geometry.plane`); saliency,
normals and regions are those of the whole, so that the plane is no border to them.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays.types import Floats, Indices, Ints
from .cuts import Cuts
from .decimation.targets import count_for
from .errors import ParameterError
from .input.geometry import Geometry
from .input.layers import read_layers
from .input.twins import Twins, mirrored
from .input.wedges import build_wedges
from .method.graph import build_graph
from .progress import Progress
from .simplification import Simplification

if TYPE_CHECKING:
    from .analysis import Analysis


def half_analysis(whole: Analysis, twins: Twins, progress: Progress) -> Analysis:
    """Return the analysis of one half, with the frames, saliency and regions of the whole."""
    parameters = whole.parameters
    result = dataclasses.replace(
        whole,
        geometry=twins.half,
        graph=build_graph(twins.half, parameters, progress),
        frames=_take(whole.frames, twins.vertices),
        saliency_map=_take(whole.saliency_map, twins.vertices),
    )
    # A cached property keeps its value here.
    if parameters.regions_of_interest or parameters.keep_regions:
        regions = whole.segmentation
        labels = regions.labels[twins.vertices]
        result.__dict__["segmentation"] = dataclasses.replace(regions, labels=labels)
    if parameters.interest_weight:
        result.__dict__["extremities"] = whole.extremities[twins.vertices]
    return result


def _take(values: Any, vertices: Indices) -> Any:
    """Return a dataclass of arrays over vertices, for some of these."""
    taken = {f.name: getattr(values, f.name)[vertices] for f in dataclasses.fields(values)}
    return type(values)(**taken)


def find_half_count(
    whole: Geometry, cuts: Cuts, name: str, value: float, work: Progress
) -> tuple[int, list[str]]:
    """Return the number of points of the half for a target of the whole, and notes.

    Raises
    ------
    ParameterError
        If there are not so many points or faces, or more are protected.
    """
    if name == "max_error":
        return cuts.find_count(name, value, work)
    if name == "faces":
        if not 2 <= value <= whole.face_count:
            raise ParameterError(
                f"faces={value:g}: with symmetry, give from 2 to the {whole.face_count} valid faces"
            )
        count, notes = cuts.find_count(name, value // 2, work)
        odd = [f"faces={value:g}: faces come in twins, so {value - 1:g} were sought"]
        return count, [*_of_half(notes), *(odd if value % 2 else [])]
    plane = cuts.geometry.plane
    assert plane is not None  # it is a half
    twice = 2 - plane.on_plane.astype(np.intp)
    protected = int(twice[cuts.constraints.protect].sum()) + 2 * cuts.constraints.protected_copies
    if name == "count" and value <= np.count_nonzero(whole.vertex_of >= 0):
        value = min(value, whole.available)
    wanted = count_for(name, value, whole.available, protected)
    rank = cuts.elimination.rank
    points = np.cumsum(np.bincount(rank, twice, len(rank))).astype(np.intp)
    count = max(int(np.searchsorted(points, wanted, side="right")), 1)
    copies = wanted - int(points[-1])
    asked = count + cuts.constraints.protected_copies + (max(copies, 0) // 2)
    count, notes = cuts.find_count("count", min(asked, cuts.geometry.available), work)
    notes = _of_half(notes)
    kept = int(points[min(count, len(points)) - 1])
    if name == "count" and kept != wanted and not notes and copies <= 0:
        notes.append(f"count={value:g}: points go in twins, so {kept} are kept")
    return count, notes


def _of_half(notes: list[str]) -> list[str]:
    return [f"Each half: {note}" for note in notes]


def find_whole_seams(whole: Geometry, given: dict[str, Any]) -> Ints | None:
    """Return the seams (s, 2) of the whole, those on the plane too, for constraints as given."""
    layers = read_layers(whole, given["corner_values"], given["corner_normals"], None)
    wedges = build_wedges(whole, layers)
    return None if wedges is None else wedges.seams


def join_halves(
    whole: Geometry,
    normals: Floats,
    twins: Twins,
    half: Simplification,
    seams: Ints | None,
) -> Simplification:
    """Return a simplification of the whole from one of the half.

    Parameters
    ----------
    whole : Geometry
    normals : (n, 3) float64
        Of the whole's vertices.
    twins : Twins
    half : Simplification
        In the whole's input points and corners.
    seams : (s, 2) int32 or None
        Of the whole.
    """
    context, size = half._context, whole.input_count
    assert half.faces is not None  # it is of a mesh
    assert half.face_corners is not None
    assert half.face_source is not None
    assert half.corner_origin is not None
    corners, origin = (
        np.ascontiguousarray(twins.corner[values][:, ::-1])
        for values in (half.face_corners, half.corner_origin)
    )
    # Twins of corners tell which of several equal points; points that no face uses have their own.
    opposite = twins.corner_point[corners]
    twin = twins.point[half.indices]
    twin[half.faces[:, ::-1]] = opposite
    stays = np.zeros(size, dtype=bool)
    for kept in (half.indices, twin, opposite):
        stays[kept] = True
    indices = np.flatnonzero(stays)
    place = np.cumsum(stays) - 1
    source = np.full(size, -1, dtype=np.int64)
    ours = half.source >= 0
    theirs = (twins.point >= 0) & ~ours
    source[theirs] = place[twin][half.source[twins.point[theirs]]]
    source[ours] = place[half.indices][half.source[ours]]
    source[indices] = np.arange(len(indices))
    positions = None
    if half.positions is not None:
        positions = whole.coordinates[indices].astype(np.float64)
        other = mirrored(half.positions, twins.axis)
        positions[place[opposite]] = other[half.faces[:, ::-1]]
        positions[place[twin]] = other
        positions[place[half.indices]] = half.positions
    result = dataclasses.replace(
        half,
        indices=indices,
        faces=np.concatenate([place[half.indices][half.faces], place[opposite]]),
        face_source=np.concatenate([half.face_source, origin[:, 0] // 3]),
        corner_origin=np.concatenate([half.corner_origin, origin]),
        source=source,
        positions=positions,
        notes=half.notes,
        _context=dataclasses.replace(
            context, geometry=whole, normals=normals, corner_origin=None, corners=None, seams=seams
        ),
    )
    result.__dict__["face_corners"] = np.concatenate([half.face_corners, corners])
    return result.with_backs()
