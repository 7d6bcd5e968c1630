# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker can be asked: plain functions, arrays and plain values in and out.

The child runs them, and so does Blender's own process where there is no child, with the same
results.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import salcore
from ..geometry import cleaning, topology
from ..geometry.cleaning import Cleaned
from ..geometry.topology import MeshArrays, Reduced
from ..salcore import Analysis, Cancelled, SalcoreError, Simplification
from ..salcore.progress import Callback, Progress
from . import analyses
from .shown import interest, point_radius, regions, saliency

__all__ = ["Cancelled", "SalcoreError", "forget", "point_radius", "run"]

ANALYSIS_SHARE = 0.4
"""Of the time of a simplification, about."""

_prepared: dict[int, _Prepared] = {}
"""What the last simplifications were cut from, by number."""
_unmeasured: dict[int, list[Simplification]] = {}
"""The last simplifications themselves."""


def run(request: dict[str, Any], progress: Callback | None = None) -> Any:
    """Return the answer to a request: a task's name under "task", and its arguments.

    Parameters
    ----------
    request : dict
        Numbers, str, None, arrays, and lists and dicts of these.
    progress : callable, optional
        Called with stage and fraction; returning False cancels.

    Raises
    ------
    SalcoreError
        For a user's mistake, in a sentence.
    Cancelled
        If `progress` returned False.
    """
    arguments = dict(request)
    task = TASKS[arguments.pop("task")]
    return task(**arguments, work=Progress(progress))


def forget() -> None:
    """Forget all that is kept."""
    analyses.forget()
    _unmeasured.clear()
    _prepared.clear()


def simplify(
    *,
    points: Any,
    normals: Any,
    mesh: dict[str, Any] | None,
    parameters: dict[str, Any],
    targets: list[dict[str, float]],
    colors: Any,
    protect: Any,
    importance: Any,
    number: int,
    original_normals: bool = False,
    draft: bool = False,
    symmetry: str | None = None,
    weld: bool = False,
    remove_loose: bool = False,
    work: Progress,
    **kept: bool,
) -> dict[str, Any]:
    """Simplify a mesh or a cloud to several targets, from one analysis.

    Parameters
    ----------
    points, normals : (n, 3) float64; normals or None
    mesh : dict or None
        Of `MeshArrays`; None for a cloud.
    parameters : dict
        Of `Parameters`.
    targets : list of dict
        One argument each of `Analysis.simplify`.
    colors : (n, 3) float64 or None
        Whose differences count beside distances, a little.
    protect : (n,) bool or None
    importance : (n,) float64 or None
    number : int
        Position among the requests that belong together, which `cut` and `measure` may be asked
        for; number 0 forgets earlier ones.
    original_normals : bool
        Whether corners get normals of the original surface.
    draft : bool
        Whether cuts are neither refined nor moved, which takes most of their time.
    symmetry : str or None
        As for `Analysis.simplify`.
    weld, remove_loose : bool
        As for `cleaning.clean`.
    **kept : bool
        "keep_seams", "keep_sharp", "keep_border" and "keep_topology".

    Returns
    -------
    dict
        "levels": of `Reduced`, one for each target; "triangles": of the input.
    """
    if number == 0:
        _prepared.clear()
        _unmeasured.clear()
    shape = None if mesh is None else MeshArrays(**mesh)
    cleaned = cleaning.clean(points, shape, weld=weld, remove_loose=remove_loose)
    points, shape, normals = cleaned.points, cleaned.mesh, cleaned.take(normals)
    faces = None if shape is None or not len(shape.first) else shape.faces
    analysis = analyses.analyze(points, faces, normals, parameters, work, ANALYSIS_SHARE)
    constraints = {
        "protect": cleaned.largest(protect),
        "importance": cleaned.largest(importance),
        "point_values": cleaned.take(colors),
        "symmetry": symmetry,
        **_constraints(analysis, shape, **kept),
    }
    valid = int(np.isfinite(points).all(axis=1).sum())
    prepared = _Prepared(
        analysis, analysis.draft(), cleaned, faces, valid, constraints, original_normals
    )
    _prepared[number] = prepared
    return _cut(prepared, number, targets, ANALYSIS_SHARE, draft, work)


class _Prepared(NamedTuple):
    """What further targets are cut from.

    Attributes
    ----------
    analysis, draft : Analysis
    cleaned : Cleaned
    faces : (F, 3) int32 or None
    valid : int
        Points that are finite.
    constraints : dict
        Arguments of `Analysis.simplify`.
    original_normals : bool
    """

    analysis: Analysis
    draft: Analysis
    cleaned: Cleaned
    faces: NDArray[np.int32] | None
    valid: int
    constraints: dict[str, Any]
    original_normals: bool


def cut(
    *, number: int, targets: list[dict[str, float]], draft: bool = False, work: Progress
) -> dict[str, Any]:
    """Answer a request of `simplify` of this number again, with other targets."""
    if number not in _prepared:
        raise SalcoreError("the worker process has forgotten this object; begin again")
    return _cut(_prepared[number], number, targets, 0.0, draft, work)


def _cut(
    prepared: _Prepared,
    number: int,
    targets: list[dict[str, float]],
    begun: float,
    draft: bool,
    work: Progress,
) -> dict[str, Any]:
    """Cut to several targets; `begun` is the share of the work that is done."""
    cleaned, faces = prepared.cleaned, prepared.faces
    mesh = cleaned.mesh
    analysis = prepared.draft if draft else prepared.analysis
    levels, done = [], []
    for k, target in enumerate(targets):
        # The first target waits for the order of elimination, the others have it.
        begin = begun if k == 0 else 0.9 + 0.1 * k / len(targets)
        end = 0.9 + 0.1 * (k + 1) / len(targets)
        aim = _at_most(target, prepared.valid)
        part = work.portion(begin, end)
        result = analysis.simplify(progress=part, **prepared.constraints, **aim)
        work.part(end, end, "Attributes")
        left = None if mesh is None else topology.simplified(mesh, result)
        triangles = 0 if result.faces is None else len(result.faces)
        normals = None
        if left is not None and triangles and prepared.original_normals and not draft:
            normals = result.transfer_normals().reshape(-1, 3)[left.triangle_corners]
        notes = [*cleaned.notes, *result.notes, *_lost_faces(faces, triangles, target)]
        if aim != target:
            notes.append(f"It has {prepared.valid} points, which is fewer than asked for")
        between = {} if mesh is None else topology.blends(mesh, result, left)
        indices = result.indices
        if cleaned.used is not None:
            indices = cleaned.used[indices]
            if "POINT" in between:
                between["POINT"] = cleaned.used[between["POINT"][0]], between["POINT"][1]
        left_over = Reduced(indices, result.positions, left, triangles, normals, notes, between)
        levels.append(left_over.as_dict())
        done.append(result)
    _unmeasured[number] = done
    return {"levels": levels, "triangles": 0 if faces is None else len(faces)}


def _at_most(target: dict[str, float], valid: int) -> dict[str, float]:
    """Return a target with a count that the points reach: a selection has one for all objects."""
    return {"count": min(target["count"], valid)} if "count" in target else target


def _lost_faces(faces: Any, left: int, target: dict[str, float]) -> list[str]:
    """Return a sentence if a mesh lost all faces."""
    if faces is None or left:
        return []
    if "alpha" in target:
        return ["A threshold α gives points, and no faces; choose another target for a mesh"]
    return ["No face is left; keep more points"]


def measure(*, numbers: list[int], work: Progress) -> list[dict[str, float]]:
    """Measure the errors of the last simplifications of these numbers.

    Returns "max", "mean" and "points" of each.
    """
    waiting = [result for number in numbers for result in _unmeasured.get(number, ())]
    found = []
    for k, result in enumerate(waiting):
        errors = result.measure(work.portion(k / len(waiting), (k + 1) / len(waiting))).surface
        found.append({"max": errors.max, "mean": errors.mean, "points": len(result.source)})
    return found


def compare(
    *, original: dict[str, Any], simplified: dict[str, Any], work: Progress
) -> dict[str, Any]:
    """Return the errors between two geometries of "points", "faces" and "normals"."""
    work.part(0.0, 0.2, "Surfaces")
    first = salcore.make_surface(**original)
    work.part(0.1, 0.2, "Surfaces")
    second = salcore.make_surface(**simplified)
    errors = salcore.compare(first, second, progress=work.portion(0.2, 1.0)).as_dict()
    return errors | {"points_before": len(first.points), "points_after": len(second.points)}


def rank(
    *,
    points: Any,
    normals: Any,
    mesh: dict[str, Any] | None,
    parameters: dict[str, Any],
    colors: Any,
    protect: Any,
    importance: Any,
    work: Progress,
    **kept: bool,
) -> dict[str, Any]:
    """Return the order of removal, as `Ranking` has it, and what of a mesh depends on it.

    Returns
    -------
    dict
        "rank", "parent", "generations" and "least"; "corner": of `topology.parent_corners`, None
        where corners carry nothing; "apart": of `topology.apart`, None without faces.
    """
    shape = None if mesh is None else MeshArrays(**mesh)
    faces = None if shape is None or not len(shape.first) else shape.faces
    analysis = analyses.analyze(points, faces, normals, parameters, work, ANALYSIS_SHARE)
    constraints = {
        "protect": protect,
        "importance": importance,
        "point_values": colors,
        **_constraints(analysis, shape, **kept),
    }
    part = work.portion(ANALYSIS_SHARE, 1.0)
    ranking = analysis.ranking(progress=part, **constraints)
    corner, apart = None, None
    if shape is not None and faces is not None:
        work.part(1.0, 1.0, "Attributes")
        apart = topology.apart(shape.all_edges, ranking.rank, ranking.parent)
        if shape.corner_values:
            corner = topology.parent_corners(shape, ranking.parent).astype(np.int32)
    return {
        "rank": ranking.rank.astype(np.int32),
        "parent": ranking.parent.astype(np.int32),
        "generations": ranking.generations,
        "least": ranking.least,
        "corner": corner,
        "apart": apart,
    }


TASKS = {
    task.__name__: task
    for task in (simplify, cut, measure, compare, rank, saliency, regions, interest)
}


def _constraints(
    analysis: Analysis, mesh: MeshArrays | None, *, keep_sharp: bool, **kept: bool
) -> dict[str, Any]:
    """Return what has to stay, as arguments of `Analysis.simplify`."""
    if mesh is None or not len(mesh.first):
        return {}
    return {
        "seams": topology.kept_lines(mesh, kept["keep_seams"], keep_sharp),
        "corner_values": mesh.layers(analysis.geometry.corner_points is not None) or None,
        "corner_normals": (
            None if mesh.custom_normals is None else mesh.custom_normals[mesh.corners]
        ),
        **kept,
    }
