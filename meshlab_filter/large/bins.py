# SPDX-License-Identifier: GPL-3.0-or-later
"""LAS files in chunks: their points are counted in cells, then spilled by tiles with halos."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from salcore.tiles.plan import CELLS, count_cells, halo_width, plan_boxes, within

from ..errors import FileError
from ..io.formats import required
from ..io.las import damage
from .job import CHUNK, Job, Source, flush, write_whole

ROW = np.dtype([("point", np.float64, 3), ("number", np.int64)])
"""A spilled point: its coordinates, and its number among the points of all files."""
Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plan:
    """Tiles of a cloud.

    Attributes
    ----------
    low, high : (3,) float64
        Corners of the cloud's box.
    boxes : (t, 2, 3) float64
        Corners of the tiles.
    halo : float
        Width of their halos.
    """

    low: Floats
    high: Floats
    boxes: Floats
    halo: float


def read_chunks(source: Source, *, bare: bool = False) -> Iterator[tuple[int, Any]]:
    """Read a file in chunks, each with the number of its first point in the file.

    Bare chunks have coordinates only, where the format lets the rest stay compressed.

    Raises
    ------
    FileError
        If the file is damaged, or has changed since the run began.
    """
    path = Path(source.path)
    laspy, at = required("laspy", path), 0
    try:
        if path.stat().st_size != source.size:
            raise FileError(f"{path}: has changed since the run began; begin anew")
        wanted = laspy.DecompressionSelection
        wanted = wanted.base().decompress_z() if bare else wanted.all()
        with laspy.open(path, decompression_selection=wanted) as reader:
            for chunk in reader.chunk_iterator(CHUNK):
                yield at, chunk
                at += len(chunk)
    except (MemoryError, FileError):
        raise
    except (FileNotFoundError, PermissionError) as error:
        raise FileError(
            f"{path}: cannot be read ({error.strerror}); all workers must see it under this path"
        ) from error
    except Exception as error:  # each backend has errors of its own
        raise damage(path, error) from error
    if at != source.points:
        raise FileError(f"{path}: is cut short or damaged ({at} of {source.points} points)")


def coordinates(chunk: Any) -> Floats:
    """Return the coordinates (n, 3) of a chunk."""
    return np.column_stack([chunk[name] for name in "xyz"]).astype(np.float64, copy=False)


def header_box(job: Job) -> tuple[Floats, Floats]:
    """Return the corners of the box of all files, as their headers have it."""
    filled = [source for source in job.sources if source.points]
    low = np.min([source.low for source in filled], axis=0)
    return low, np.max([source.high for source in filled], axis=0)


def count_file(job: Job, number: int) -> None:
    """Count the points of a file in the cells of the whole, and find its true box."""
    path = job.path(f"count-{number}.npz")
    if path.exists():
        return
    box, counts = header_box(job), np.zeros((CELLS,) * 3, dtype=np.int64)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for _, chunk in read_chunks(job.sources[number], bare=True):
        points = coordinates(chunk)
        counts += count_cells(points, *box)
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    save(path, small=True, counts=counts, low=low, high=high)


def make_plan(job: Job) -> Plan:
    """Return the tiles, once all files are counted.

    Raises
    ------
    FileError
        If headers tell other boxes than the points have.
    """
    counts = np.zeros((CELLS,) * 3, dtype=np.int64)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for number in range(len(job.sources)):  # one at a time: those of a thousand take gigabytes
        part = load(job.path(f"count-{number}.npz"))
        counts += part["counts"]
        low, high = np.minimum(low, part["low"]), np.maximum(high, part["high"])
    box = header_box(job)
    slack = 0.01 * float(np.linalg.norm(high - low))
    if np.abs(np.stack(box) - np.stack([low, high])).max() > slack + 1e-9 * np.abs(high).max():
        raise FileError(
            f"{job.sources[0].path}: the boxes in the headers of these files are not those of "
            "their points; mend them, for instance with lasinfo -repair"
        )
    boxes = plan_boxes(counts, *box, job.most)
    return Plan(low, high, boxes, halo_width(typical_spacing(counts, *box), job.ratio))


def typical_spacing(counts: NDArray[np.int64], low: Floats, high: Floats) -> float:
    """Return about the distance between neighbours where most of the points are.

    Cells are joined to blocks that are about cubes. A surface that crosses a block has about the
    area of one of its faces in it, over which the block's points are spread.
    """
    sides = (high - low) / counts.shape
    side = float(sides.max())
    for axis in range(3):
        group = counts.shape[axis] if not sides[axis] else int(np.ceil(side / sides[axis]))
        counts = np.add.reduceat(counts, np.arange(0, counts.shape[axis], group), axis=axis)
    filled = np.sort(counts[counts > 0])
    share = np.cumsum(filled)
    typical = filled[np.searchsorted(share, share[-1] / 2)]
    return side / float(np.sqrt(typical))


def spill_file(job: Job, plan: Plan, number: int) -> None:
    """Write the points of a file by tiles, each with its halo, into a folder of its own."""
    folder = job.path(f"spill-{number}")
    if folder.exists():
        return
    spare = job.path(f".spill-{number}")
    shutil.rmtree(spare, ignore_errors=True)
    spare.mkdir()
    source = job.sources[number]
    for at, chunk in read_chunks(source, bare=True):
        points = coordinates(chunk)
        rows = np.empty(len(points), dtype=ROW)
        rows["point"], rows["number"] = points, np.arange(len(points)) + (source.start + at)
        low, high = points.min(axis=0), points.max(axis=0)
        wide = plan.boxes + np.array([[-plan.halo], [plan.halo]])
        near = (wide[:, 0] <= high).all(axis=1) & (wide[:, 1] > low).all(axis=1)
        for tile in np.flatnonzero(near):
            inside = within(points, plan.boxes[tile], plan.halo)
            if inside.any():
                with (spare / f"{tile}.bin").open("ab") as file:
                    file.write(rows[inside].tobytes())
    for path in spare.iterdir():
        flush(path)
    spare.rename(folder)


def read_tile(job: Job, tile: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return the points (n, 3) of a tile with its halo, and their numbers (n,), ascending."""
    files = [job.path(f"spill-{k}", f"{tile}.bin") for k in range(len(job.sources))]
    parts = [np.fromfile(file, dtype=ROW) for file in files if file.exists()]
    rows = np.concatenate([np.empty(0, dtype=ROW), *parts])
    del parts
    return np.ascontiguousarray(rows["point"]), np.ascontiguousarray(rows["number"])


def load(path: Path, *names: str) -> dict[str, NDArray[Any]]:
    """Read arrays that `save` wrote: all, or those that are named.

    Raises
    ------
    FileError
        If the file is damaged.
    """
    try:
        with path.open("rb") as file, np.load(file) as found:
            return {name: found[name] for name in names or found.files}
    except (ValueError, KeyError, EOFError, BadZipFile) as error:
        raise FileError(
            f"{path}: is damaged; remove the folder {path.parent} and begin anew"
        ) from error


def save(path: Path, *, small: bool = False, **arrays: Any) -> None:
    """Write arrays into one file, whole; compressed if it is to be small, which takes long."""

    def write(spare: Path) -> None:
        with spare.open("wb") as file:
            (np.savez_compressed if small else np.savez)(file, **arrays)

    write_whole(path, write)
