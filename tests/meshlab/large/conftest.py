# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests of large scans have in common."""

from pathlib import Path

import numpy as np
import pytest
from models import load_model
from scan_jobs import write_scan

import meshlab_filter


@pytest.fixture(autouse=True)
def same_code(monkeypatch):
    """Let processes import the code that the tests import, whatever copy is installed."""
    monkeypatch.setenv("PYTHONPATH", str(Path(meshlab_filter.__file__).parents[1]))


@pytest.fixture(scope="session")
def scans(tmp_path_factory):
    """A third of the crop as two files that border on each other."""
    points, _ = load_model("autzen_crop_100k.ply")
    points = points[points[:, 0] < np.quantile(points[:, 0], 0.35)]
    left = points[:, 1] < np.median(points[:, 1])
    folder = tmp_path_factory.mktemp("scans")
    offset = np.floor(points.min(axis=0))
    return [
        write_scan(folder / f"{name}.laz", points[part], offset=offset)
        for name, part in (("a", left), ("b", ~left))
    ]
