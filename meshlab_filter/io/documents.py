# SPDX-License-Identifier: GPL-3.0-or-later
"""One face for the inputs of the command: layers read here, and layers that MeshLab reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import salcore

from ..errors import FileError, Warn, ignore
from . import formats, las
from .files import check_input, load_meshlab
from .layer import Floats, Layer
from .scans import ALL, merge
from .wedges import corner_layers
from .write import write_layer


class Document(Protocol):
    """What the command works on: one layer of a file."""

    label: str

    @property
    def arrays(self) -> tuple[Floats, NDArray[Any] | None, Floats | None]:
        """Points, faces and normals in the layer's own coordinates."""

    @property
    def selected(self) -> NDArray[np.bool_]:
        """Which points are selected."""

    def corner_layers(self) -> dict[str, Any]:
        """Return what tells charts apart, as arguments of `salcore.Analysis.simplify`."""

    def surface(self) -> salcore.Surface:
        """Return the surface where the scene has it, for `salcore.compare`."""

    def write_simplified(
        self,
        result: salcore.Simplification,
        output: Path,
        *,
        normals: Floats,
        corner_normals: Floats | None = None,
        with_faces: bool,
        force: bool,
    ) -> None:
        """Write what a simplification keeps; a mesh that becomes points gets these normals."""

    def write_map(
        self, values: NDArray[Any], name: str, colors: Floats, output: Path, *, force: bool
    ) -> None:
        """Write the layer with values as its quality, and colours."""


def open_documents(
    paths: list[Path],
    layer: str | None,
    warn: Warn,
    *,
    outputs: list[Path],
    columns: str | None = None,
) -> Document:
    """Open one file, or several as one; for the parameters see `open_document`.

    Raises
    ------
    FileError
        If a file cannot be read, or is of a format that is not read together with others.
    """
    if len(paths) == 1:
        return open_document(paths[0], layer, warn, outputs=outputs, columns=columns)
    for output in outputs:
        if formats.writer(output) is None:
            raise FileError(f"{output}: several files are written as one such as .ply or .obj")
    layers = []
    for path in paths:
        document = open_document(path, layer, warn, columns=columns)
        if not isinstance(document, LayerDocument):
            known = ", ".join(sorted(formats.READERS))
            raise FileError(f"{path}: files that are taken as one are of {known}")
        layers.append(document.layer)
    whole = merge(layers, paths[0].stem)
    if all(path.suffix.lower() in (".las", ".laz") for path in paths):
        whole = las.join(layers, whole)
    return LayerDocument(paths[0], whole, warn)


def open_document(
    path: Path,
    layer: str | None,
    warn: Warn,
    *,
    outputs: list[Path] | None = None,
    option: str = "--layer",
    columns: str | None = None,
) -> Document:
    """Open a layer of a file, for writing to formats that `outputs` name.

    Parameters
    ----------
    path : Path
    layer : str, optional
        Name or number; by default the first, or the current one of a project.
    warn : callable
        Called with a sentence for whatever is not as in the file.
    outputs : list of Path, optional
    option : str
        The command's option that chooses the layer, for messages.
    columns : str, optional
        Names of the columns of a text file.

    Raises
    ------
    FileError
        If the file cannot be read, or has no such layer.
    """
    check_input(path)
    if formats.is_hopeless(path):
        raise FileError(f"{path}: {formats.unknown(path)}")
    module = formats.reader(path)
    text = path.suffix.lower() in formats.TEXT
    if columns is not None and not text:
        raise FileError(f"--columns: is for text such as .xyz and .csv; leave it out for {path}")
    foreign = not all(formats.writer(output) for output in outputs or [])
    if module is None or (foreign and path.suffix.lower() in formats.MESHES):
        loaded: Document = _mesh_document(path).load(path, layer, warn, option)
        return loaded
    said: list[str] = []  # where a file is refused, that alone is said
    options = {"columns": columns} if text else {}
    layers = module.read(path, said.append, **options)
    document = LayerDocument(path, choose(layers, layer, path, said.append, option), warn)
    for message in said:
        warn(message)
    if foreign:
        made: Document = _mesh_document(path).from_layer(path, document.layer, warn)
        return made
    return document


def _mesh_document(path: Path) -> Any:
    """Return the class of documents that need MeshLab; raise a `FileError` without it."""
    load_meshlab(path)
    from .mesh_document import MeshDocument

    return MeshDocument


def choose(layers: list[Layer], name: str | None, path: Path, warn: Warn, option: str) -> Layer:
    """Return the layer of a name or number; without one all of them as one cloud."""
    if name in (None, ALL):
        if len(layers) > 1:
            if all(layer.faces is None for layer in layers):
                what = f"{len(layers)} scans were merged, with a column that numbers them"
            else:
                what = f"{len(layers)} parts were merged, each as a group, with one budget for all"
            warn(f"{path}: its {what}; choose one with {option}")
        return merge(layers, path.stem)
    for number, layer in enumerate(layers):
        if name in (layer.label, str(number)):
            return layer
    listed = ", ".join(f"{number} ({layer.label})" for number, layer in enumerate(layers))
    raise FileError(
        f"layer {name!r}: there is none of that name or number in {path}; it has {listed}"
    )


def open_layers(
    path: Path, warn: Warn, *, output: Path, columns: str | None = None
) -> list[Document]:
    """Open each layer of a file on its own; for the parameters see `open_document`."""
    check_input(path)
    module = formats.reader(path)
    if module is None or formats.writer(output) is None:
        documents: list[Document] = _mesh_document(path).load_each(path, warn)
        return documents
    options = {"columns": columns} if columns is not None else {}
    return [LayerDocument(path, layer, warn) for layer in module.read(path, warn, **options)]


class LayerDocument:
    """A layer that was read without MeshLab."""

    def __init__(self, path: Path, layer: Layer, warn: Warn = ignore) -> None:
        if not len(layer.points):
            raise FileError(f"{path}: holds no points; it may be damaged or of another format")
        invalid = np.count_nonzero(~np.isfinite(layer.points).all(axis=1))
        if invalid == len(layer.points):
            raise FileError(
                f"{path}: all coordinates are NaN or infinite; export it again, or name another "
                "file"
            )
        if invalid:
            warn(
                f"{path}: {invalid} of {len(layer.points)} points have no valid coordinates and "
                "take no part"
            )
        self.path, self.layer, self.warn = path, layer, warn
        self.label = layer.label

    @property
    def arrays(self) -> tuple[Floats, NDArray[Any] | None, Floats | None]:
        """Points, faces and normals in the layer's own coordinates."""
        return self.layer.points, self.layer.faces, self.layer.normals

    @property
    def selected(self) -> NDArray[np.bool_]:
        """Which points are selected."""
        return self.layer.selected

    def corner_layers(self) -> dict[str, Any]:
        """Return what tells charts apart."""
        return corner_layers(self.layer)

    def surface(self) -> salcore.Surface:
        """Return the surface."""
        return salcore.make_surface(self.layer.points, self.layer.faces)

    def write_simplified(
        self,
        result: salcore.Simplification,
        output: Path,
        *,
        normals: Floats,
        corner_normals: Floats | None = None,
        with_faces: bool,
        force: bool,
    ) -> None:
        """Write what a simplification keeps; a mesh that becomes points gets these normals."""
        layer = self.layer
        if layer.faces is not None and (result.faces is None or not with_faces):
            layer = layer.without_faces(normals)
        light = layer.simplified(result)
        if corner_normals is not None:
            light = light.with_corner_normals(corner_normals)
        write_layer(light, output, source=self.path, force=force, warn=self.warn)

    def write_map(
        self, values: NDArray[Any], name: str, colors: Floats, output: Path, *, force: bool
    ) -> None:
        """Write the layer with values as its quality, and colours."""
        layer = self.layer.mapped(values, colors)
        write_layer(layer, output, source=self.path, force=force, warn=self.warn)
