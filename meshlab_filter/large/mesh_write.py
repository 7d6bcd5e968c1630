# SPDX-License-Identifier: GPL-3.0-or-later
"""The light mesh, with all its points and faces carry, block by block into one PLY file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from salcore.progress import Progress

from ..io.staging import publish, staging
from .mesh_job import MeshJob, Pass
from .mesh_stages import load
from .ply_blocks import blocks, rows


def write_mesh(
    job: MeshJob, last: Pass, output: Path, force: bool, progress: Progress
) -> tuple[int, int]:
    """Write what the last pass has left; return how many points and faces there are.

    Points are in the order of the input, and faces in that of the tiles.
    """
    paths = [job.path(f"left-{last.turn}-{tile}.npz") for tile in range(len(last.boxes))]
    kept, faces = [], 0
    for path in paths:
        found = load(path)
        kept.append(found["number"][found["owned"]])
        faces += len(found["faces"])
    numbers = np.sort(np.concatenate(kept))
    layout = job.layout
    with staging(output) as folder:
        staged = folder / output.name
        with staged.open("wb") as file:
            head = layout.head.format(vertex=len(numbers), face=faces)
            file.write(head.encode("utf-8", "surrogateescape"))
            for start, stop in blocks(layout.vertices):
                first, end = np.searchsorted(numbers, [start, stop])
                block = rows(layout, layout.vertices, start, stop)
                file.write(block[numbers[first:end] - start].tobytes())
                progress(0.5 * start / layout.vertices.length)
            for done, path in enumerate(paths):
                _write_faces(job, load(path), numbers, file)
                progress(0.5 + 0.5 * done / len(paths))
        publish(folder, output, force=force)
    return len(numbers), faces


def _write_faces(
    job: MeshJob, found: dict[str, NDArray[Any]], numbers: NDArray[np.int64], file: Any
) -> None:
    """Write the faces of a tile in the order of the input, with the values of theirs there."""
    layout = job.layout
    place = np.searchsorted(numbers, found["number"])
    for start, stop in blocks(layout.faces):
        first, end = np.searchsorted(found["face_number"], [start, stop])
        if first < end:
            block = rows(layout, layout.faces, start, stop)
            table = block[found["face_number"][first:end] - start]
            table[layout.corners] = place[found["faces"][first:end]]
            file.write(table.tobytes())
