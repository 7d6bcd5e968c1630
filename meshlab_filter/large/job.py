# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run is about: its files, its target, and the work folder that belongs to it alone."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import salcore
from salcore.tiles.plan import LEAST_REACH, REACH

from ..errors import FileError
from ..io.formats import required
from ..io.las import damage

MANIFEST, LOCK = "job.json", "lock"
CHUNK = 1_000_000
"""Points of a file that are in memory at a time."""


@dataclass(frozen=True)
class Source:
    """A LAS, LAZ or COPC file.

    Attributes
    ----------
    path : str
        Absolute.
    size, changed : int
        Bytes, and the time of the last change in nanoseconds.
    points : int
    start : int
        Number of its first point among those of all files.
    low, high : tuple of float
        Corners of its box, as its header has them.
    """

    path: str
    size: int
    changed: int
    points: int
    start: int
    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True)
class Job:
    """A run. It pickles.

    Attributes
    ----------
    folder : str
        Work folder, absolute.
    sources : tuple of Source
    parameters : dict
        Of salcore.
    target : str
        ``ratio``, ``count`` or ``max_error``.
    value : float
    most : int
        Points that a tile may have without its halo.
    errors : bool
        Whether the errors of the result are measured.
    """

    folder: str
    sources: tuple[Source, ...]
    parameters: dict[str, Any]
    target: str
    value: float
    most: int
    errors: bool = False

    @property
    def ratio(self) -> float:
        """Return the share of the points to keep, as far as it is known beforehand."""
        return expected_ratio(self.target, self.value, self.points)

    @property
    def points(self) -> int:
        """Return the number of points of all files."""
        return sum(source.points for source in self.sources)

    def path(self, *names: str) -> Path:
        """Return the path of something in the work folder."""
        return Path(self.folder, *names)

    def manifest(self) -> dict[str, Any]:
        """Return what two runs that share a folder must have in common."""
        values = asdict(self)
        del values["folder"]
        return json.loads(json.dumps({"version": salcore.__version__, **values}))  # type: ignore[no-any-return]


def expected_ratio(target: str, value: float, points: int) -> float:
    """Return the share that a target keeps; where that is not known, what the least halo is for."""
    if target == "max_error":
        return (REACH / LEAST_REACH) ** 2
    return value if target == "ratio" else value / points


def look_at(paths: list[Path]) -> tuple[Source, ...]:
    """Return the files, from their headers.

    Raises
    ------
    FileError
        If one is damaged, holds no points, or laspy is not installed.
    """
    sources, start = [], 0
    for path in paths:
        laspy = required("laspy", path)
        try:
            with laspy.open(path) as reader:
                header = reader.header
        except Exception as error:  # each backend has errors of its own
            raise damage(path, error) from error
        status = path.stat()
        low, high = (tuple(map(float, corner)) for corner in (header.mins, header.maxs))
        count = int(header.point_count)
        sources.append(
            Source(str(path.resolve()), status.st_size, status.st_mtime_ns, count, start, low, high)
        )
        start += count
    if not start:
        raise FileError(f"{paths[0]}: holds no points; it may be damaged or of another format")
    return tuple(sources)


def flush(path: Path) -> None:
    """Wait until a file is on the disk: a power cut must not leave it empty under its last name."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def write_whole(path: Path, writer: Callable[[Path], object]) -> None:
    """Call `writer` with a temporary name, then rename: the file is whole or not there."""
    spare = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        writer(spare)
        flush(spare)
        os.replace(spare, path)
    finally:
        spare.unlink(missing_ok=True)


@contextmanager
def work_folder(job: Job, *, resume: bool) -> Iterator[None]:
    """Take the work folder for this run alone, until the end of the block.

    Raises
    ------
    FileError
        If the folder belongs to another run, or one is under way in it, or it exists and `resume`
        is False, or it does not exist and `resume` is True.
    """
    folder, manifest = Path(job.folder), job.path(MANIFEST)
    if resume and not manifest.is_file():
        raise FileError(f"{folder}: holds no run to resume; leave out --resume to begin one")
    if not resume and folder.exists() and any(folder.iterdir()):
        raise FileError(
            f"{folder}: exists already; go on with it by --resume {folder}, remove it, or name "
            "another by --work-folder"
        )
    folder.mkdir(exist_ok=True)
    with job.path(LOCK).open("ab") as held:
        if not _take(held):
            raise FileError(f"{folder}: another run is at work in this folder; wait for its end")
        if manifest.is_file():
            _check(job, json.loads(manifest.read_text(encoding="utf-8")))
        else:
            text = json.dumps(job.manifest(), indent=1)
            write_whole(manifest, lambda spare: spare.write_text(text, encoding="utf-8"))
        yield


def _check(job: Job, found: dict[str, Any]) -> None:
    """Refuse a manifest of another run."""
    mine = job.manifest()
    mine["most"] = found.get("most")  # a run keeps its tiles, whatever memory there is now
    differing = [key for key, value in mine.items() if found.get(key) != value]
    if differing:
        raise FileError(
            f"{job.folder}: belongs to another run (its {differing[0]} differ); give the same "
            "files and options, or name another folder by --work-folder"
        )


def _take(held: Any) -> bool:
    """Lock a file for as long as it is open; the system lets go of it when the process ends."""
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(held.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            import fcntl

            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def planned_size(job: Job) -> int:
    """Return the points of a tile that the run in the work folder began with."""
    return int(json.loads(job.path(MANIFEST).read_text(encoding="utf-8"))["most"])
