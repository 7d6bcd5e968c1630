# SPDX-License-Identifier: GPL-3.0-or-later
"""``simplify`` of a mesh that is larger than memory: by tiles."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import salcore
from salcore.input.memory import available_memory
from salcore.options import given_options

from ..errors import FileError, Warn
from ..io import files
from ..io.ply import read_header
from ..io.staging import write_text
from ..large.mesh_job import MeshJob
from ..large.mesh_run import HALO, POINT, simplify_mesh
from ..large.ply_blocks import look_at_mesh
from ..parameters import Callback
from .tile_jobs import parameters_of, refusal, share_out, work_folder_of

ENDING = ".ply"
TARGETS = ("ratio", "count", "faces")
IN_MEMORY = (
    "indices", "layer", "columns", "protect_selected", "points", "transfer_normals", "symmetry",
)  # fmt: skip
"""Options that need the whole mesh."""
ELSEWHERE = (
    "regions_of_interest",
    "keep_regions",
    "interest_weight",
    "attribute_weight",
    "placement",
    "scaling",
    "contrast",
)
"""Parameters that need the whole mesh."""


def chosen(options: argparse.Namespace, asked: bool) -> bool:
    """Return whether a mesh is to be simplified by tiles.

    Raises
    ------
    ParameterError
        If that is `asked` of what is no PLY file.
    FileError
        If --memory says less than the mesh takes, and tiles cannot be made of it.
    """
    path = options.input[0]
    if len(options.input) > 1 or path.suffix.lower() != ENDING:
        if asked:
            raise salcore.ParameterError(
                "--tiled: only .las and .laz files, and a mesh in one .ply file, are worked on "
                "tile by tile; convert the input, or leave out the options for large scans"
            )
        return False
    if asked:
        return True
    if options.output.suffix.lower() != ENDING or _wrong(options):
        return False  # in memory, where it is checked
    files.check_input(path)
    points, faces = _counts(path)
    limit = options.memory or available_memory()
    if not faces or limit is None:
        return False
    if salcore.estimated_memory(points, faces, parameters_of(options)) <= limit:
        return False
    try:
        look_at_mesh(path)
    except FileError:
        if options.memory:
            raise
        return False  # in memory, where it is refused if there is too little
    return True


def _counts(path: Path) -> tuple[int, int]:
    """Return the numbers of points and faces that a PLY file declares."""
    header = read_header(path)
    counts = {e.name: n for e, n in zip(header.elements, header.counts, strict=True)}
    return counts.get("vertex", 0), counts.get("face", 0)


def _wrong(options: argparse.Namespace) -> str:
    """Return what cannot be done by tiles and the remedy; nothing if all can."""
    return refusal(options, "mesh", TARGETS, ELSEWHERE, IN_MEMORY)


def simplify(options: argparse.Namespace, progress: Callback | None, warn: Warn) -> dict[str, Any]:
    """Simplify a mesh tile by tile into a file, and return the figures."""
    wrong, output = _wrong(options), options.output
    if wrong:
        raise salcore.ParameterError(wrong)
    if output.suffix.lower() != ENDING:
        raise FileError(f"{output}: the tiles of a mesh are written as .ply; name such a file")
    files.check_input(options.input[0])
    source, layout = look_at_mesh(options.input[0])
    ((name, value),) = given_options(options, salcore.TARGETS).items()
    folder = work_folder_of(options)
    workers, most = share_out(options, POINT, HALO, warn)
    job = MeshJob(
        str(folder),
        (source,),
        parameters_of(options).as_dict() | {"workers": 1},
        name,
        float(value),
        most,
        layout=layout,
        keep_border=options.keep_border,
        keep_topology=options.keep_topology,
    )
    if layout.dropped:
        warn(
            f"{options.input[0]}: left out, for tiles carry points and faces only: "
            f"{', '.join(layout.dropped)}"
        )
    figures = simplify_mesh(
        job,
        output,
        workers=workers,
        scheduler=options.scheduler,
        resume=options.resume is not None,
        force=options.force,
        progress=progress,
        warn=warn,
    )
    if options.report is not None:
        write_text(options.report, json.dumps(figures, indent=2))
    return figures
