# SPDX-License-Identifier: GPL-3.0-or-later
"""Analyse and simplify two scans that come with pymeshlab."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pymeshlab

import salcore

from .. import bridge, filters
from ..errors import FileError
from ..io import files
from ..io.save import save_mesh
from ..io.staging import write_text
from .picture import Panel, save_picture

SCANS = {"bunny": "bunny10k_textured.obj", "face": "rangemaps/face000.ply"}
"""A mesh of the Stanford Bunny and a raw range map of a face."""

ALPHA = 30.0


def sample(name: str) -> Path:
    """Return the path of a sample mesh in pymeshlab's installation."""
    path = Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / name
    if not path.exists():
        raise FileError(f"{path}: pymeshlab came without its sample meshes; reinstall it")
    return path


def panels(
    name: str, points: Any, faces: Any, analysis: salcore.Analysis, result: salcore.Simplification
) -> list[Panel]:
    """Return a row of panels: original, saliency, regions and kept points."""
    normals, report = analysis.normals, result.report
    salient = salcore.saliency_colors(analysis.saliency)
    shape = (points, faces, normals)
    return [
        Panel(f"{name}: {report.points_before:,} points", *shape),
        Panel("saliency", *shape, salient),
        Panel(
            f"{analysis.segmentation.count:,} regions",
            *shape,
            salcore.region_colors(analysis.regions),
        ),
        Panel(
            f"kept: {report.points_after:,} points ({1 - report.rate:.0%})",
            *shape,
            0.85 * salient,
            result.indices,
        ),
    ]


def run(folder: Path, progress: filters.Callback | None = None) -> dict[str, Any]:
    """Analyse and simplify both scans into `folder`, and return the reports.

    For each scan: `NAME_saliency.ply`, `NAME_regions.ply` and `NAME_simplified.ply`; for both
    `demo.png` and `report.json`. Existing files of these names are overwritten.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise FileError(f"{folder}: is a file, or in one; name a folder") from error
    reports, rows = {}, []
    for name, file in SCANS.items():
        mesh_set = files.load(sample(file))
        points, faces, normals = bridge.read(mesh_set.current_mesh())
        analysis = salcore.analyze(points, faces, normals, progress=progress)
        result = analysis.simplify(alpha=ALPHA)
        reports[name] = result.report.as_dict()
        rows.append(panels(name, points, faces, analysis, result))
        bridge.set_scalar(mesh_set, analysis.saliency, "saliency")
        bridge.set_colors(mesh_set, salcore.saliency_colors(analysis.saliency))
        save_mesh(mesh_set, folder / f"{name}_saliency.ply")
        bridge.add_simplified(mesh_set, mesh_set.current_mesh(), result, name)
        save_mesh(mesh_set, folder / f"{name}_simplified.ply")
        mesh_set.set_current_mesh(0)
        bridge.set_scalar(mesh_set, analysis.regions, "region")
        bridge.set_colors(mesh_set, salcore.region_colors(analysis.regions))
        save_mesh(mesh_set, folder / f"{name}_regions.ply")
    save_picture(folder / "demo.png", rows)
    write_text(folder / "report.json", json.dumps(reports, indent=2))
    return reports
