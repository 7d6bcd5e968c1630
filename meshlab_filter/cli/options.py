# SPDX-License-Identifier: GPL-3.0-or-later
"""Define the options of the command ``salient-simplify``."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

import salcore
from salcore.options import add_option

from .parser import Completion, HelpAll, Parser, ShortHelp

UNITS = {"": 1.0, "K": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}


FILES = "input [input ...] output"
"""How the files are named in a usage."""


def make_parser() -> Parser:
    """Return the parser; the options of an analysis follow from salcore's table.

    The name of the subcommand becomes the option `command`.
    """
    parser = Parser(
        prog="salient-simplify",
        description="Simplify point clouds and meshes while keeping what is salient.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {salcore.__version__}")
    parser.add_argument(
        "--completion",
        action=Completion,
        choices=("bash", "zsh", "tcsh"),
        help="print a shell's completion script",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, what: str, usage: str) -> argparse.ArgumentParser:
        added: argparse.ArgumentParser = commands.add_parser(
            name,
            help=what,
            description=what[0].upper() + what[1:] + ".",
            usage=f"%(prog)s {usage}",
            formatter_class=ShortHelp,
        )
        added.set_defaults(command=name)
        added.add_argument("--help-all", action=HelpAll, nargs=0, help="show all options")
        return added

    simplify = command(
        "simplify",
        "write a light cloud or mesh that keeps the features",
        f"{FILES} (--ratio R | --count N | --faces N | --max-error E) [options]",
    )
    _add_simplify(simplify)

    lods = command(
        "lods", "write levels of detail, one file each", f"{FILES} --ratios R [R ...] [options]"
    )
    _add_files(lods, "file names to write, with {} for the level, such as light_{}.ply")
    lods.add_argument(
        "--ratios",
        type=float,
        nargs="+",
        required=True,
        metavar="R",
        help="shares of the points to keep, one a level, such as 0.5 0.25 0.1",
    )
    _add_simplification(lods)

    for name in ("saliency", "regions"):
        shown = command(
            name,
            f"write the same points with their {name} as quality and colour",
            f"{FILES} [options]",
        )
        _add_files(shown)
        shown.add_argument("--picture", type=Path, metavar="PNG", help="draw the map as well")
        shown.add_argument(
            "--up", choices=("y", "z"), default="y", help="upward axis of the picture (default: y)"
        )

    compare = command(
        "compare",
        "measure how far a light file lies from its original",
        "original simplified [options]",
    )
    _add_compared(compare)

    show = command(
        "demo", "analyse and simplify two scans, and draw what came out", "[folder] [options]"
    )
    show.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=Path("salient-simplify-demo"),
        help="folder for the demo's files (default: salient-simplify-demo)",
    )
    show.add_argument("--quiet", action="store_true", help="show no progress")
    return parser


def _add_simplify(simplify: argparse.ArgumentParser) -> None:
    """Add the target, and what else a simplification to one file takes."""
    target = simplify.add_argument_group("target (one is required)")
    _add_files(simplify)
    choice = target.add_mutually_exclusive_group(required=True)
    for row in salcore.TARGETS:
        add_option(choice, row)
    _add_simplification(simplify)
    simplify.add_argument(
        "--indices",
        type=Path,
        metavar="FILE",
        help="write the kept indices, and what stands for each point, as .npz or .csv",
    )
    simplify.add_argument(
        "--no-errors", action="store_true", help="measure no errors, which takes longest"
    )
    _add_report(simplify)
    _add_tile_options(simplify)


def _add_compared(compare: argparse.ArgumentParser) -> None:
    """Add the two files of a comparison."""
    for name in ("original", "simplified"):
        compare.add_argument(name, type=Path, help="mesh file, or MeshLab project (.mlp)")
        compare.add_argument(
            f"--{name}-layer", metavar="NAME", help=f"layer of {name}, by name or number"
        )
    _add_report(compare)
    compare.add_argument("--quiet", action="store_true", help="show no figures")
    compare.add_argument("--force", action="store_true", help="overwrite an existing report")


def _add_files(
    command: argparse.ArgumentParser, output: str = "file to write; its ending says in which format"
) -> None:
    """Add input, output and the options of an analysis."""
    command.add_argument(
        "input",
        nargs="+",
        help="mesh, cloud, scene or MeshLab project (.mlp); several files, or a pattern such as "
        "'scans/*.laz', are taken as one",
    )
    command.add_argument("output", type=Path, help=output)
    command.add_argument(
        "--layer",
        metavar="NAME",
        help="layer, by name or number; all as one, or each to a file of its own",
    )
    command.add_argument(
        "--columns",
        metavar="NAMES",
        help="columns of a text file, such as x,y,z,r,g,b,intensity; _ leaves one out "
        "(default: recognized)",
    )
    command.add_argument("--quiet", action="store_true", help="show nothing but errors")
    command.add_argument("--force", action="store_true", help="overwrite an existing output")
    command.add_argument(
        "--preset",
        choices=salcore.PRESETS,
        default="default",
        help="values of all parameters below: ours, or those of the paper",
    )
    groups: dict[str, Any] = {}
    for row in salcore.TABLE:
        group = groups.setdefault(row.group, None) or command.add_argument_group(row.group.lower())
        groups[row.group] = group
        add_option(group, row)


def _add_simplification(command: argparse.ArgumentParser) -> None:
    command.add_argument("--points", action="store_true", help="write points, no faces")
    command.add_argument(
        "--protect-selected", action="store_true", help="keep all points selected in the file"
    )
    command.add_argument(
        "--no-seams",
        "--free-seams",
        dest="free_seams",
        action="store_true",
        help="let faces reach across seams of texture, normals, colours and materials",
    )
    command.add_argument(
        "--transfer-normals",
        action="store_true",
        help="write the original surface's normals at the corners of the light mesh",
    )
    command.add_argument(
        "--keep-border",
        action="store_true",
        help="points on open borders neither move nor go, so that tiles still meet",
    )
    command.add_argument(
        "--keep-topology",
        action="store_true",
        help="no part, hole or handle goes; stops at the fewest points with which that is so",
    )
    command.add_argument(
        "--symmetry",
        choices=("x", "y", "z"),
        help="a mesh that is the same on both sides of the plane where this coordinate is 0 stays "
        "so",
    )


def _add_report(command: argparse.ArgumentParser) -> None:
    command.add_argument("--report", type=Path, metavar="JSON", help="write the figures to a file")


def _add_tile_options(command: argparse.ArgumentParser) -> None:
    """Add the options for scans that are larger than memory."""
    group = command.add_argument_group(
        "larger than memory: scans (LAS, LAZ, COPC) and meshes (binary PLY)"
    )
    group.add_argument(
        "--tiled", action="store_true", help="work tile by tile, even if all fits into memory"
    )
    group.add_argument(
        "--memory",
        type=_size,
        metavar="SIZE",
        help="memory of all processes together, such as 8G (default: half of what is free); more "
        "points than fit are worked on in tiles, by --workers processes",
    )
    group.add_argument(
        "--work-folder",
        type=Path,
        metavar="FOLDER",
        help="new folder for intermediate files, about 250 bytes a point (default: OUTPUT.work)",
    )
    group.add_argument(
        "--tiles",
        type=Path,
        metavar="FOLDER",
        help="new folder for the same points as one LAZ file a tile, with an index in JSON",
    )
    group.add_argument(
        "--resume", type=Path, metavar="FOLDER", help="go on with the run in this work folder"
    )
    group.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask scheduler that has the work done, such as tcp://host:8786; local starts one",
    )


def _size(text: str) -> float:
    """Return the bytes that a text such as 8G names."""
    match = re.fullmatch(r"([0-9.]+)\s*([KMGT]?)(?:i?B)?", text.strip(), re.IGNORECASE)
    try:
        return float(match[1]) * UNITS[match[2].upper()]  # type: ignore[index]
    except (TypeError, ValueError) as error:
        raise argparse.ArgumentTypeError(f"{text!r}: give a size such as 8G or 500M") from error
