# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the models lie, and how they come to be arrays."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
FOLDER = Path(os.environ.get("SALIENT_MODELS", ROOT.parent / "shared" / "models"))


def add_models_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the folder of models."""
    parser.add_argument(
        "--models",
        type=Path,
        default=FOLDER,
        help="folder of models; default: $SALIENT_MODELS, else ../shared/models",
    )


def present(paths: Iterable[Path]) -> list[Path]:
    """Return the paths that exist, and name the others on stderr."""
    found = []
    for path in paths:
        if path.exists():
            found.append(path)
        else:
            print(f"missing: {path}", file=sys.stderr)
    return found


def load(path: Path, cloud: bool = False) -> tuple[np.ndarray, np.ndarray | None]:
    """Return a model's points (N, 3) and faces (F, 3); None for a cloud, or where faces are not
    wanted. A folder is a scan in LAZ files.
    """
    if path.is_dir():
        return scan(path), None
    import pymeshlab  # here, because most processes that measure get arrays and load no models

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    faces = mesh.face_matrix() if mesh.face_number() and not cloud else None
    return mesh.vertex_matrix(), faces


def scan(folder: Path) -> np.ndarray:
    """Return the points of all LAZ files of a folder, (N, 3)."""
    import laspy

    return np.concatenate([laspy.read(str(path)).xyz for path in sorted(folder.glob("*.laz"))])
