# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes over a mesh in order."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np

import salcore
from salcore.decimation.targets import count_for
from salcore.decimation.thresholds import LOWEST
from salcore.progress import Progress
from salcore.tiles.merge import Cut, Whole, count_steps, find_cut, find_step, merge_statistics
from salcore.tiles.pieces import Piece, turned
from salcore.tiles.plan import CELLS, count_cells, plan_boxes

from ..errors import FileError, Warn, ignore
from ..io.obj_write import PAIRS
from ..io.wedges import NUMBERS
from . import mesh_stages as stages
from .bins import Plan, typical_spacing
from .mesh_job import ROOM, SHARES, MeshJob, Pass
from .mesh_refine import plan_refinement, refine, spill_samples
from .mesh_write import write_mesh
from .ply_blocks import WHOLE
from .workers import Each, at_work

POINT = 1000
"""Bytes that a worker takes at most for a point of a tile or its halo, and the two faces that go
with it."""
HALO = 12.0
"""Width of a halo in spacings: saliency looks as far as seven rings."""


def simplify_mesh(
    job: MeshJob,
    output: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    resume: bool = False,
    force: bool = False,
    progress: salcore.progress.Callback | None = None,
    warn: Warn = ignore,
) -> dict[str, Any]:
    """Simplify a PLY file tile by tile into another, and return the figures.

    Parameters
    ----------
    job : MeshJob
    output : Path
        PLY file.
    workers, scheduler, resume, force, progress, warn
        As in `meshlab_filter.large.run.simplify_tiles`.

    Raises
    ------
    FileError
        If a file cannot be read or written, or the work folder belongs to another run.
    ParameterError
        If there are fewer points than are to be kept, or more that have to stay.
    MemoryLimitError
        If a worker was killed.
    OSError
        If a disk is full.

    Notes
    -----
    The result does not depend on the number of workers, nor on who they are. The work folder is
    removed at the end, and stays where the run ends early.
    """
    work = Progress(progress)
    with at_work(job, workers, scheduler, resume=resume) as (job, each):
        return _stages(job, output, each, force, work, warn)


def _stages(
    job: MeshJob, output: Path, each: Each, force: bool, work: Progress, warn: Warn
) -> dict[str, Any]:
    """Do the stages in their order, and return the figures."""
    each(stages.measure, [(job,)], work.part(0.0, 0.02, "Counting"))
    plan = _plan(job)
    tiles = range(len(plan.boxes))
    warn(
        f"{job.points:,} points and {job.layout.faces.length:,} faces in {len(tiles)} tiles; if "
        f"interrupted, go on with --resume {job.folder}"
    )
    ranges = range(len(job.face_ranges()))
    if not all(job.path(f"statistics-{tile}.npz").exists() for tile in tiles):
        each(stages.spill, [(job, plan, k) for k in ranges], work.part(0.02, 0.08, "Tiles"))
        part = work.part(0.08, 0.45, "Analysis")
        each(stages.analyse, [(job, plan, k) for k in tiles], part)
    for k in ranges:
        shutil.rmtree(job.path(f"spill-{k}"), ignore_errors=True)
    whole, places, whole_faces = _gather(job, len(tiles), warn)
    wanted = _wanted(job, places, whole_faces)
    passes = _passes(job, whole, Pass(0, plan.boxes, []), places, wanted, each, work, warn)
    last = passes[-1]
    if job.parameters["refine"]:
        last = _refine(job, whole, passes, each, work)
    part = work.part(0.98, 1.0, "Output")
    points, faces = write_mesh(job, last, output, force, part)
    if job.target == "faces" and faces != job.value:
        warn(f"faces={job.value:g}: {faces} faces are kept")
    return {
        "input_points": job.points,
        "input_faces": job.layout.faces.length,
        "kept_points": points,
        "kept_faces": faces,
        "tiles": len(tiles),
        "passes": len(passes),
        "halo": plan.halo,
    }


def _plan(job: MeshJob) -> Plan:
    """Return the tiles of the first pass."""
    found = stages.load(job.path("box.npz"))
    low, high, counts = found["low"], found["high"], found["counts"]
    if not counts.any():
        raise FileError(f"{job.sources[0].path}: has no points that are finite")
    boxes = plan_boxes(counts, low, high, job.most)
    return Plan(low, high, boxes, HALO * typical_spacing(counts, low, high))


def _gather(job: MeshJob, tiles: int, warn: Warn) -> tuple[Whole, int, int]:
    """Return what the tiles must know of the whole, and the numbers of places and of faces."""
    total, copies, backs = stages.statistics_of(job, 0), [], 0
    for tile in range(tiles):  # one at a time: those of a thousand take gigabytes
        if tile:
            total += stages.statistics_of(job, tile)
        with np.load(job.path(f"tile-{tile}.npz")) as found:
            copies.append(found["copies"])
            backs += int(found["backs"])
    both = np.concatenate(copies, axis=1)
    both = both[:, np.argsort(both[0])]
    with job.path("copies.npy").open("wb") as file:
        np.save(file, both)
    path, left = job.sources[0].path, job.points - total.points - both.shape[1]
    if left:
        warn(f"{path}: {left:,} points that no face uses are left out")
    if both.shape[1]:
        columns = set(job.layout.vertices.dtype.names or ())
        if any(set(pair) <= columns for pair in PAIRS):
            raise FileError(
                f"{path}: {both.shape[1]:,} points equal others, for its texture has seams, which "
                f"tiles do not carry; {WHOLE}"
            )
        warn(
            f"{path}: {both.shape[1]:,} points equal others; of each place the values of one point "
            "are kept"
        )
    materials = [name for name in NUMBERS if name in (job.layout.faces.dtype.names or ())]
    if materials:
        warn(f"{path}: the borders of {', '.join(materials)} do not stay as lines")
    if backs:
        warn(f"{path}: {backs:,} faces are the backs of others and are left out")
    if not total.points:
        raise FileError(f"{path}: has no faces with three different, finite corners")
    return merge_statistics([total]), total.points, int(total.faces.sum())


def _wanted(job: MeshJob, places: int, faces: int) -> int:
    """Return the number of points to keep; about that for a target in faces."""
    if job.target != "faces":
        return count_for(job.target, job.value, places, 0)
    if job.value > faces:
        raise salcore.ParameterError(
            f"faces={job.value:g}: there are {faces} valid faces; give at most so many"
        )
    return max(round(places * job.value / faces), 1)


def _passes(
    job: MeshJob,
    whole: Whole,
    now: Pass,
    places: int,
    wanted: int,
    each: Each,
    work: Progress,
    warn: Warn,
) -> list[Pass]:
    """Do the passes, and return them."""
    passes, begin = [now], 0.45
    while True:
        tiles = range(len(now.boxes))
        end = begin + 0.6 * (0.85 - begin)
        name = f"Pass {now.turn + 1}"
        each(stages.order, [(job, whole, now, k) for k in tiles], work.part(begin, end, name))
        final = now.alone or now.turn == len(SHARES) - 1
        if final:
            where = _finish(job, now, wanted, warn)
        elif now.turn == 0:
            where = _step_for_share(job, now, (wanted / places) ** SHARES[0])
        else:
            factor = ROOM if ROOM * wanted <= job.most else SHARES[now.turn]
            where = _step_for_count(job, now, math.ceil(factor * wanted))
        calls = [(job, whole, now, where, k) for k in tiles]
        each(stages.cut, calls, work.part(end, end + 0.01, name))
        if final:
            return passes
        now, begin = _next_pass(job, now), end + 0.01
        passes.append(now)


def _refine(job: MeshJob, whole: Whole, passes: list[Pass], each: Each, work: Progress) -> Pass:
    """Refine what the last pass has left."""
    plan = plan_refinement(job, passes)
    tiles, calls = range(len(passes[0].boxes)), range(len(plan.now.boxes))
    part = work.part(0.87, 0.9, "Refinement")
    each(spill_samples, [(job, whole, plan, k) for k in tiles], part)
    each(refine, [(job, plan, k) for k in calls], work.part(0.9, 0.98, "Refinement"))
    return plan.now


def _step_for_share(job: MeshJob, now: Pass, share: float) -> int:
    """Return the step up to which vertices go if such a share is to stay of those that may go."""
    counts = _count_steps(job, now)
    counts[-1] = 0  # those that stay
    total = int(counts.sum())
    return find_step(counts, max(round(share * total), 1))[0] - 1 if total else 0


def _step_for_count(job: MeshJob, now: Pass, count: int) -> int:
    """Return the step up to which vertices go if at least so many are to stay."""
    counts = _count_steps(job, now)
    return find_step(counts, min(count, int(counts.sum())))[0] - 1


def _count_steps(job: MeshJob, now: Pass) -> Any:
    """Return how many vertices of all tiles go at each step."""
    counts = count_steps(np.empty(0, dtype=np.int32))
    for tile in range(len(now.boxes)):
        found = stages.load(job.path(f"order-{now.turn}-{tile}.npz"))
        counts += count_steps(found["step"][found["owned"]])
    return counts


def _finish(job: MeshJob, now: Pass, wanted: int, warn: Warn) -> Cut | int:
    """Return where the last pass is cut."""
    asked = f"{job.target}={job.value:g}"
    if now.alone:
        found = stages.load(job.path(f"order-{now.turn}-0.npz"))
        if job.target == "faces":
            wanted = int(found["count"])
        least = int(found["least"]) if job.keep_topology else 1
        if wanted < least:
            warn(f"{asked}: that is {wanted} points, but keep_topology keeps {least}")
        count = max(wanted, least)
        kept = int(np.count_nonzero(found["rank"] < count))
        if kept < count:
            warn(f"{asked}: {kept} points are kept; parts go whole")
        return count
    counts = _count_steps(job, now)
    if job.target == "faces":
        wanted = _count_for_faces(job, now, counts)
    if wanted <= counts[-1]:
        raise salcore.ParameterError(
            f"{asked}: that is {wanted} points, but by tiles {counts[-1]} have to stay, for parts, "
            "holes and handles do not go; give more, or more --memory"
        )
    step, keep = find_step(counts, wanted)
    rows = _rows_at(job, now, step)
    return find_cut(step, keep, [row[0] for row in rows], [row[1] for row in rows])


def _rows_at(job: MeshJob, now: Pass, step: int) -> list[tuple[Any, Any, Any]]:
    """Return costs and numbers of the vertices that go at a step, and how many faces with each."""
    rows = []
    for tile in range(len(now.boxes)):
        found = stages.load(job.path(f"order-{now.turn}-{tile}.npz"))
        chosen = found["owned"] & (found["step"] == step)
        rows.append((found["cost"][chosen], found["number"][chosen], found["falling"][chosen]))
    return rows


def _count_for_faces(job: MeshJob, now: Pass, counts: Any) -> int:
    """Return the most points that leave no more faces than are wanted.

    Each vertex takes one face with it on a border and two elsewhere, for the topology stays.
    """
    falling, faces = np.zeros(len(counts), dtype=np.int64), 0
    for tile in range(len(now.boxes)):
        found = stages.load(job.path(f"order-{now.turn}-{tile}.npz"))
        owned = found["owned"]
        falling += np.bincount(
            found["step"][owned] - LOWEST, found["falling"][owned], len(counts)
        ).astype(np.int64)
        faces += int(found["faces"])
    surplus, gone = faces - int(job.value), np.cumsum(falling)
    if surplus <= 0:
        return int(counts.sum())
    place = min(int(np.searchsorted(gone, surplus)), len(counts) - 1)
    cost, number, each = (
        np.concatenate(c) for c in zip(*_rows_at(job, now, place + LOWEST), strict=True)
    )
    order = np.lexsort((-number, cost))  # in which they go
    within = surplus - int(gone[place] - falling[place])
    last = min(int(np.searchsorted(np.cumsum(each[order]), within)) + 1, len(order))
    return int(counts[place:].sum()) - last


def _next_pass(job: MeshJob, last: Pass) -> Pass:
    """Return the pass over what the last one has left."""
    turn, tiles = last.turn + 1, range(len(last.boxes))
    ends = [_ends(job, last, tile) for tile in tiles]
    low = np.min([end[0] for end in ends], axis=0)
    high = np.max([end[1] for end in ends], axis=0)
    if sum(end[2] for end in ends) <= job.most:
        return Pass(turn, np.array([[[-np.inf] * 3, [np.inf] * 3]]), [list(tiles)])
    counts = np.zeros((CELLS,) * 3, dtype=np.int64)
    for tile in tiles:
        piece = Piece.from_arrays(stages.load(job.path(f"left-{last.turn}-{tile}.npz")))
        counts += count_cells(turned(piece.points[piece.owned], turn), low, high)
    boxes = plan_boxes(counts, low, high, job.most)
    return Pass(turn, boxes, last.reached_by(job, boxes))


def _ends(job: MeshJob, last: Pass, tile: int) -> tuple[Any, Any, int]:
    """Return the box of what is left of a tile, and how many vertices it owns."""
    with np.load(job.path(f"left-{last.turn}-{tile}.npz")) as found:
        return found["low"], found["high"], int(found["count"])
