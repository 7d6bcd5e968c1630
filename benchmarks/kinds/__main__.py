# SPDX-License-Identifier: GPL-3.0-or-later
"""Many parts, flat sides, colours and textures, beside MeshLab's quadric decimation.

    python -m benchmarks.kinds [--models FOLDER] [--figures FOLDER]

Writes kinds.md. Both are asked for as many triangles as ours has at a share of the points; MeshLab
keeps original vertices, too.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pymeshlab
from PIL import Image
from scipy.spatial import cKDTree

import salcore
from benchmarks.common.models import present
from benchmarks.common.page import options, table, write
from benchmarks.common.shapes import mesh_shape, read
from benchmarks.kinds.shapes import Mesh, box, charts, checker, plate, tree
from benchmarks.peers.quality import Judge, scattered

RATIOS = (0.5, 0.1, 0.02)
PARTS = ({"count": 10_000}, {"count": 6_000}, {"count": 2_000}, {"faces": 10_000}, {"faces": 2_000})
BOXES = (128, 256)
TEXTURED, CHARTS = "bun_zipper.ply", 20


class Light(NamedTuple):
    """A simplified mesh, values of its points or texture coordinates of its corners, the time."""

    mesh: Mesh
    values: np.ndarray | None
    seconds: float


def ours(mesh: Mesh, texture: np.ndarray | None = None, **wanted: object) -> Light:
    """Simplify by ours; colours are to be given by `point_values`, texture by corner."""
    begun = time.process_time()
    result = salcore.simplify(*mesh, corner_values=[] if texture is None else texture, **wanted)
    seconds = time.process_time() - begun
    values = None if texture is None else texture.reshape(-1, 2)[result.face_corners]
    if "point_values" in wanted:
        values = np.asarray(wanted["point_values"])[result.indices]
    return Light(Mesh(mesh.points[result.indices], result.faces), values, seconds)


def meshlab(
    mesh: Mesh, faces: int, colors: np.ndarray | None = None, texture: np.ndarray | None = None
) -> Light:
    """Simplify by MeshLab."""
    meshes = pymeshlab.MeshSet(verbose=False)
    if texture is not None:
        load_textured(meshes, mesh, texture)
    elif colors is not None:
        rgba = np.insert(colors / 255, 3, 1.0, axis=1)
        meshes.add_mesh(pymeshlab.Mesh(*mesh, v_color_matrix=rgba))
    else:
        meshes.add_mesh(pymeshlab.Mesh(*mesh))
    begun = time.process_time()
    if texture is None:
        meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces, optimalplacement=False)
    else:
        meshes.meshing_decimation_quadric_edge_collapse_with_texture(
            targetfacenum=faces, optimalplacement=False
        )
    seconds = time.process_time() - begun
    light = meshes.current_mesh()
    values = None
    if colors is not None:
        values = 255 * light.vertex_color_matrix()[:, :3]
    if texture is not None:
        values = light.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    return Light(Mesh(light.vertex_matrix(), light.face_matrix()), values, seconds)


def load_textured(meshes: pymeshlab.MeshSet, mesh: Mesh, texture: np.ndarray) -> None:
    """Load a mesh with a texture, by way of a file: arrays alone give it coordinates, no image."""
    corner = np.arange(mesh.faces.size).reshape(-1, 3)
    both = np.stack([mesh.faces, corner], axis=2).reshape(-1, 6) + 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        Image.new("RGB", (4, 4)).save(folder / "image.png")
        (folder / "mesh.mtl").write_text("newmtl image\nmap_Kd image.png\n")
        with (folder / "mesh.obj").open("w") as file:
            file.write("mtllib mesh.mtl\nusemtl image\n")
            np.savetxt(file, mesh.points, "v %.9g %.9g %.9g")
            np.savetxt(file, texture.reshape(-1, 2), "vt %.9g %.9g")
            np.savetxt(file, both, "f %d/%d %d/%d %d/%d")
        meshes.load_new_mesh(str(folder / "mesh.obj"))


def areas(mesh: Mesh) -> np.ndarray:
    """Return the areas of the faces."""
    a, b, c = mesh.points[mesh.faces.T]
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def parts() -> str:
    """Return the table of a tree: the area of leaves that is left."""
    mesh = tree()

    def leaf_area(light: Light) -> str:
        high = light.mesh.points[light.mesh.faces].min(axis=1)
        radius = np.hypot(*light.mesh.points[light.mesh.faces].mean(axis=1)[:, :2].T)
        leaf = (radius > 0.6) | (high[:, 2] > 10)
        return f"{areas(light.mesh)[leaf].sum():.1f}"

    whole = leaf_area(Light(mesh, None, 0.0))
    rows = []
    for wanted in PARTS:
        light = ours(mesh, **wanted)
        theirs = meshlab(mesh, len(light.mesh.faces))
        asked = " ".join(f"{value:,} {name}" for name, value in wanted.items())
        asked = asked.replace("count", "points")
        rows.append([asked, f"{len(light.mesh.faces):,}", leaf_area(light), leaf_area(theirs)])
    head = [f"{len(mesh.faces):,} triangles, leaves {whole}", "triangles", "ours", "MeshLab"]
    return table(head, rows)


def flat() -> str:
    """Return the table of a plate: how evenly it is covered, and the shape of its faces."""
    mesh = plate()
    rows = []
    for ratio in RATIOS:
        light = ours(mesh, ratio=ratio)
        cells = []
        for each in (light, meshlab(mesh, len(light.mesh.faces))):
            places = scattered(*each.mesh)[0]
            gap = cKDTree(each.mesh.points).query(places)[0]
            a, b, c = each.mesh.points[each.mesh.faces.T]
            sides = sum(((u - v) ** 2).sum(axis=1) for u, v in ((a, b), (b, c), (c, a)))
            shape = 4 * np.sqrt(3) * areas(each.mesh) / sides
            cells += [f"{gap.mean():.4f}", f"{(shape < 0.1).mean():.2%}"]
        rows.append([f"{ratio:.0%}", *cells])
    head = [f"plate of {len(mesh.points):,} points", "ours: gap", "slivers"]
    return table([*head, "MeshLab: gap", "slivers"], rows)


def boxes() -> str:
    """Return the table of times for turned boxes."""
    rows = []
    for steps in BOXES:
        mesh = box(steps)
        light = ours(mesh, ratio=0.1)
        theirs = meshlab(mesh, len(light.mesh.faces))
        seconds = (f"{each.seconds:.1f} s" for each in (light, theirs))
        rows.append([f"{len(mesh.points):,} points", *seconds])
    return table(["box, 10 %", "ours", "MeshLab"], rows)


def colors() -> str:
    """Return the table of a coloured plate: the rms error of its colours."""
    mesh = plate()
    color = checker(mesh)
    rows = []
    for ratio in RATIOS:
        seen, blind = ours(mesh, ratio=ratio, point_values=color), ours(mesh, ratio=ratio)
        blind = blind._replace(values=checker(blind.mesh))
        theirs = meshlab(mesh, len(seen.mesh.faces), colors=color)
        cells = []
        for each in (seen, blind, theirs):
            at, face, weights = scattered(*each.mesh)
            shown = (each.values[:, 0][each.mesh.faces[face]] * weights).sum(axis=1)
            wrong = shown - checker(Mesh(at, mesh.faces))[:, 0]
            cells.append(f"{np.sqrt(np.mean(wrong**2)):.0f}")
        rows.append([f"{ratio:.0%}", *cells])
    return table(["plate", "ours", "ours without the colours", "MeshLab"], rows)


def textures(mesh: Mesh) -> str:
    """Return the table of a scan with a texture in many charts: torn faces, and errors."""
    texture = charts(mesh, CHARTS)
    judge = Judge(mesh_shape(*mesh))
    ends = np.unique(np.column_stack([mesh.faces.ravel(), chart_of(texture).ravel()]), axis=0)
    on_seams = (np.bincount(ends[:, 0]) > 1).mean()
    rows = []
    for ratio in RATIOS:
        kept = ours(mesh, texture, ratio=ratio)
        free = ours(mesh, texture, ratio=ratio, keep_seams=False)
        theirs = meshlab(mesh, len(kept.mesh.faces), texture=texture)
        cells = []
        for each in (kept, free, theirs):
            chart = chart_of(each.values)
            torn = (chart != chart[:, :1]).any(axis=1).mean()
            cells += [f"{torn:.1%}", f"{judge.surface(*each.mesh)['rms']:.4f} %"]
        rows.append([f"{ratio:.0%}", *cells])
    head = [f"{on_seams:.0%} of the points on seams", "ours: torn", "rms", "`--no-seams`: torn"]
    return table([*head, "rms", "MeshLab: torn", "rms"], rows)


def chart_of(texture: np.ndarray) -> np.ndarray:
    """Return the number of the chart of each corner, (F, 3), of coordinates made by `charts`."""
    x, y = np.rint((texture - 0.5 / CHARTS) / (1 + 1 / CHARTS)).astype(int).transpose(2, 0, 1)
    return x * CHARTS + y


def main() -> None:
    """Measure, and write the page."""
    chosen = options(__doc__)
    sections = [ABOUT_PARTS, parts(), ABOUT_FLAT, flat(), boxes(), ABOUT_COLORS, colors()]
    for path in present([chosen.models / TEXTURED]):
        shape = read(path)
        sections += [ABOUT_TEXTURES, textures(Mesh(shape.points, shape.faces))]
    title = "Parts, flat sides, colours, textures"
    write(chosen.figures / "kinds.md", title, "benchmarks.kinds", *sections)


ABOUT_PARTS = """MeshLab's quadric decimation keeps original vertices here and is asked for as many
triangles as ours has. Seconds are the processor's.

## Parts

A tree of a bumpy trunk and 3,000 leaf cards: the area of leaves that is left."""
ABOUT_FLAT = """## Flat sides

*Gap*: mean distance of the surface to the nearest vertex, of a plate of side 1. *Slivers*:
triangles of a shape below 0.1 (1 is equilateral)."""
ABOUT_COLORS = """## Colours

The same plate with a checker of black and white at its points: rms error of the colours that the
light mesh shows, of 255."""
ABOUT_TEXTURES = """## Textures

The Bunny with a texture in charts, boxes as seen along z. *Torn*: triangles whose corners lie in
different charts. The rms error is in per cent of the diagonal."""


if __name__ == "__main__":
    main()
