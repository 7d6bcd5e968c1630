# SPDX-License-Identifier: GPL-3.0-or-later
"""Write which points are kept, and which of them stands for each point of the input."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import salcore

from ..errors import FileError
from ..io.staging import write

ENDINGS = (".npz", ".csv")


def check_indices(path: Path) -> None:
    """Refuse a file of another kind; called before any work is done.

    Raises
    ------
    FileError
    """
    if path.suffix.lower() not in ENDINGS:
        raise FileError(f"{path}: indices are written as .npz or .csv; name such a file")


def write_indices(path: Path, result: salcore.Simplification) -> None:
    """Write the kept indices and the source of every point, whole or not at all.

    An ``.npz`` file holds `indices` and `source` as `salcore.Simplification` does. A ``.csv`` file
    has a line for every point of the input: its number from 0, the position in `indices` of the
    kept point that stands for it, and that point's own number; -1 where there is none.
    """
    if path.suffix.lower() == ".npz":
        write(path, lambda staged: _save(staged, result))
        return
    own = np.append(result.indices, -1)[result.source]
    rows = np.column_stack([np.arange(len(result.source)), result.source, own])
    head = "point,source,kept"
    write(
        path,
        lambda staged: np.savetxt(staged, rows, "%d", delimiter=",", header=head, comments=""),
    )


def _save(path: Path, result: salcore.Simplification) -> None:
    with path.open("wb") as file:
        np.savez(file, indices=result.indices, source=result.source)
