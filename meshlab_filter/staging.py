# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs appear whole or not at all: written into a hidden folder, then moved into place."""

from __future__ import annotations

import os
import re
import shutil
import time
import uuid
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import FileError
from .watch import announce, undisturbed

PREFIX = ".salient-simplify-"
STALE = 3600.0
"""Age in seconds from which a hidden folder is one that a killed run left."""


@contextmanager
def staging(path: Path) -> Iterator[Path]:
    """Give a hidden folder beside an output; it goes away with all that was not published.

    So do those that runs left behind which were killed an hour or longer ago.
    """
    folder = path.parent / f"{PREFIX}{uuid.uuid4().hex[:8]}"
    _remove_stale(path.parent)
    announce(folder)
    try:
        folder.mkdir(mode=0o700)
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror})") from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def publish(folder: Path, path: Path, *, force: bool, kept: Collection[str] = ()) -> None:
    """Move what was written into place; the named file last, for it refers to the others.

    Files named in `kept` stay as they are where they exist already. If a move fails, those before
    it are undone.

    Raises
    ------
    FileError
        If nothing was written, or if a file that goes along exists and `force` is False.
    """
    if not (folder / path.name).is_file():
        raise FileError(f"{path}: MeshLab wrote nothing; choose another format, such as .ply")
    written = {f.relative_to(folder): f for f in folder.rglob("*") if f.is_file()}
    moves = {
        path.parent / name: file
        for name, file in written.items()
        if name.as_posix() not in kept or not (path.parent / name).exists()
    }
    # The output itself was checked before the work was done.
    taken = [target for target in moves if target.exists() and target.name != path.name]
    if taken and not force:
        raise FileError(
            f"{taken[0]}: exists already and goes along with {path.name}; name another folder, "
            "or overwrite it with --force"
        )
    for file in moves.values():
        _flush(file)  # a disk can turn out to be full only now
    order = sorted(moves, key=lambda target: target.name == path.name)
    with undisturbed():
        _exchange([(moves[target], target) for target in order], folder)


def write(path: Path, writer: Callable[[Path], object]) -> None:
    """Let `writer` write a file of the same name elsewhere, then move it into place."""
    with staging(path) as folder:
        writer(folder / path.name)
        publish(folder, path, force=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    write(path, lambda staged: staged.write_text(text, encoding="utf-8"))


def _exchange(moves: list[tuple[Path, Path]], folder: Path) -> None:
    """Rename files in order; all of them, or none."""
    done: list[tuple[Path, Path]] = []
    try:
        for number, (file, target) in enumerate(moves):
            target.parent.mkdir(parents=True, exist_ok=True)
            spare = folder / f"spare {number}"
            if target.exists() and number < len(moves) - 1:
                _copy(target, spare)
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


def _copy(file: Path, spare: Path) -> None:
    """Keep a file under a second name; where there are no links, as a copy."""
    try:
        os.link(file, spare)
    except OSError:
        shutil.copy2(file, spare)


def _flush(file: Path) -> None:
    with file.open("rb+") as written:
        os.fsync(written.fileno())


def _remove_stale(home: Path) -> None:
    """Remove the hidden folders of runs that were killed long ago."""
    for folder in home.glob(f"{PREFIX}*"):
        if re.fullmatch(r"[0-9a-f]{8}", folder.name.removeprefix(PREFIX)):
            with suppress(OSError):
                if time.time() - folder.lstat().st_mtime > STALE:
                    shutil.rmtree(folder, ignore_errors=True)
