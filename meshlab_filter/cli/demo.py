# SPDX-License-Identifier: GPL-3.0-or-later
"""Analyse and simplify two scans that come with pymeshlab."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import salcore

from ..errors import FileError
from ..io.documents import LayerDocument
from ..io.formats import reader
from ..io.staging import write_text
from ..parameters import Callback
from .picture import Panel, check_picture, save_picture

SCANS = {"bunny": ("bunny10k_textured.obj", 0.1), "face": ("rangemaps/face000.ply", 0.05)}
"""A mesh of the Stanford Bunny and a raw range map of a face, and how much is kept of each."""


def sample(name: str) -> Path:
    """Return the path of a sample mesh in pymeshlab's installation."""
    # The scans alone are wanted: the library itself cannot be loaded on every machine.
    found = importlib.util.find_spec("pymeshlab")
    if found is None or found.origin is None:
        raise FileError(
            "the demo's scans come with pymeshlab; install it with pip install "
            "'salient-simplify[meshlab]'"
        )
    path = Path(found.origin).parent / "tests" / "sample_meshes" / name
    if not path.exists():
        raise FileError(f"{path}: pymeshlab came without its sample meshes; reinstall it")
    return path


def _open(path: Path) -> LayerDocument:
    """Open one of the scans."""
    module = reader(path)
    assert module is not None
    return LayerDocument(path, module.read(path)[0])


def panels(
    name: str, points: Any, faces: Any, analysis: salcore.Analysis, result: salcore.Simplification
) -> list[Panel]:
    """Return a row of panels: original, saliency, regions, and the light mesh or kept points."""
    normals, report = analysis.normals, result.report
    salient = salcore.saliency_colors(analysis.saliency)
    shape = (points, faces, normals)
    return [
        Panel(f"{name}: {_size(report.points_before, report.faces_before)}", *shape),
        Panel("saliency: blue is plain, red stands out", *shape, salient),
        Panel(
            f"{analysis.segmentation.count:,} regions: the largest is grey",
            *shape,
            salcore.region_colors(analysis.regions),
        ),
        _light(points, normals, salient, result),
    ]


def _light(points: Any, normals: Any, salient: Any, result: salcore.Simplification) -> Panel:
    """Return the panel of the result: its mesh with edges, else the kept points in colour."""
    report, kept = result.report, result.indices
    title = f"{1 - report.rate:.0%} of the points: {_size(len(kept), report.faces_after)}"
    if result.faces is None:
        return Panel(title, points, None, normals, 0.85 * salient, kept)
    assert report.errors is not None
    mean = report.errors.surface.mean / report.errors.diagonal
    title += f"\nmean error {mean:.3%} of the diagonal"
    places = points[kept] if result.positions is None else result.positions
    return Panel(title, places, result.faces, normals[kept], edges=True)


def _size(points: int, faces: int) -> str:
    """Return numbers of points and, of a mesh, of faces as a text."""
    return f"{points:,} points" + (f", {faces:,} faces" if faces else "")


def run(folder: Path, progress: Callback | None = None) -> dict[str, Any]:
    """Analyse and simplify both scans into `folder`, and return the reports.

    For each scan the maps `NAME_saliency.ply` and `NAME_regions.ply` and the light mesh
    `NAME_simplified.ply`; for both `demo.png` and `report.json`. Existing files of these names are
    overwritten.
    """
    picture = folder / "demo.png"
    check_picture(picture)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise FileError(f"{folder}: is a file, or in one; name a folder") from error
    reports, rows = {}, []
    for name, (file, ratio) in SCANS.items():
        scan = _open(sample(file))
        points, faces, normals = scan.arrays
        analysis = salcore.analyze(points, faces, normals, progress=progress)
        result = analysis.simplify(ratio=ratio, **scan.corner_layers())
        reports[name] = result.report.as_dict()
        rows.append(panels(name, points, faces, analysis, result))
        for kind, values, colors in (
            ("saliency", analysis.saliency, salcore.saliency_colors(analysis.saliency)),
            ("regions", analysis.regions, salcore.region_colors(analysis.regions)),
        ):
            scan.write_map(values, kind, colors, folder / f"{name}_{kind}.ply", force=True)
        simplified = folder / f"{name}_simplified.ply"
        scan.write_simplified(
            result, simplified, normals=analysis.normals, with_faces=True, force=True
        )
    save_picture(picture, rows)
    write_text(folder / "report.json", json.dumps(reports, indent=2))
    return reports
