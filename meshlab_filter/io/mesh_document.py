# SPDX-License-Identifier: GPL-3.0-or-later
"""A layer of a file or project that MeshLab reads, as a document of the command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab
from numpy.typing import NDArray

import salcore

from .. import bridge
from ..errors import Warn, ignore
from . import formats
from .files import choose_layer, load
from .headers import PROJECT
from .layer import RGB, Floats, Layer
from .projects import save_project
from .save import save_mesh
from .scans import ALL
from .write import write_layer


class _Made:
    """A mesh made from a layer; MeshLab gives it colours and quality that the layer may lack."""

    def __init__(self, mesh: Any, layer: Layer) -> None:
        self._mesh, self._columns = mesh, layer.columns

    def __getattr__(self, name: str) -> Any:
        return getattr(self._mesh, name)

    def has_vertex_color(self) -> bool:
        """Return whether the layer has colours."""
        return set(RGB) <= self._columns.keys()

    def has_vertex_scalar(self) -> bool:
        """Return whether the layer has a quality."""
        return "quality" in self._columns


class MeshDocument:
    """The chosen layer of a `pymeshlab.MeshSet`."""

    def __init__(self, path: Path, mesh_set: Any, warn: Warn) -> None:
        self.path, self.mesh_set, self.warn = path, mesh_set, warn
        self.unheld: tuple[str, ...] = ()
        self.source = mesh_set.current_mesh()
        self.reference = self.source
        self.label = self.source.label()

    @classmethod
    def load(cls, path: Path, layer: str | None, warn: Warn, option: str) -> MeshDocument:
        """Load a file or project and choose a layer."""
        mesh_set = load(path, warn)
        if layer == ALL and mesh_set.mesh_number() > 1:
            bridge.merge_layers(mesh_set, path.stem)
        else:
            choose_layer(mesh_set, None if layer == ALL else layer, warn, option)
        return cls(path, mesh_set, warn)

    @classmethod
    def load_each(cls, path: Path, warn: Warn) -> list[MeshDocument]:
        """Load each layer of a file or project on its own."""
        numbers = [mesh.id() for mesh in load(path, warn)]
        return [cls.load(path, str(number), ignore, "--layer") for number in numbers]

    @classmethod
    def from_layer(cls, path: Path, layer: Layer, warn: Warn) -> MeshDocument:
        """Take a layer over that was read without MeshLab, for a format that MeshLab writes."""
        mesh_set = pymeshlab.MeshSet(verbose=False)
        mesh, unheld = bridge.make_mesh(layer)
        mesh_set.add_mesh(mesh, layer.label)
        document = cls(path, mesh_set, warn)
        document.unheld, document.reference = unheld, _Made(document.source, layer)
        return document

    @property
    def arrays(self) -> tuple[Floats, NDArray[Any] | None, Floats | None]:
        """Points, faces and normals in the layer's own coordinates."""
        points, faces, normals = bridge.read(self.source)
        return points, faces, normals

    @property
    def selected(self) -> NDArray[np.bool_]:
        """Which points are selected."""
        return np.asarray(self.source.vertex_selection_array())

    def corner_layers(self) -> dict[str, Any]:
        """Return what tells charts apart."""
        return bridge.corner_layers(self.source)

    def surface(self) -> salcore.Surface:
        """Return the surface with the layer's matrix applied."""
        return bridge.read_surface(self.source)

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
        """Write what a simplification keeps, or the whole project with it as a new layer.

        MeshLab has normals of its own.
        """
        if corner_normals is not None:
            self.warn(f"{output}: normals of the original surface go to .obj and .ply alone")
        name = f"{self.label} simplified"
        bridge.add_simplified(self.mesh_set, self.source, result, name, with_faces=with_faces)
        self._write(output, force)

    def write_map(
        self, values: NDArray[Any], name: str, colors: Floats, output: Path, *, force: bool
    ) -> None:
        """Write the layer, or its project, with values as its quality, and colours."""
        bridge.set_scalar(self.mesh_set, values, name)
        bridge.set_colors(self.mesh_set, colors)
        self.reference = self.source  # which now has both
        self._write(output, force)

    def _write(self, output: Path, force: bool) -> None:
        """Write the current layer, which was made from the source, or the whole project."""
        mesh = self.mesh_set.current_mesh()
        if self.unheld:
            self.warn(
                f"{output}: {output.suffix} files do not keep {', '.join(self.unheld)}; .ply does"
            )
        if self.source.face_number():
            # MeshLab weights a vertex normal by the angles of its faces and does not normalize it.
            self.mesh_set.apply_normal_normalization_per_vertex()
        if mesh is not self.source and mesh.face_number() and self.source.texture_number() > 1:
            self.warn(
                f"{output}: its {self.source.texture_number()} textures are left out, for only one "
                "can be carried over; their coordinates stay"
            )
        if output.suffix.lower() == PROJECT:
            save_project(
                self.mesh_set, output, force=force, reference=self.reference, source=self.path
            )
            return
        if not np.array_equal(mesh.transform_matrix(), np.eye(4)):
            self.warn(
                f"{output}: holds the layer's own coordinates, as MeshLab's export does; its "
                "matrix is kept in a project only (.mlp)"
            )
        module = formats.writer(output)
        if module is not None and not module.FACES:
            layer = bridge.make_layer(mesh, self.reference)
            write_layer(layer, output, source=self.path, force=force, warn=self.warn)
            return
        save_mesh(
            self.mesh_set,
            output,
            force=force,
            reference=self.reference,
            source=self.path,
            warn=self.warn,
        )
