# SPDX-License-Identifier: GPL-3.0-or-later
"""The kept points, with all their dimensions, chunk by chunk into one LAS or LAZ file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError, Warn
from ..io.formats import required
from ..io.las import RAW, damage, plain_header
from ..io.staging import publish, staging
from .bins import read_chunks
from .job import Job, Source

SLACK = 1e-6
"""Share of a step by which scales and offsets may miss whole steps of one another."""


def output_header(job: Job, warn: Warn) -> Any:
    """Return the header of the output: the first file's, at the finest scale of all.

    Raises
    ------
    FileError
        If the files' points differ in format, or if their coordinates are no whole steps of one
        scale, or reach further than 32 bits.
    """
    headers = [_header(source) for source in job.sources]
    first, path = plain_header(headers[0]), job.sources[0].path
    scales = np.min([header.scales for header in headers], axis=0)
    first.scales = scales
    remedy = "convert them to one, or simplify each by itself"
    for source, header in zip(job.sources, headers, strict=True):
        if header.point_format != first.point_format:
            raise FileError(
                f"{source.path}: its points are of another format or have other dimensions than "
                f"those of {path}; {remedy}"
            )
        factor, shift = _steps(header, first)
        off = max(np.abs(v - np.round(v)).max() for v in (factor, shift))
        reach = np.abs(np.array([header.mins, header.maxs]) - first.offsets).max(axis=0) / scales
        if off > SLACK * max(1.0, float(np.abs(shift).max())) or (reach >= 2**31).any():
            raise FileError(
                f"{source.path}: scale or offset do not go together with those of {path}; {remedy}"
            )
        if _projection(header) != _projection(headers[0]):
            warn(f"{source.path}: has another coordinate system than {path}, whose the output has")
    return first


def _header(source: Source) -> Any:
    path = Path(source.path)
    try:
        with required("laspy", path).open(path) as reader:
            return reader.header
    except Exception as error:  # each backend has errors of its own
        raise damage(path, error) from error


def _steps(header: Any, first: Any) -> tuple[Any, Any]:
    """Return how many steps of the output a step of a file is, and its offset in such steps."""
    return header.scales / first.scales, (header.offsets - first.offsets) / first.scales


def _projection(header: Any) -> list[tuple[int, bytes]]:
    """Return the records that tell the coordinate system."""
    records = [*header.vlrs, *(header.evlrs or ())]
    found = [r for r in records if r.user_id.startswith("LASF_Projection")]
    return [(r.record_id, r.record_data_bytes()) for r in found]


def write_kept(
    job: Job, tiles: int, output: Path, force: bool, progress: Callable[[float], None], warn: Warn
) -> int:
    """Write the kept points of all files in their order; return how many there are.

    Raises
    ------
    FileError
        If a file cannot be read, or the output not be written.
    """
    laspy, header, written = required("laspy", output), output_header(job, warn), 0
    with staging(output) as folder:
        staged, compress = folder / output.name, output.suffix.lower() == ".laz"
        with laspy.open(staged, mode="w", header=header, do_compress=compress) as writer:
            for source in job.sources:
                kept = _kept_of(job, tiles, source)
                for at, chunk in read_chunks(source):
                    inside = kept[at : at + len(chunk)]
                    if inside.any():
                        writer.write_points(moved_records(chunk[inside], writer.header, source))
                    written += int(inside.sum())
                    progress((source.start + at + len(chunk)) / job.points)
        publish(folder, output, force=force)
    return written


def _kept_of(job: Job, tiles: int, source: Source) -> NDArray[np.bool_]:
    """Return which points of a file are kept."""
    kept = np.zeros(source.points, dtype=bool)
    ends = [source.start, source.start + source.points]
    for tile in range(tiles):
        numbers = np.load(job.path(f"kept-{tile}.npy"), mmap_mode="r")
        first, last = np.searchsorted(numbers, ends)
        kept[numbers[first:last] - source.start] = True
    return kept


def moved_records(points: Any, header: Any, source: Source) -> Any:
    """Return records of a file at the scale and offset of the output."""
    factor, shift = (np.round(v).astype(np.int64) for v in _steps(points, header))
    if (factor != 1).any() or shift.any():
        for axis, name in enumerate(RAW):
            moved = points.array[name].astype(np.int64) * factor[axis] + shift[axis]
            if np.abs(moved).max(initial=0) >= 2**31:
                raise FileError(f"{source.path}: coordinates reach further than 32 bits hold")
            points.array[name] = moved
    return type(points)(
        points.array, points.point_format, scales=header.scales, offsets=header.offsets
    )
