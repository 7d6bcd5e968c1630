# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in tiles against the same meshes in memory: what they take, and what differs.

    python -m benchmarks.tiles.meshes [--models FOLDER] [--figures FOLDER]

Runs the command as a user does, on a scan and on a terrain made by a formula; writes
tiles_meshes.md. Topology is what MeshLab says of the results.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab

from benchmarks.common.models import ROOT, present
from benchmarks.common.page import options, table, write
from benchmarks.common.shapes import read
from benchmarks.kinds.shapes import lattice
from benchmarks.peers.quality import Judge
from benchmarks.tiles.processes import Taken, run

SCAN, SCAN_MEMORY = "dragon_vrip.ply", "900M"
COLUMNS, ROWS, TERRAIN_MEMORY = 2100, 2000, "1.4G"
RATIO = 0.1


def terrain(path: Path) -> None:
    """Write a terrain of four million points: smooth hills with sharp ridges, uneven spacing."""
    rng = np.random.default_rng(5)
    points, faces = lattice(COLUMNS, ROWS)
    height = 40 * hills(rng) + 25 * np.abs(hills(rng))
    points = points * [COLUMNS, ROWS, 0] + rng.uniform(-0.25, 0.25, points.shape) * [1, 1, 0]
    points[:, 2] = height.ravel()
    save(path, points, faces)


def hills(rng: np.random.Generator) -> np.ndarray:
    """Return heights of a Gaussian field that falls with the square of the frequency."""
    across = np.hypot(np.fft.fftfreq(ROWS)[:, None], np.fft.rfftfreq(COLUMNS))
    across[0, 0] = 1.0
    waves = np.fft.rfft2(rng.normal(size=(ROWS, COLUMNS))) * across**-2.0 * (across < 0.2)
    height = np.fft.irfft2(waves, s=(ROWS, COLUMNS))
    return height / height.std()


def save(path: Path, points: np.ndarray, faces: np.ndarray) -> None:
    """Write a binary PLY file."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(points, faces))
    meshes.save_current_mesh(str(path), binary=True, save_vertex_normal=False)


def simplify(mesh: Path, output: Path, *more: str) -> tuple[Taken, dict[str, Any]]:
    """Run the command, and return what it took and its report."""
    report = output.with_suffix(".json")
    command = [sys.executable, "-m", "meshlab_filter", "simplify", str(mesh), str(output)]
    command += ["--ratio", str(RATIO), "--no-errors", "--quiet", "--report", str(report)]
    return run([*command, *more]), json.loads(report.read_text())


def topology(path: Path) -> str:
    """Return Euler's number, parts, open edges and edges of three faces, as MeshLab counts them."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(path))
    found = meshes.get_topological_measures()
    euler = found["vertices_number"] - found["edges_number"] + found["faces_number"]
    parts = found["connected_components_number"]
    rest = f"{found['boundary_edges']:,}, {found['non_two_manifold_edges']}"
    return f"{euler}, {parts}, {rest}"


def row(name: str, mesh: Path, memory: str) -> list[str]:
    """Return the figures of one mesh; results lie beside it."""
    folder = mesh.parent
    whole, _ = simplify(mesh, folder / "whole.ply", "--memory", "1T")
    tiled, report = simplify(
        mesh, folder / "tiles.ply", "--tiled", "--memory", memory, "--workers", "2"
    )
    judge = Judge(read(mesh))
    results = [read(folder / file) for file in ("tiles.ply", "whole.ply")]
    one, other = (judge.surface(each.points, each.faces)["rms"] for each in results)
    return [
        name,
        f"{len(judge.shape.points):,}",
        str(report["tiles"]),
        f"{len(results[0].points):,}, {len(results[1].points):,}",
        f"{one / other:.3f}",
        f"{tiled.memory / 1e9:.2f} GB, {whole.memory / 1e9:.2f} GB",
        f"{tiled.cpu:.0f} s, {whole.cpu:.0f} s ({tiled.cpu / whole.cpu:.1f})",
        topology(mesh),
        topology(folder / "tiles.ply"),
    ]


def main() -> None:
    """Measure what is there, and write the page."""
    chosen = options(__doc__)
    os.environ["PYTHONPATH"] = str(ROOT)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scan in present([chosen.models / SCAN]):
            shape = read(scan)
            save(Path(folder) / "mesh.ply", shape.points, shape.faces)
            rows.append(row(scan.stem, Path(folder) / "mesh.ply", SCAN_MEMORY))
            print(*rows[-1], flush=True)
    with tempfile.TemporaryDirectory() as folder:
        terrain(Path(folder) / "mesh.ply")
        rows.append(row("terrain", Path(folder) / "mesh.ply", TERRAIN_MEMORY))
    head = ["points", "tiles", "kept", "rms, of the one in memory", "peak memory"]
    head += ["CPU", "topology before", "after"]
    title = "Meshes in tiles"
    path = chosen.figures / "tiles_meshes.md"
    write(path, title, "benchmarks.tiles.meshes", ABOUT, table(["mesh", *head], rows))


ABOUT = """Meshes in PLY files cut to 10 % by two processes, and in memory (second figure), without
measuring errors. Memory is all processes' together. Topology is Euler's number, the numbers of
parts, of open edges, and of edges of more than two faces."""


if __name__ == "__main__":
    main()
