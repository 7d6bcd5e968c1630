# SPDX-License-Identifier: GPL-3.0-or-later
"""Make outputs appear whole or not at all: write to a hidden folder, then move into place."""

from __future__ import annotations

import os
import re
import shutil
import time
import uuid
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import FileError
from .supervise import defer_signals, register_temporary

PREFIX = ".salient-simplify-"
STALE = 3600.0
"""Age in seconds from which a hidden folder counts as left behind by a killed run."""


@contextmanager
def staging(path: Path) -> Iterator[Path]:
    """Make a hidden folder beside an output; at the end remove it with all that is unpublished.

    Folders that killed runs left behind an hour ago or earlier are removed too.
    """
    folder = path.parent / f"{PREFIX}{uuid.uuid4().hex[:8]}"
    _remove_stale(path.parent)
    register_temporary(folder)
    try:
        folder.mkdir(mode=0o700)
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror})") from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def publish(folder: Path, path: Path, *, force: bool, preserve: Collection[str] = ()) -> None:
    """Move all files of a staging folder into place, `path` last, for it refers to the others.

    Existing files named in `preserve` are not replaced. If a move fails, those before it are
    undone.

    Raises
    ------
    FileError
        If `path` was not written, or if another of the files exists and `force` is False.
    """
    if not (folder / path.name).is_file():
        raise FileError(f"{path}: MeshLab wrote nothing; choose another format, such as .ply")
    written = {f.relative_to(folder): f for f in folder.rglob("*") if f.is_file()}
    moves = {
        path.parent / name: file
        for name, file in written.items()
        if name.as_posix() not in preserve or not (path.parent / name).exists()
    }
    # The output itself was checked before the work began.
    taken = [target for target in moves if target.exists() and target.name != path.name]
    if taken and not force:
        raise FileError(
            f"{taken[0]}: exists already and goes along with {path.name}; name another folder, "
            "or overwrite it with --force"
        )
    for file in moves.values():
        _flush(file)  # a full disk may show only now
    order = sorted(moves, key=lambda target: target.name == path.name)
    with defer_signals():
        _move_all([(moves[target], target) for target in order], folder)


def write(path: Path, writer: Callable[[Path], object]) -> None:
    """Call `writer` with a path in a staging folder, then move the file into place."""
    with staging(path) as folder:
        writer(folder / path.name)
        publish(folder, path, force=True)


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file, whole or not at all."""
    write(path, lambda staged: staged.write_text(text, encoding="utf-8"))


def _move_all(moves: list[tuple[Path, Path]], folder: Path) -> None:
    """Rename files in order, all or none."""
    done: list[tuple[Path, Path]] = []
    try:
        for number, (file, target) in enumerate(moves):
            target.parent.mkdir(parents=True, exist_ok=True)
            spare = folder / f"spare {number}"
            if target.exists() and number < len(moves) - 1:
                link(target, spare)
            os.replace(file, target)
            done.append((target, spare))
    except BaseException:
        for target, spare in reversed(done):
            with suppress(OSError):
                if spare.exists():
                    os.replace(spare, target)
                else:
                    target.unlink()
        raise


def link(file: Path, spare: Path) -> None:
    """Give a file a second name, or copy it where the file system has no hard links."""
    try:
        os.link(file, spare)
    except OSError:
        shutil.copy2(file, spare)


def _flush(file: Path) -> None:
    """Wait until a file is on the disk."""
    with file.open("rb+") as written:
        os.fsync(written.fileno())


def _remove_stale(parent: Path) -> None:
    """Remove the hidden folders of runs that were killed long ago."""
    for folder in parent.glob(f"{PREFIX}*"):
        if re.fullmatch(r"[0-9a-f]{8}", folder.name.removeprefix(PREFIX)):
            with suppress(OSError):
                if time.time() - folder.lstat().st_mtime > STALE:
                    shutil.rmtree(folder, ignore_errors=True)
