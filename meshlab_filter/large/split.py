# SPDX-License-Identifier: GPL-3.0-or-later
"""The kept points once more, as a folder of one LAZ file a tile with a common index."""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from salcore.progress import Progress

from ..errors import FileError
from ..io.formats import required
from ..io.staging import PREFIX, link
from .bins import read_chunks
from .job import Job, flush, write_whole
from .write import moved_records

INDEX = "index.json"
HEADER, PUBLISHED = "header.las", "tiles.txt"
"""In the work folder: what all tiles have in common, and where they lie once they are done."""


def check_folder(folder: Path) -> None:
    """Refuse a folder for tiles that is not to be written.

    Raises
    ------
    FileError
        If it holds something, or cannot be made.
    """
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise FileError(f"{folder}: exists already; remove it, or name another by --tiles")
    if not folder.parent.is_dir():
        raise FileError(f"{folder.parent}: no such folder; make it first")


def is_published(job: Job, folder: Path) -> bool:
    """Return whether this run has written its tiles into a folder already."""
    done = job.path(PUBLISHED)
    return done.is_file() and done.read_text(encoding="utf-8") == str(folder.absolute())


def split_file(job: Job, tiles: int, number: int) -> None:
    """Write the records of a file's kept points by tiles, into a folder of its own."""
    folder, source = job.path(f"split-{number}"), job.sources[number]
    if folder.exists():
        return
    spare = job.path(f".split-{number}")
    shutil.rmtree(spare, ignore_errors=True)
    spare.mkdir()
    header, tile_of = _header(job), np.full(source.points, -1, dtype=np.int32)
    for tile in range(tiles):
        numbers = np.load(job.path(f"kept-{tile}.npy"), mmap_mode="r")
        first, last = np.searchsorted(numbers, [source.start, source.start + source.points])
        tile_of[numbers[first:last] - source.start] = tile
    for at, chunk in read_chunks(source):
        here = tile_of[at : at + len(chunk)]
        for tile in np.unique(here[here >= 0]):
            records = moved_records(chunk[here == tile], header, source)
            with (spare / f"{tile}.bin").open("ab") as file:
                file.write(records.array.tobytes())
    for path in spare.iterdir():
        flush(path)
    spare.rename(folder)


def write_tile(job: Job, tile: int) -> None:
    """Write the kept points of a tile, in the order of the input, as a LAZ file; none if empty."""
    path = job.path("tiles", f"tile-{tile:05}.laz")
    files = [job.path(f"split-{k}", f"{tile}.bin") for k in range(len(job.sources))]
    files = [file for file in files if file.exists()]
    if path.exists() or not files:
        return
    laspy, header = required("laspy", path), _header(job)
    parts = [np.fromfile(file, dtype=header.point_format.dtype()) for file in files]
    records = laspy.ScaleAwarePointRecord(
        np.concatenate(parts), header.point_format, header.scales, header.offsets
    )

    def write(spare: Path) -> None:
        with laspy.open(spare, mode="w", header=header, do_compress=True) as writer:
            writer.write_points(records)

    write_whole(path, write)


def write_tiles(
    job: Job,
    tiles: int,
    header: Any,
    folder: Path,
    each: Callable[..., None],
    progress: Progress,
) -> None:
    """Write all tiles and their index; the folder is whole or not there.

    Raises
    ------
    FileError
        If the folder is there by now.
    OSError
        If the disk is full.
    """
    laspy = required("laspy", folder)
    write_whole(job.path(HEADER), lambda spare: _write_header(laspy, header, spare))
    files = [(job, tiles, k) for k in range(len(job.sources))]
    each(split_file, files, progress.part(0.0, 0.6))
    job.path("tiles").mkdir(exist_ok=True)
    each(write_tile, [(job, k) for k in range(tiles)], progress.part(0.6, 1.0))
    index = json.dumps(_index(laspy, job.path("tiles")), indent=1)
    write_whole(job.path("tiles", INDEX), lambda spare: spare.write_text(index, encoding="utf-8"))
    check_folder(folder)
    # Beside its place first: the work folder may be on another disk.
    staged = folder.with_name(f"{PREFIX}{uuid.uuid4().hex[:8]}")
    try:
        staged.mkdir()
        for file in sorted(job.path("tiles").iterdir()):
            link(file, staged / file.name)
        if folder.is_dir():
            folder.rmdir()
        os.replace(staged, folder)
    finally:
        shutil.rmtree(staged, ignore_errors=True)
    job.path(PUBLISHED).write_text(str(folder.absolute()), encoding="utf-8")


def _index(laspy: Any, folder: Path) -> dict[str, Any]:
    """Return what the index says: files, the bounds of their points, and how many these are."""
    rows = []
    for path in sorted(folder.glob("tile-*.laz")):
        with laspy.open(path) as reader:
            header = reader.header
        bounds = [header.mins.tolist(), header.maxs.tolist()]
        rows.append({"file": path.name, "points": int(header.point_count), "bounds": bounds})
    corners: NDArray[np.float64] = np.array([row["bounds"] for row in rows])
    return {
        "points": sum(row["points"] for row in rows),
        "bounds": [corners[:, 0].min(axis=0).tolist(), corners[:, 1].max(axis=0).tolist()],
        "tiles": rows,
    }


def _write_header(laspy: Any, header: Any, path: Path) -> None:
    with laspy.open(path, mode="w", header=header, do_compress=False):
        pass


def _header(job: Job) -> Any:
    """Return the header of the output, which `write_tiles` wrote for all workers."""
    path = job.path(HEADER)
    with required("laspy", path).open(path) as reader:
        return reader.header
