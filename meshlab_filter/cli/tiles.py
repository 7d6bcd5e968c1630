# SPDX-License-Identifier: GPL-3.0-or-later
"""``simplify`` of scans that are larger than memory: by tiles."""

from __future__ import annotations

import argparse
import json
from typing import Any

import salcore
from salcore.input.memory import available_memory
from salcore.options import given_options
from salcore.tiles.plan import halo_width

from ..errors import FileError, Warn
from ..io import files
from ..io.staging import write_text
from ..large.job import Job, expected_ratio, look_at
from ..large.run import POINT, simplify_tiles
from ..parameters import Callback
from . import mesh_tiles
from .tile_jobs import parameters_of, refusal, share_out, work_folder_of

ENDINGS = (".las", ".laz")
TARGETS = ("ratio", "count", "max_error")
IN_MEMORY = (
    "indices", "layer", "columns", "protect_selected", "keep_border", "keep_topology", "symmetry",
)  # fmt: skip
"""Options that need the whole cloud."""
ELSEWHERE = (
    "regions_of_interest",
    "keep_regions",
    "interest_weight",
    "placement",
    "scaling",
    "contrast",
)
"""Parameters that need the whole cloud."""


def chosen(options: argparse.Namespace) -> bool:
    """Return whether a simplification is to be done by tiles.

    Raises
    ------
    ParameterError
        If that is asked for of files that are neither LAS files nor a mesh as a PLY file.
    """
    asked = options.tiled or options.scheduler or options.resume or options.work_folder
    asked = asked or options.tiles
    scans = all(path.suffix.lower() in ENDINGS for path in options.input)
    if options.tiles and not scans:
        raise salcore.ParameterError(
            "--tiles: only .las and .laz files are written as tiles; leave it out"
        )
    if not scans:
        return mesh_tiles.chosen(options, bool(asked))
    if asked:
        return True
    if options.output.suffix.lower() not in ENDINGS or _wrong(options):
        return False  # in memory, where it is checked
    for path in options.input:
        files.check_input(path)
    points = sum(source.points for source in look_at(options.input))
    limit = options.memory or available_memory()
    return limit is not None and points * POINT > limit


def _wrong(options: argparse.Namespace) -> str:
    """Return what cannot be done by tiles and the remedy; nothing if all can."""
    return refusal(options, "cloud", TARGETS, ELSEWHERE, IN_MEMORY)


def simplify(options: argparse.Namespace, progress: Callback | None, warn: Warn) -> dict[str, Any]:
    """Simplify scans, or a mesh, tile by tile into one file, and return the figures."""
    if options.input[0].suffix.lower() not in ENDINGS:
        return mesh_tiles.simplify(options, progress, warn)
    wrong = _wrong(options)
    if wrong:
        raise salcore.ParameterError(wrong)
    output = options.output
    if output.suffix.lower() not in ENDINGS:
        raise FileError(f"{output}: tiles are written as .laz or .las; name such a file")
    for path in options.input:
        files.check_input(path)
    sources = look_at(options.input)
    ((name, value),) = given_options(options, salcore.TARGETS).items()
    points = sum(source.points for source in sources)
    if name == "count" and value > points:
        raise salcore.ParameterError(
            f"count={value}: there are {points} valid points; give at most so many"
        )
    folder = work_folder_of(options)
    halo = halo_width(1.0, expected_ratio(name, value, points))
    workers, most = share_out(options, POINT, halo, warn)
    common = parameters_of(options).as_dict() | {"workers": 1}
    job = Job(str(folder), sources, common, name, float(value), most, not options.no_errors)
    figures = simplify_tiles(
        job,
        output,
        workers=workers,
        scheduler=options.scheduler,
        tiles=options.tiles,
        resume=options.resume is not None,
        force=options.force,
        progress=progress,
        warn=warn,
    )
    if options.report is not None:
        write_text(options.report, json.dumps(figures, indent=2))
    return figures
