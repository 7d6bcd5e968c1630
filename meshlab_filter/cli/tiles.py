# SPDX-License-Identifier: GPL-3.0-or-later
"""``simplify`` of scans that are larger than memory: by tiles."""

from __future__ import annotations

import argparse
import json
import os
from typing import Any

import salcore
from salcore.input.memory import available_memory
from salcore.options import given_options

from ..errors import FileError, Warn
from ..io import files
from ..io.staging import write_text
from ..large.job import MANIFEST, Job, expected_ratio, look_at
from ..large.run import POINT, share_memory, simplify_tiles
from ..parameters import Callback, make_parameters
from . import mesh_tiles

ENDINGS = (".las", ".laz")
SHARE = 0.5
"""Share of the free memory that is taken unless --memory says how much."""
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
    target = given_options(options, salcore.TARGETS)
    if not target.keys() <= {"ratio", "count", "max_error"}:
        name = next(iter(target)).replace("_", "-")
        return f"--{name}: is not worked out by tiles; give --ratio, --count or --max-error"
    values = make_parameters(
        preset=options.preset, **given_options(options, salcore.TABLE)
    ).as_dict()
    usual = salcore.Parameters().as_dict()
    changed = [k for k in ELSEWHERE if values[k] != usual[k]]
    changed += [k for k in IN_MEMORY if getattr(options, k)]
    if not changed:
        return ""
    name = changed[0].replace("_", "-")
    return f"--{name}: needs the whole cloud in memory; leave it out, or --tiled and its like"


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
    parameters = make_parameters(preset=options.preset, **given_options(options, salcore.TABLE))
    points = sum(source.points for source in sources)
    if name == "count" and value > points:
        raise salcore.ParameterError(
            f"count={value}: there are {points} valid points; give at most so many"
        )
    ratio = expected_ratio(name, value, points)
    memory = options.memory or SHARE * (available_memory() or 8e9)
    workers, most = share_memory(memory, parameters.workers or os.cpu_count() or 1, ratio)
    folder = options.resume or options.work_folder or output.with_name(f"{output.name}.work")
    common = parameters.as_dict() | {"workers": 1}
    job = Job(
        str(folder.absolute()), sources, common, name, float(value), most, not options.no_errors
    )
    if not options.resume and not (folder / MANIFEST).exists() and not folder.parent.is_dir():
        raise FileError(f"{folder.parent}: no such folder; make it first")
    whom = (
        f"Dask at {options.scheduler}"
        if options.scheduler
        else f"{workers} process{'es' * (workers > 1)}"
    )
    warn(f"{output}: by tiles of at most {most:,} points, with {whom}")
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
