# SPDX-License-Identifier: GPL-3.0-or-later
"""What is worked out for one tile of a mesh: each stage reads files of the work folder, writes one.

A stage whose file is there already returns at once: that is how a run is resumed.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import salcore
from salcore.tiles.merge import Statistics, Whole, kept_points
from salcore.tiles.mesh import (
    MeshTile,
    analyse_mesh_tile,
    count_for_piece,
    falling_faces,
    order_piece,
    sources_of,
    start_piece,
)
from salcore.tiles.pieces import (
    Piece,
    cut_piece,
    held_vertices,
    join_parts,
    part_in_box,
    renumbered,
    turned,
)
from salcore.tiles.plan import CELLS, count_cells, within

from .bins import Plan
from .job import write_whole
from .mesh_job import MeshJob, Pass
from .ply_blocks import BLOCK, blocks, coordinates, read_corners, read_points, rows

ROW = np.dtype([("corners", np.int64, 3), ("number", np.int64)])
"""A spilled face: its corners, and its number in the file."""


def save(path: Path, **arrays: Any) -> None:
    """Write arrays into one file, whole."""

    def write(spare: Path) -> None:
        with spare.open("wb") as file:
            np.savez(file, **arrays)

    write_whole(path, write)


def load(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file."""
    with np.load(path) as found:
        return {name: found[name] for name in found.files}


def measure(job: MeshJob) -> None:
    """Find the box of the finite points, and count these in its cells."""
    path = job.path("box.npz")
    if path.exists():
        return
    layout, low, high = job.layout, np.full(3, np.inf), np.full(3, -np.inf)
    for bounds in blocks(layout.vertices):
        points = coordinates(rows(layout, layout.vertices, *bounds))
        points = points[np.isfinite(points).all(axis=1)]
        low = np.minimum(low, points.min(axis=0, initial=np.inf))
        high = np.maximum(high, points.max(axis=0, initial=-np.inf))
    counts = np.zeros((CELLS,) * 3, dtype=np.int64)
    if (low <= high).all():
        for bounds in blocks(layout.vertices):
            points = coordinates(rows(layout, layout.vertices, *bounds))
            counts += count_cells(points, low, high)
    save(path, counts=counts, low=low, high=high)


def spill(job: MeshJob, plan: Plan, number: int) -> None:
    """Write a range of faces by tiles, those near a tile to it as well, into a folder."""
    folder = job.path(f"spill-{number}")
    if folder.exists():
        return
    spare = job.path(f".spill-{number}")
    shutil.rmtree(spare, ignore_errors=True)
    spare.mkdir()
    begin, end = job.face_ranges()[number]
    wide = plan.boxes + np.array([[-plan.halo], [plan.halo]])
    for start in range(begin, end, BLOCK):
        stop = min(start + BLOCK, end)
        found = np.empty(stop - start, dtype=ROW)
        found["corners"] = read_corners(job.layout, start, stop)
        found["number"] = np.arange(start, stop)
        points = coordinates(rows(job.layout, job.layout.vertices), found["corners"])
        low, high = points.min(axis=1), points.max(axis=1)  # not finite where a corner is not
        del points
        least = np.fmin.reduce(low, axis=0, initial=np.inf)
        most = np.fmax.reduce(high, axis=0, initial=-np.inf)
        near = (wide[:, 0] <= most).all(axis=1) & (wide[:, 1] > least).all(axis=1)
        for tile in np.flatnonzero(near):
            inside = (high >= wide[tile, 0]).all(axis=1) & (low < wide[tile, 1]).all(axis=1)
            if inside.any():
                with (spare / f"{tile}.bin").open("ab") as file:
                    file.write(found[inside].tobytes())
    spare.rename(folder)


def analyse(job: MeshJob, plan: Plan, tile: int) -> None:
    """Analyse a tile, and write it with its statistics."""
    path = job.path(f"statistics-{tile}.npz")
    if path.exists():
        return
    files = [job.path(f"spill-{k}", f"{tile}.bin") for k in range(len(job.face_ranges()))]
    parts = [np.fromfile(file, dtype=ROW) for file in files if file.exists()]
    found = np.concatenate([np.empty(0, dtype=ROW), *parts])
    del parts
    numbers, faces = np.unique(found["corners"], return_inverse=True)
    faces = faces.reshape(-1, 3).astype(np.int32)
    points = read_points(job.layout, numbers)
    core = within(points, plan.boxes[tile])
    result = analyse_mesh_tile(
        points, faces, numbers, found["number"], core, (plan.low, plan.high), parameters_of(job)
    )
    save(job.path(f"tile-{tile}.npz"), **{name: getattr(result, name) for name in FIELDS})
    values = result.statistics()
    with_areas = {"saliency": values.saliency, "faces": values.faces, "areas": values.areas}
    save_packed(path, points=values.points, **with_areas)


FIELDS = tuple(MeshTile.__dataclass_fields__)


def save_packed(path: Path, **arrays: Any) -> None:
    """Write arrays that are mostly zero into one file, whole."""

    def write(spare: Path) -> None:
        with spare.open("wb") as file:
            np.savez_compressed(file, **arrays)

    write_whole(path, write)


def statistics_of(job: MeshJob, tile: int) -> Statistics:
    """Return the statistics of a tile."""
    found = load(job.path(f"statistics-{tile}.npz"))
    return Statistics(int(found["points"]), found["saliency"], found["faces"], found["areas"])


def tile_of(job: MeshJob, tile: int) -> MeshTile:
    """Return a tile of the first pass."""
    found: dict[str, Any] = load(job.path(f"tile-{tile}.npz"))
    return MeshTile(**(found | {"backs": int(found["backs"])}))


def piece_of(job: MeshJob, whole: Whole, now: Pass, tile: int) -> Piece:
    """Return a tile as a pass begins with it."""
    if now.turn == 0:
        return start_piece(tile_of(job, tile), whole, parameters_of(job))
    return joined(job, now, tile)


def joined(job: MeshJob, now: Pass, tile: int) -> Piece:
    """Return a tile of what the last pass has left."""
    parts = []
    for number in now.sources[tile]:
        part = Piece.from_arrays(load(job.path(f"left-{now.turn - 1}-{number}.npz")))
        if now.turn == 1:
            part = renumbered(part, np.load(job.path("copies.npy")))
        parts.append(part_in_box(part, now.turn, now.boxes[tile]))
    return join_parts(parts, now.turn, now.boxes[tile])


def order(job: MeshJob, whole: Whole, now: Pass, tile: int) -> None:
    """Put the vertices of a tile in the order in which they go."""
    path = job.path(f"order-{now.turn}-{tile}.npz")
    if path.exists():
        return
    piece = piece_of(job, whole, now, tile)
    found = order_piece(
        piece,
        held_vertices(piece, job.keep_border),
        parameters_of(job),
        whole.scale.mean_area,
        alone=now.alone,
        keep_topology=job.keep_topology,
    )
    arrays = {"number": piece.number, "owned": piece.owned, "parent": found.parent}
    if not now.alone:
        falling, faces = falling_faces(piece), piece.own_faces().sum()
        save(path, step=found.step, cost=found.cost, falling=falling, faces=faces, **arrays)
        return
    if job.target == "faces":
        arrays["count"] = np.array(count_for_piece(piece, found, int(job.value)))
    save(path, rank=found.rank, least=found.topology_count, **arrays)


def cut(job: MeshJob, whole: Whole, now: Pass, where: Any, tile: int) -> None:
    """Write what a cut leaves of a tile, and its box in the frame of the next pass.

    `where` is a `Cut`, a step up to which all go, or, for a tile that is alone, a number of ranks.
    """
    path = job.path(f"left-{now.turn}-{tile}.npz")
    if path.exists():
        return
    piece = piece_of(job, whole, now, tile)
    found = load(job.path(f"order-{now.turn}-{tile}.npz"))
    if now.alone:
        kept = found["rank"] < where
    elif isinstance(where, int):
        kept = found["step"] > where
    else:
        kept = kept_points(where, found["step"], found["cost"], found["number"])
    source = sources_of(found["parent"], kept)
    mine = piece.owned
    sources = np.stack([piece.number[mine], piece.number[source[mine]]])
    save(job.path(f"source-{now.turn}-{tile}.npz"), sources=sources)
    left = cut_piece(piece, source)
    points = turned(left.points, now.turn + 1)
    low, high = points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)
    save(path, low=low, high=high, count=left.owned.sum(), **left.arrays())


def parameters_of(job: MeshJob) -> salcore.Parameters:
    """Return salcore's parameters, for one thread."""
    return salcore.Parameters(**(job.parameters | {"workers": 1}))
