# SPDX-License-Identifier: GPL-3.0-or-later
"""Real models for tests: a folder beside the repository, or the one $SALIENT_MODELS names."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

FOLDER = Path(os.environ.get("SALIENT_MODELS", Path(__file__).parents[2] / "shared" / "models"))


def model_path(name: str) -> Path:
    """Return the path of a model, or skip the test and say which folder is missing."""
    path = FOLDER / name
    if not path.exists():
        pytest.skip(f"no model {path}; set $SALIENT_MODELS to the folder of models")
    return path


@cache
def _load(path: Path) -> tuple[np.ndarray, np.ndarray | None]:
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    points = mesh.vertex_matrix()
    faces = mesh.face_matrix() if mesh.face_number() else None
    points.setflags(write=False)
    return points, faces


def load_model(name: str) -> tuple[np.ndarray, np.ndarray | None]:
    """Return points and faces (None for a cloud) of a model."""
    return _load(model_path(name))


@cache
def _crop(path: Path, most: int) -> tuple[np.ndarray, np.ndarray | None]:
    points, faces = _load(path)
    if len(points) <= most:
        return points, faces
    reach = np.ptp(np.where(np.isfinite(points), points, 0.0), axis=0)
    near = np.sort(np.argsort(points[:, reach.argmax()], kind="stable")[:most])
    place = np.full(len(points), -1)
    place[near] = np.arange(most)
    part = points[near]
    part.setflags(write=False)
    return part, None if faces is None else place[faces[(place[faces] >= 0).all(axis=1)]]


def load_crop(name: str, most: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the end of a model along its longest side, of at most so many points.

    What a whole scan shows of one kind, a part of it shows in a fraction of the time.
    """
    return _crop(model_path(name), most)
