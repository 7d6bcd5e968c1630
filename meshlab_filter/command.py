# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``salient-simplify``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab
from tqdm import tqdm

import salcore

from . import bridge, demo, files, filters
from .picture import Panel, check_picture, saliency_colors, save_picture

FAILURE = 1
MISTAKE = 2
INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit status.

    0 for success, 2 for a user's mistake and 1 for a failure of the machine, such as a full disk
    (one line on standard error), 130 after Ctrl-C.
    """
    options = make_parser().parse_args(arguments)
    try:
        options.run(options)
        sys.stdout.flush()
    except (salcore.SalcoreError, pymeshlab.PyMeshLabException) as error:
        _say(f"error: {error}")
        return MISTAKE
    except BrokenPipeError:
        # The reader of the figures has gone; the files are written. Python would complain at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILURE
    except OSError as error:
        _say(f"error: {error}")
        return FAILURE
    except KeyboardInterrupt:
        _say("interrupted: no partial file was left")
        return INTERRUPTED
    return 0


def make_parser() -> argparse.ArgumentParser:
    """Return the parser; options of the analysis follow from salcore's table."""
    parser = argparse.ArgumentParser(
        prog="salient-simplify",
        description="Simplify point clouds and meshes while keeping what is salient.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {salcore.__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    simplify = _command(commands, "simplify", _simplify, "keep the salient part of a file")
    _add_files(simplify)
    target = simplify.add_argument_group("target (one is required)")
    choice = target.add_mutually_exclusive_group(required=True)
    for row in salcore.TARGETS:
        _add_parameter(choice, row)
    _add_simplification(simplify)
    _add_report(simplify)

    lods = _command(commands, "lods", _lods, "write levels of detail of a file")
    _add_files(lods)
    lods.add_argument("--ratios", type=float, nargs="+", required=True, metavar="R")
    _add_simplification(lods)

    for name, run, what in (
        ("saliency", _saliency, "write a file with saliency as quality and colour"),
        ("regions", _regions, "write a file with regions as quality and colour"),
    ):
        command = _command(commands, name, run, what)
        _add_files(command)
        command.add_argument("--picture", type=Path, metavar="PNG", help="draw the map as well")
        command.add_argument(
            "--up", choices=("y", "z"), default="y", help="upward axis of the picture (default: y)"
        )

    compare = _command(commands, "compare", _compare, "measure the errors between two files")
    compare.add_argument("original", type=Path)
    compare.add_argument("simplified", type=Path)
    _add_report(compare)
    compare.add_argument("--force", action="store_true", help="overwrite an existing report")

    show = _command(commands, "demo", _demo, "analyse and simplify two scans that come along")
    show.add_argument("folder", nargs="?", type=Path, default=Path("salient-simplify-demo"))
    show.add_argument("--quiet", action="store_true", help="show no progress")
    return parser


def _command(
    commands: Any, name: str, run: Callable[[argparse.Namespace], None], what: str
) -> argparse.ArgumentParser:
    command: argparse.ArgumentParser = commands.add_parser(
        name, help=what, description=what[0].upper() + what[1:] + "."
    )
    command.set_defaults(run=run)
    return command


def _add_files(command: argparse.ArgumentParser) -> None:
    """Add input, output and the options of every analysis."""
    command.add_argument("input", type=Path, help="mesh file, or MeshLab project (.mlp)")
    command.add_argument("output", type=Path, help="file to write, of any format MeshLab writes")
    command.add_argument("--layer", metavar="NAME", help="layer of a project, by name or number")
    command.add_argument("--quiet", action="store_true", help="show no progress and no figures")
    command.add_argument("--force", action="store_true", help="overwrite an existing output")
    command.add_argument("--preset", choices=salcore.PRESETS, default="default")
    groups: dict[str, Any] = {}
    for row in salcore.TABLE:
        group = groups.setdefault(row.group, None) or command.add_argument_group(row.group.lower())
        groups[row.group] = group
        _add_parameter(group, row)


def _add_simplification(command: argparse.ArgumentParser) -> None:
    command.add_argument("--points", action="store_true", help="write points, no faces")
    command.add_argument(
        "--protect-selected", action="store_true", help="keep all points selected in the file"
    )
    command.add_argument(
        "--free-seams", action="store_true", help="let faces reach across seams of the texture"
    )


def _add_report(command: argparse.ArgumentParser) -> None:
    command.add_argument("--report", type=Path, metavar="JSON", help="write the figures to a file")


def _add_parameter(group: Any, row: salcore.Parameter) -> None:
    """Add the option of one row; left out, the preset's value holds."""
    text = row.sentence.replace("%", "%%")
    if row.symbol:
        text += f" Paper: {row.symbol}."
    if row.group != "Target":
        text += f" Default: {row.default}."
    option: dict[str, Any] = {"dest": row.name, "help": text, "default": None}
    if row.type is bool:
        option["action"] = argparse.BooleanOptionalAction
    elif row.type is str:
        option["choices"] = row.choices
    else:
        option |= {"type": row.type, "metavar": row.unit.upper() or "N"}
    group.add_argument("--" + row.name.replace("_", "-"), **option)


def _chosen(options: argparse.Namespace, rows: tuple[salcore.Parameter, ...]) -> dict[str, Any]:
    """Return the values that were given on the command line."""
    values = {row.name: getattr(options, row.name) for row in rows}
    return {name: value for name, value in values.items() if value is not None}


@contextmanager
def _progress(quiet: bool) -> Iterator[filters.Callback | None]:
    """Show a progress bar with the stage's name, on a terminal only."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    with tqdm(total=1.0, bar_format="{desc:16} {percentage:3.0f}% {bar}", leave=False) as bar:

        def show(stage: str, fraction: float) -> None:
            bar.set_description_str(stage, refresh=False)
            bar.n = fraction
            bar.refresh()

        yield show


def _open(options: argparse.Namespace) -> Any:
    """Check the outputs, then load the input and choose the layer."""
    picture, report = getattr(options, "picture", None), getattr(options, "report", None)
    if picture is not None:
        check_picture(picture)
    files.check_format(options.output)
    _check_outputs([options.output, report, picture], options)
    mesh_set = files.load(options.input, _say)
    files.choose_layer(mesh_set, options.layer, _say)
    return mesh_set


def _check_outputs(outputs: list[Path | None], options: argparse.Namespace) -> None:
    """Refuse outputs that would overwrite something, or one another."""
    given = [path for path in outputs if path is not None]
    for number, path in enumerate(given):
        files.check_output(path, [options.input], force=options.force)
        if path.absolute() in [other.absolute() for other in given[:number]]:
            raise files.FileError(f"{path}: is to be written twice; name two files")


def _write(mesh_set: Any, options: argparse.Namespace, source: Any) -> None:
    """Write the current layer, made from the layer `source`, or the whole project."""
    mesh = mesh_set.current_mesh()
    if source.face_number():
        # MeshLab's normals of faces are as long as the angles they stand for.
        mesh_set.apply_normal_normalization_per_vertex()
    where = {"force": options.force, "like": source, "source": options.input}
    if options.output.suffix.lower() == files.PROJECT:
        files.save_project(mesh_set, options.output, **where)
        return
    if not np.array_equal(mesh.transform_matrix(), np.eye(4)):
        _say(
            f"{options.output}: holds the layer's own coordinates, as MeshLab's export does; its "
            "matrix is kept in a project only (.mlp)"
        )
    files.save_mesh(mesh_set, options.output, warn=_say, **where)


def _analysis(
    mesh_set: Any, options: argparse.Namespace, progress: filters.Callback | None
) -> salcore.Analysis:
    """Analyse the current layer with the parameters chosen."""
    values = {"preset": options.preset} | _chosen(options, salcore.TABLE)
    arrays = bridge.read(mesh_set.current_mesh())
    return salcore.analyze(*arrays, filters.make_parameters(**values), progress=progress)


def _analyze(mesh_set: Any, options: argparse.Namespace) -> tuple[bridge.Arrays, salcore.Analysis]:
    with _progress(options.quiet) as progress:
        analysis = _analysis(mesh_set, options, progress)
    return bridge.read(mesh_set.current_mesh()), analysis


def _simplify(options: argparse.Namespace) -> None:
    mesh_set = _open(options)
    source = mesh_set.current_mesh()
    target = _chosen(options, salcore.TARGETS)
    with _progress(options.quiet) as progress:
        result = _analysis(mesh_set, options, progress).simplify(
            **_wishes(source, options), progress=progress, **target
        )
    if not len(result.indices):
        raise salcore.ParameterError("no point would be kept: give another target")
    name = f"{source.label()} simplified"
    bridge.add_simplified(mesh_set, source, result, name, with_faces=not options.points)
    _write(mesh_set, options, source)
    report = result.report.as_dict()
    if options.report is not None:
        files.write_text(options.report, json.dumps(report, indent=2))
    if not options.quiet:
        print(_figures(report))


def _lods(options: argparse.Namespace) -> None:
    if "{}" not in options.output.name:
        raise salcore.ParameterError(
            f"output={options.output.name!r}: name a pattern with {{}} for the level, "
            "such as light_{}.ply"
        )
    outputs = [
        options.output.with_name(options.output.name.replace("{}", str(level)))
        for level in range(len(options.ratios))
    ]
    _check_outputs([*outputs], options)
    for output in outputs:
        files.check_format(output)
        if output.suffix.lower() == files.PROJECT:
            raise salcore.ParameterError(f"{output}: levels are mesh files; name a mesh format")
    mesh_set = files.load(options.input, _say)
    files.choose_layer(mesh_set, options.layer, _say)
    source = mesh_set.current_mesh()
    wishes = _wishes(source, options)
    with _progress(options.quiet) as progress:
        analysis = _analysis(mesh_set, options, progress)
        levels = [
            analysis.simplify(ratio=ratio, progress=progress, **wishes) for ratio in options.ratios
        ]
    for output, result in zip(outputs, levels, strict=True):
        bridge.add_simplified(mesh_set, source, result, output.stem, with_faces=not options.points)
        _write(mesh_set, argparse.Namespace(**(vars(options) | {"output": output})), source)
        if not options.quiet:
            faces = "" if result.faces is None else f", {len(result.faces):,} faces"
            print(f"  {output.name}: {len(result.indices):,} points{faces}")


def _wishes(mesh: Any, options: argparse.Namespace) -> dict[str, Any]:
    """Return what must stay: selected points, and the seams of a textured mesh."""
    textured = not (options.points or options.free_seams)
    return {
        "protect": mesh.vertex_selection_array() if options.protect_selected else None,
        "seams": bridge.seams(mesh) if textured else None,
    }


def _saliency(options: argparse.Namespace) -> None:
    mesh_set = _open(options)
    arrays, analysis = _analyze(mesh_set, options)
    colors = saliency_colors(analysis.saliency)
    bridge.set_scalar(mesh_set, analysis.saliency, "saliency")
    bridge.set_colors(mesh_set, colors)
    _write(mesh_set, options, mesh_set.current_mesh())
    _draw(options, arrays, analysis, "saliency", colors)


def _regions(options: argparse.Namespace) -> None:
    mesh_set = _open(options)
    arrays, analysis = _analyze(mesh_set, options)
    colors = filters.region_colors(analysis.regions)
    bridge.set_scalar(mesh_set, analysis.regions, "region")
    bridge.set_colors(mesh_set, colors)
    _write(mesh_set, options, mesh_set.current_mesh())
    _draw(options, arrays, analysis, f"{analysis.segmentation.count:,} regions", colors)


def _draw(
    options: argparse.Namespace,
    arrays: bridge.Arrays,
    analysis: salcore.Analysis,
    title: str,
    colors: Any,
) -> None:
    if options.picture is None:
        return
    shape = (arrays.points, arrays.faces, analysis.normals)
    row = [Panel(options.input.name, *shape), Panel(title, *shape, colors)]
    save_picture(options.picture, [row], up=options.up)


def _compare(options: argparse.Namespace) -> None:
    if options.report is not None:
        files.check_output(options.report, [], force=options.force)
    surfaces = []
    for path in (options.original, options.simplified):
        mesh_set = files.load(path, _say)  # its meshes are gone with it
        surfaces.append(bridge.surface(mesh_set.current_mesh()))
    errors = salcore.compare(*surfaces).as_dict()
    if options.report is not None:
        files.write_text(options.report, json.dumps(errors, indent=2))
    print(_error_figures(errors))


def _demo(options: argparse.Namespace) -> None:
    with _progress(options.quiet) as progress:
        reports = demo.run(options.folder, progress)
    for name, report in reports.items():
        print(f"{name}:\n{_figures(report)}")
    print(f"Look at {options.folder / 'demo.png'}; the files beside it open in MeshLab.")


def _figures(report: dict[str, Any]) -> str:
    """Return the report for people."""
    lines = [
        f"  points   {report['points_before']:,} -> {report['points_after']:,} "
        f"({report['rate']:.1%} less)",
        *[f"  faces    {report['faces_before']:,} -> {report['faces_after']:,}"]
        * bool(report["faces_after"]),
        _error_figures(report["errors"]),
        f"  seconds  {report['seconds_analysis']:.2f} analysis, "
        f"{report['seconds_selection']:.2f} selection",
    ]
    if report["dropped"]:
        lines.insert(1, f"  dropped  {report['dropped']:,} points that are not finite")
    return "\n".join(lines)


def _error_figures(errors: dict[str, Any]) -> str:
    """Return the errors for people: in the file's unit, and in per cent of the diagonal."""
    share = 100.0 / errors["diagonal"] if errors["diagonal"] else 0.0
    names = {
        "point": "to the nearest point",
        "surface": "to the surface",
        "point_back": "back to the nearest point",
        "surface_back": "back to the surface",
    }
    return "\n".join(
        f"  error    {errors[key]['max']:.4g} max ({errors[key]['max'] * share:.3f} %), "
        f"{errors[key]['mean']:.4g} mean ({errors[key]['mean'] * share:.3f} %) {name}"
        for key, name in names.items()
        if "back" not in key or errors[key]["max"] > 0.0
    )


def _say(message: str) -> None:
    """Print one line on standard error."""
    print(f"salient-simplify: {' '.join(message.split())}", file=sys.stderr)
