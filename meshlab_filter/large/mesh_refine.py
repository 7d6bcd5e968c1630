# SPDX-License-Identifier: GPL-3.0-or-later
"""The light mesh is refined by tiles of its own, which samples of the original are spilled to."""

from __future__ import annotations

import shutil
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from salcore.tiles.merge import Whole
from salcore.tiles.mesh_refine import TileSamples, refine_piece, sample_tile
from salcore.tiles.pieces import turned
from salcore.tiles.plan import CELLS, count_cells, plan_boxes, within

from .mesh_job import MeshJob, Pass
from .mesh_stages import joined, load, parameters_of, save, tile_of


@dataclass(frozen=True, eq=False)
class Refinement:
    """Tiles in which a light mesh is refined.

    Attributes
    ----------
    now : Pass
        Its tiles, and those of the last pass that each takes from.
    reach : list of list of list of int
        For each tile of the first pass, and each further pass, the tiles in which what stands for
        its vertices may be.
    """

    now: Pass
    reach: list[list[list[int]]]


def plan_refinement(job: MeshJob, passes: list[Pass]) -> Refinement:
    """Return tiles with about as many points of the original as those of the first pass."""
    turn, first, last = len(passes), range(len(passes[0].boxes)), passes[-1]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for tile in first:
        points = turned(_own_points(job, tile), turn)
        low = np.minimum(low, points.min(axis=0, initial=np.inf))
        high = np.maximum(high, points.max(axis=0, initial=-np.inf))
    counts = np.zeros((CELLS,) * 3, dtype=np.int64)
    for tile in first:
        counts += count_cells(turned(_own_points(job, tile), turn), low, high)
    boxes = plan_boxes(counts, low, high, job.most)
    reach: list[list[list[int]]] = []
    for tile in first:
        here, chain = {tile}, []
        for now in passes[1:]:
            here = {k for k, sources in enumerate(now.sources) if here & set(sources)}
            chain.append(sorted(here))
        reach.append(chain)
    sources = last.reached_by(job, boxes)
    return Refinement(Pass(turn, boxes, sources), reach)


def _own_points(job: MeshJob, tile: int) -> NDArray[np.float64]:
    """Return the points (n, 3) of a tile's core."""
    with np.load(job.path(f"tile-{tile}.npz")) as found:
        points: NDArray[np.float64] = found["points"][found["owned"]]
    return points


def spill_samples(job: MeshJob, whole: Whole, plan: Refinement, tile: int) -> None:
    """Write the samples of a tile of the original by tiles of the refinement, into a folder."""
    folder = job.path(f"samples-{tile}")
    if folder.exists():
        return
    spare = job.path(f".samples-{tile}")
    shutil.rmtree(spare, ignore_errors=True)
    spare.mkdir()
    original, parameters = tile_of(job, tile), parameters_of(job)
    if not original.owned.any():  # its points have no faces
        spare.rename(folder)
        return
    root = load(job.path(f"source-0-{tile}.npz"))["sources"][1]
    for turn, tiles in enumerate(plan.reach[tile], 1):
        parts = [load(job.path(f"source-{turn}-{k}.npz"))["sources"] for k in tiles]
        root = _looked_up(root, np.concatenate(parts, axis=1))
    places = plan.reach[tile][-1] if plan.reach[tile] else [tile]
    parts, points = [], []
    for k in places:
        found = load(job.path(f"left-{plan.now.turn - 1}-{k}.npz"))
        parts.append(found["number"][found["owned"]])
        points.append(found["points"][found["owned"]])
    kept = np.concatenate(parts)
    rows = _looked_up(root, np.stack([kept, np.arange(len(kept))]))
    at = turned(np.concatenate(points)[rows], plan.now.turn)
    roots = original.number.copy()
    roots[original.owned] = root
    place = np.full(len(roots), -1)
    for k, box in enumerate(plan.now.boxes):
        place[np.flatnonzero(original.owned)[within(at, box)]] = k
    factor = 1.0 + parameters.detail * whole.scaled(original.saliency)
    samples, near = sample_tile(original, factor, roots)
    goes = place[near]
    for k in np.unique(goes):
        save(spare / f"{k}.npz", **samples.take(goes == k).arrays())
    spare.rename(folder)


def _looked_up(numbers: NDArray[np.int64], table: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each number the second row of a table (2, t) where the first has it."""
    order = np.argsort(table[0])
    found: NDArray[np.int64] = table[1, order[np.searchsorted(table[0], numbers, sorter=order)]]
    return found


def refine(job: MeshJob, plan: Refinement, tile: int) -> None:
    """Refine a tile of the light mesh, and write it with the faces that are its own."""
    path = job.path(f"left-{plan.now.turn}-{tile}.npz")
    if path.exists():
        return
    piece = joined(job, plan.now, tile)
    files = [job.path(f"samples-{k}", f"{tile}.npz") for k in range(len(plan.reach))]
    samples = TileSamples.join([load(file) for file in files if file.exists()])
    refined = refine_piece(piece, samples, parameters_of(job))
    left = refined.take(np.arange(len(piece.number)), piece.own_faces())
    save(path, count=left.owned.sum(), **left.arrays())
