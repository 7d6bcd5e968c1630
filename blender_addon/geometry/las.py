# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of LAS and LAZ files, COPC among them, with all dimensions that say something."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .libraries import required
from .read import HostError

RAW = {"X", "Y", "Z"}
"""Dimensions as whole numbers, which scale and offset make coordinates of."""
PACKED = ".laz"
CHUNK = 1_000_000
MAX_RATIO = 50
"""Compression from which a file is read in pieces, lest it declare more than it has."""


def read_points(path: Path) -> dict[str, NDArray[Any]]:
    """Return coordinates and dimensions of a LAS or LAZ file, one array (n,) each.

    Dimensions that are 0 everywhere, as those that a scanner does not fill, are left out.

    Raises
    ------
    HostError
        If the file is damaged, or a library is not there.
    OSError
        If it cannot be opened.
    """
    laspy = required("laspy", path)
    if path.suffix.lower() == PACKED:
        required("lazrs", path)
    with path.open("rb"):
        pass  # what the system says is clearer than what laspy says
    try:
        las = _read(laspy, path)
    except MemoryError:
        raise
    except Exception as error:  # each backend has errors of its own
        said = " ".join(str(error).split()) or type(error).__name__
        raise HostError(f"{path.name}: is cut short or damaged ({said})") from error
    found = {axis: np.asarray(las[axis], dtype=np.float64) for axis in "xyz"}
    for name in las.point_format.dimension_names:
        values = None if name in RAW else np.asarray(las[name])
        if values is not None and values.any():
            found |= _columns(name, values)
    return found


def _columns(name: str, values: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Return a dimension, or the columns of one that has several."""
    if values.ndim == 1:
        return {name: values}
    return {f"{name}_{k}": values[:, k] for k in range(values.shape[1])}


def _read(laspy: Any, path: Path) -> Any:
    """Return the file as laspy has it, after a look at whether it is all there."""
    size = path.stat().st_size
    with laspy.open(path) as reader:
        header = reader.header
        declared = header.point_count * header.point_format.size
        if not header.are_points_compressed and header.offset_to_point_data + declared > size:
            raise ValueError(f"{header.point_count} points do not fit into {size} bytes")
        if declared > MAX_RATIO * size:
            for _ in reader.chunk_iterator(CHUNK):
                pass
    return laspy.read(path)
