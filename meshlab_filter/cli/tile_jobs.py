# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs by tiles have in common, whether on scans or on a mesh."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from pathlib import Path

import salcore
from salcore.input.memory import available_memory
from salcore.options import given_options

from ..errors import FileError, Warn
from ..large.job import MANIFEST
from ..large.workers import share_memory
from ..parameters import make_parameters

SHARE = 0.5
"""Share of the free memory that is taken unless --memory says how much."""


def parameters_of(options: argparse.Namespace) -> salcore.Parameters:
    """Return the parameters that the options give."""
    return make_parameters(preset=options.preset, **given_options(options, salcore.TABLE))


def refusal(
    options: argparse.Namespace,
    what: str,
    targets: tuple[str, ...],
    parameters: Iterable[str],
    switches: Iterable[str],
) -> str:
    """Return what cannot be done by tiles and the remedy; nothing if all can.

    Parameters
    ----------
    options : argparse.Namespace
    what : str
        Word for the input.
    targets : tuple of str
        Those that tiles can meet.
    parameters, switches : iterable of str
        Names of parameters and of options that need the whole in memory.
    """
    for name in given_options(options, salcore.TARGETS):
        if name not in targets:
            *most, last = (f"--{target.replace('_', '-')}" for target in targets)
            return (
                f"--{name.replace('_', '-')}: is not worked out by tiles; give "
                f"{', '.join(most)} or {last}"
            )
    values, usual = parameters_of(options).as_dict(), salcore.Parameters().as_dict()
    changed = [name for name in parameters if values[name] != usual[name]]
    changed += [name for name in switches if getattr(options, name)]
    if not changed:
        return ""
    name = changed[0].replace("_", "-")
    return f"--{name}: needs the whole {what} in memory; leave it out, or --tiled and its like"


def work_folder_of(options: argparse.Namespace) -> Path:
    """Return the absolute work folder, which need not be there but for what holds it."""
    output = options.output
    folder: Path = options.resume or options.work_folder or output.with_name(f"{output.name}.work")
    if not options.resume and not (folder / MANIFEST).exists() and not folder.parent.is_dir():
        raise FileError(f"{folder.parent}: no such folder; make it first")
    return folder.absolute()


def share_out(
    options: argparse.Namespace, point: float, halo: float, warn: Warn
) -> tuple[int, int]:
    """Return the number of processes and the points of a tile, and tell them.

    `point` and `halo` are as in `meshlab_filter.large.workers.share_memory`.
    """
    memory = options.memory or SHARE * (available_memory() or 8e9)
    most_workers = parameters_of(options).workers or os.cpu_count() or 1
    workers, most = share_memory(memory, most_workers, point, halo)
    whom = (
        f"Dask at {options.scheduler}"
        if options.scheduler
        else f"{workers} process{'es' * (workers > 1)}"
    )
    warn(f"{options.output}: by tiles of at most {most:,} points, with {whom}")
    return workers, most
