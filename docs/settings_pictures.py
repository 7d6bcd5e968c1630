# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the pictures of docs/tasks/settings.md: before and after with each section's settings.

    python -m docs.settings_pictures [NAME ...]

The subjects are made by docs/subjects.py. What the pictures say stands in docs/figures/settings.md,
which is written when all are drawn.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial import cKDTree

import salcore
from benchmarks.common.page import FIGURES, table, write
from docs.pictures import FOLDER, save_small
from docs.subjects import Mesh, barrel, facade, flange, head
from meshlab_filter.cli.picture import GREY, shaded
from meshlab_filter.cli.raster import visible

Floats = NDArray[np.float64]
PICTURES = FOLDER / "settings"
PIXELS, FINER = 430, 2
"""Width of a panel, and how much finer it is drawn."""
TEXELS, CHARTS = 1024, 144


def turned(points: Floats, yaw: float, pitch: float) -> Floats:
    """Return points as seen after turns, in degrees, round the y axis and then the x axis."""
    a, b = np.radians([yaw, pitch])
    round_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    round_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return np.asarray(points @ (round_x @ round_y).T)


class View:
    """Where a subject is looked at from, the same for all panels of a picture."""

    def __init__(self, points: Floats, yaw: float, pitch: float, width: int = PIXELS) -> None:
        self.turns = yaw, pitch
        seen = turned(points, *self.turns)[:, :2]
        self.low, size = seen.min(axis=0), np.ptp(seen, axis=0)
        self.margin = 0.03 * size.max()
        self.scale = FINER * width / (size[0] + 2.0 * self.margin)
        self.shape = (round((size[1] + 2.0 * self.margin) * self.scale), FINER * width)

    def screen(self, points: Floats) -> Floats:
        """Return column, row and nearness of points in pixels."""
        seen = turned(points, *self.turns)
        seen[:, :2] += self.margin - self.low
        return seen * self.scale

    def mesh(self, points: Floats, faces: Any, colors: Any = GREY, **more: Any) -> Floats:
        """Return the picture of a mesh."""
        if "normals" in more:
            more["normals"] = turned(more["normals"], *self.turns)
        colors = np.broadcast_to(colors, points.shape)
        return shaded(self.screen(points), faces, colors, self.shape, **more)


def save(name: str, images: list[Floats], titles: list[str], colors: int = 48) -> list[str]:
    """Write a row of images with titles, and return what they say, each in a line."""
    rows, columns = (size // FINER for size in images[0].shape[:2])
    inches = (len(images) * columns / 100.0, (rows + 44) / 100.0)
    figure = Figure(figsize=inches, dpi=100)
    for k, (image, title) in enumerate(zip(images, titles, strict=True)):
        share = 1.0 / len(images)
        axes = figure.add_axes((k * share, 0.0, share, rows / (rows + 44)))
        small = image[: rows * FINER].reshape(rows, FINER, columns, FINER, 3).mean(axis=(1, 3))
        axes.imshow(small, origin="lower", aspect="auto", vmin=0, vmax=1)
        axes.axis("off")
        axes.set_title(title, fontsize=10)
    save_small(figure, PICTURES / f"{name}.png", colors)
    return [" ".join(title.split()) for title in titles]


def sizes(result: salcore.Simplification) -> str:
    """Return how many points and faces a result has."""
    faces = "" if result.faces is None else f", {len(result.faces):,} faces"
    return f"{len(result.indices):,} points{faces}"


def places(points: Floats, result: salcore.Simplification) -> Floats:
    """Return where the kept points of a result are."""
    return points[result.indices] if result.positions is None else result.positions


def errors(result: salcore.Simplification) -> str:
    """Return the errors of a result in thousandths of the diagonal."""
    found = result.report.errors
    assert found is not None
    mean, largest = (1000 * x / found.diagonal for x in (found.surface.mean, found.surface.max))
    return f"mean error {mean:.2f} ‰, largest {largest:.1f} ‰"


def statue() -> list[str]:
    """Draw a head, its saliency, and 5 %."""
    it = head()
    analysis = salcore.analyze(it.points, it.faces)
    result = analysis.simplify(ratio=0.05)
    view = View(it.points, -20.0, 6.0)
    images = [
        view.mesh(it.points, it.faces),
        view.mesh(it.points, it.faces, salcore.saliency_colors(analysis.saliency)),
        view.mesh(places(it.points, result), result.faces, edges=True),
    ]
    before = f"{len(it.points):,} points, {len(it.faces):,} faces"
    return save("statue", images, [before, "saliency", f"{sizes(result)}\n{errors(result)}"])


def sculpture() -> list[str]:
    """Draw a rough head as it is, and at equal count with original and with moved points."""
    it = head(rough=0.005)
    view = View(it.points, -20.0, 6.0, 380)
    images = [view.mesh(it.points, it.faces)]
    titles = [f"{len(it.points):,} points"]
    for placement in ("original", "optimal"):
        chosen = salcore.Parameters(placement=placement)
        result = salcore.simplify(it.points, it.faces, parameters=chosen, ratio=0.05)
        images.append(view.mesh(places(it.points, result), result.faces))
        titles.append(f"{placement}: {sizes(result)}\n{errors(result)}")
    return save("sculpture", images, titles)


def cad() -> list[str]:
    """Draw a flange, and what detail and placement make of it at equal numbers of faces."""
    it = flange()
    view = View(it.points[:, [0, 2, 1]] * [1, 1, -1], 28.0, 38.0)
    show = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    images = [view.mesh(it.points @ show.T, it.faces, edges=True)]
    titles, others = [f"{len(it.points):,} points, {len(it.faces):,} faces"], []
    for detail, placement in (
        (3.0, "original"),
        (3.0, "optimal"),
        (0.0, "optimal"),
        (0.0, "original"),
    ):
        chosen = salcore.Parameters(placement=placement, detail=detail)
        result = salcore.simplify(it.points, it.faces, parameters=chosen, faces=len(it.faces) // 8)
        title = f"{placement}, detail {detail:g}: {len(result.faces):,} faces\n{errors(result)}"
        if (detail, placement) in ((3.0, "original"), (0.0, "optimal")):
            images.append(view.mesh(places(it.points, result) @ show.T, result.faces, edges=True))
            titles.append(title)
        else:
            others.append(" ".join(title.split()))
    return save("cad", images, titles) + others


def asset() -> list[str]:
    """Draw a barrel, with faces enough for all its parts and with too few."""
    it = barrel()
    view = View(it.points, 10.0, 16.0, 340)
    layers = it.materials[:, None, None] * np.ones((1, 3, 1))
    analysis = salcore.analyze(it.points, it.faces)
    images, titles = [view.mesh(it.points, it.faces, it.colors, edges=True)], [""]
    for faces, keep in ((1500, False), (300, False), (300, True)):
        result = analysis.simplify(faces=faces, corner_values=layers, keep_topology=keep)
        report = result.report
        titles[0] = f"{report.faces_before:,} faces, {report.parts_before} parts"
        colors = it.colors[result.indices]
        images.append(view.mesh(places(it.points, result), result.faces, colors, edges=True))
        asked = f"--faces {faces}" + (" --keep-topology" if keep else "")
        titles.append(f"{asked}\n{report.faces_after:,} faces, {report.parts_after} parts")
        print(*result.notes, errors(result), sep="\n")
    return save("asset", images, titles, 40)


def atlas() -> list[str]:
    """Draw a textured head, and what seams and transferred normals do."""
    it = head()
    view = View(it.points, -20.0, 6.0, 360)
    uv, texture = unwrapped(it)
    loose, corners = it.points[it.faces].reshape(-1, 3), np.arange(it.faces.size).reshape(-1, 3)
    smooth = salcore.analyze(it.points, it.faces)
    images = [textured(view, loose, corners, uv, texture, smooth.normals[it.faces])]
    charts = len(np.unique(np.floor(uv.mean(axis=1) * np.sqrt(CHARTS)), axis=0))
    titles = [f"{len(it.points):,} points, {charts} charts"]
    for name, seams in (("seams kept, normals transferred", True), ("--no-seams", False)):
        result = smooth.simplify(ratio=0.1, corner_values=uv, keep_seams=seams)
        light = places(it.points, result)[result.faces].reshape(-1, 3)
        order = np.arange(len(light)).reshape(-1, 3)
        kept = uv.reshape(-1, 2)[result.face_corners]
        normals = result.transfer_normals() if seams else None
        images.append(textured(view, light, order, kept, texture, normals))
        titles.append(f"{name}\n{sizes(result)}, {errors(result).split(',')[0]}")
    return save("atlas", images, titles)


def unwrapped(it: Mesh) -> tuple[Floats, Floats]:
    """Return a map in charts (m, 3, 2), as photogrammetry cuts them, and its texture."""
    corners = it.points[it.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    features = np.concatenate([corners.mean(axis=1), 0.3 * normals], axis=1)
    seeds = features[np.random.default_rng(1).choice(len(features), CHARTS, replace=False)]
    chart = np.asarray(cKDTree(seeds).query(features)[1])
    uv = np.zeros((*it.faces.shape, 2))
    side = int(np.ceil(np.sqrt(CHARTS)))
    for k in range(CHARTS):
        mine = chart == k
        middle = normals[mine].mean(axis=0)
        plane = np.linalg.svd(middle[None, :])[2][1:]
        flat = corners[mine] @ plane.T
        low = flat.min(axis=(0, 1))
        size = max((flat.max(axis=(0, 1)) - low).max(), 1e-9)
        uv[mine] = ((flat - low) / size * 0.86 + 0.07 + np.divmod(k, side)) / side
    loose = np.arange(it.faces.size).reshape(-1, 3)
    flat = np.concatenate([uv.reshape(-1, 2) * TEXELS, np.zeros((it.faces.size, 1))], axis=1)
    seen, weights = visible(flat, loose, (TEXELS, TEXELS))
    texture = np.einsum("ijk,ijkd->ijd", weights, it.colors[it.faces[np.maximum(seen, 0)]])
    # Charts are painted beyond their borders, as far as the gap to the next one is wide.
    nearest = distance_transform_edt(seen < 0, return_distances=False, return_indices=True)
    texture = texture[tuple(nearest)]
    grain = gaussian_filter(np.random.default_rng(2).normal(size=(TEXELS, TEXELS)), 1.5)
    return uv, np.clip(texture * (1.0 + 0.5 * grain[..., None]), 0.0, 1.0)


def textured(
    view: View, points: Floats, faces: Any, uv: Floats, texture: Floats, normals: Any
) -> Floats:
    """Return the picture of a mesh of loose faces with a texture."""
    more = {} if normals is None else {"normals": normals.reshape(-1, 3)}
    light = view.mesh(points, faces, np.ones(3), **more)
    seen, weights = visible(view.screen(points), faces, view.shape)
    at = np.einsum("ijk,ijkd->ijd", weights, uv[np.maximum(seen, 0)]) * TEXELS
    column, row = np.clip(at.astype(int), 0, TEXELS - 1).transpose(2, 0, 1)
    return np.where(seen[..., None] >= 0, np.minimum(1.15 * light, 1.0) * texture[row, column], 1.0)


def dots(view: View, points: Floats, colors: Floats, radius: Any, soft: float = 1.0) -> Floats:
    """Return the picture of points as discs, back to front, with their radius in lengths."""
    rows, columns = view.shape
    seen = view.screen(points)
    order = np.argsort(seen[:, 2])
    figure = Figure(figsize=(columns / 100.0, rows / 100.0), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, columns), ylim=(0, rows))
    axes.axis("off")
    size = (2.0 * 0.72 * np.broadcast_to(radius, len(points)) * view.scale) ** 2
    axes.scatter(*seen[order, :2].T, s=size[order], c=colors[order], linewidths=0, alpha=soft)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255.0


def splat() -> list[str]:
    """Draw a head of splats, and three in ten of them, chosen in two ways."""
    it = head(220, 300)
    normals = salcore.analyze(it.points, it.faces).normals
    rng = np.random.default_rng(4)
    points = it.points + rng.normal(0.0, 0.003, it.points.shape)
    view = View(points, -20.0, 6.0, 410)
    light = 0.45 + 0.6 * np.clip(turned(normals, -20.0, 6.0) @ [0.35, 0.45, 0.82], 0.0, 1.0)
    colors = np.clip(it.colors * light[:, None] * rng.normal(1.0, 0.06, light.shape)[:, None], 0, 1)
    radius = 0.018 * rng.lognormal(0.0, 0.3, len(points))
    front = turned(normals, -20.0, 6.0)[:, 2] > -0.2
    images, titles = [], []
    analysis = salcore.analyze(points)
    even = salcore.analyze(points, parameters=salcore.Parameters(evenness=3.0))
    for name, kept in (
        ("", np.arange(len(points))),
        ("--ratio 0.3", analysis.simplify(ratio=0.3).indices),
        ("--ratio 0.3 --evenness 3", even.simplify(ratio=0.3).indices),
    ):
        shown = kept[front[kept]]
        images.append(dots(view, points[shown], colors[shown], radius[shown], 0.9))
        titles.append(f"{name}\n{len(kept):,} splats")
    return save("splat", images, titles, 40)


def room() -> list[str]:
    """Draw a façade, and the fewest points that a bound of a centimetre leaves."""
    it = facade()
    view = View(it.points, -20.0, 10.0)
    images = [view.mesh(it.points, it.faces, it.colors)]
    titles = [f"{len(it.points):,} points, noise of a millimetre"]
    chosen = salcore.Parameters(error_unit="length")
    analysis = salcore.analyze(it.points, it.faces, parameters=chosen)
    closer = analysis.simplify(max_error=0.005)
    result = analysis.simplify(max_error=0.01)
    colors = it.colors[result.indices]
    images.append(view.mesh(places(it.points, result), result.faces, colors, edges=True))
    titles.append(f"10 mm: {sizes(result)}\n{millimetres(result)}")
    return [
        *save("room", images, titles),
        *(f"{bound}: {len(each.indices) / len(it.points):.0%} of the points are left"
          for bound, each in (("5 mm", closer), ("10 mm", result))),
    ]  # fmt: skip


def millimetres(result: salcore.Simplification) -> str:
    """Return the errors of a result in metres as millimetres."""
    found = result.report.errors
    assert found is not None
    mean, largest = 1000 * found.surface.mean, 1000 * found.surface.max
    return f"mean error {mean:.1f} mm, largest {largest:.1f} mm"


DRAWN: dict[str, Callable[[], list[str]]] = {
    "statue": statue,
    "sculpture": sculpture,
    "room": room,
    "cad": cad,
    "asset": asset,
    "atlas": atlas,
    "splat": splat,
}


def main() -> None:
    """Draw the pictures asked for, or all; then their figures are written as well."""
    asked = sys.argv[1:] or list(DRAWN)
    said = [[name, line] for name in asked for line in DRAWN[name]()]
    for name, line in said:
        print(f"{name}: {line}")
    if asked == list(DRAWN):
        title, module = "Which settings for what: what the pictures say", "docs.settings_pictures"
        write(FIGURES / "settings.md", title, module, table(["picture", ""], said), models=False)


if __name__ == "__main__":
    main()
