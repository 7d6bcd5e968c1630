# SPDX-License-Identifier: GPL-3.0-or-later
"""Run a subcommand of ``salient-simplify`` and return the exit status."""

from __future__ import annotations

import argparse
import json
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab
from tqdm import tqdm

import salcore
from salcore.options import given_options

from .. import bridge, filters
from ..errors import FileError
from ..io import files
from ..io.headers import PROJECT
from ..io.projects import save_project
from ..io.save import save_mesh
from ..io.staging import write_text
from ..io.supervise import FAILURE
from . import demo
from .figures import format_errors, format_report
from .options import MISTAKE, make_parser
from .picture import Panel, check_picture, save_picture

INTERRUPTED = 130
"""Exit status after Ctrl-C, by custom 128 plus the signal's number."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit status.

    0 for success, 2 for a mistake of the user, 1 for a failure of the machine such as a full disk,
    130 after Ctrl-C; all but the first with one line on standard error.
    """
    options = make_parser(_COMMANDS).parse_args(arguments)
    try:
        options.run(options)
        sys.stdout.flush()
    except salcore.MemoryLimitError as error:
        return _fail(FAILURE, str(error))
    except (salcore.SalcoreError, pymeshlab.PyMeshLabException) as error:
        return _fail(MISTAKE, str(error))
    except BrokenPipeError:
        # The files are written, but nobody reads the figures. Python would complain at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILURE
    except OSError as error:
        name = "" if error.filename is None else f"{error.filename}: "
        return _fail(FAILURE, f"{name}{error.strerror}" if error.strerror else str(error))
    except MemoryError:
        return _fail(FAILURE, "there is not enough memory for this file")
    except KeyboardInterrupt:
        _say("interrupted: no partial file was left")
        return INTERRUPTED
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}, line {last.lineno}"
        return _fail(FAILURE, f"a fault of this program, please report it: {error!r} in {where}")
    return 0


def _fail(status: int, message: str) -> int:
    """Print an error and return the exit status."""
    _say(f"error: {message}")
    return status


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
    _check_outputs([options.output], [report, picture], options)
    return _load(options.input, options.layer, options)


def _load(path: Path, layer: str | None, options: argparse.Namespace, of: str = "") -> Any:
    """Load a file and choose the layer, which the option ``--{of}layer`` names."""
    mesh_set = files.load(path, _warn(options))
    files.choose_layer(mesh_set, layer, _warn(options), f"--{of}layer")
    return mesh_set


def _check_outputs(
    meshes: list[Path], reports: list[Path | None], options: argparse.Namespace
) -> None:
    """Refuse outputs that would overwrite a file or one another."""
    for path in meshes:
        files.check_output(path, [options.input], force=options.force)
    given = [path for path in reports if path is not None]
    for path in given:
        _check_report(path, [options.input], force=options.force)
    seen: set[Path] = set()
    for path in (*meshes, *given):
        if path.absolute() in seen:
            raise FileError(f"{path}: is to be written twice; name two files")
        seen.add(path.absolute())


def _check_report(path: Path, inputs: list[Path], *, force: bool) -> None:
    """Refuse a report that would replace an input, even with ``--force``."""
    files.check_output(path, inputs, force=force)
    if path.exists() and any(path.samefile(other) for other in inputs if other.exists()):
        raise FileError(f"{path}: is an input; name another file")


def _write(mesh_set: Any, output: Path, source: Any, options: argparse.Namespace) -> None:
    """Write the current layer, which was made from the layer `source`, or the whole project."""
    warn = _warn(options)
    mesh = mesh_set.current_mesh()
    if source.face_number():
        # MeshLab weights a vertex normal by the angles of its faces and does not normalize it.
        mesh_set.apply_normal_normalization_per_vertex()
    if mesh is not source and mesh.face_number() and source.texture_number() > 1:
        warn(
            f"{output}: its {source.texture_number()} textures are left out, for only one can be "
            "carried over; their coordinates stay"
        )
    origin = {"reference": source, "source": options.input}
    if output.suffix.lower() == PROJECT:
        save_project(mesh_set, output, force=options.force, **origin)
        return
    if not np.array_equal(mesh.transform_matrix(), np.eye(4)):
        warn(
            f"{output}: holds the layer's own coordinates, as MeshLab's export does; its matrix is "
            "kept in a project only (.mlp)"
        )
    save_mesh(mesh_set, output, force=options.force, warn=warn, **origin)


def _analyze(
    mesh_set: Any, options: argparse.Namespace, progress: filters.Callback | None
) -> salcore.Analysis:
    """Analyse the current layer with the parameters of the command line."""
    values = {"preset": options.preset} | given_options(options, salcore.TABLE)
    arrays = bridge.read(mesh_set.current_mesh())
    return salcore.analyze(*arrays, filters.make_parameters(**values), progress=progress)


def _simplify(options: argparse.Namespace) -> None:
    mesh_set = _open(options)
    source = mesh_set.current_mesh()
    target = given_options(options, salcore.TARGETS)
    constraints = _constraints(source, options)
    with _progress(options.quiet) as progress:
        analysis = _analyze(mesh_set, options, progress)
        result = analysis.simplify(progress=progress, **target, **constraints)
        filters.check_not_empty(result)
        result.measure(progress)
    name = f"{source.label()} simplified"
    bridge.add_simplified(mesh_set, source, result, name, with_faces=not options.points)
    _write(mesh_set, options.output, source, options)
    report = result.report.as_dict()
    if options.report is not None:
        write_text(options.report, json.dumps(report, indent=2))
    if not options.quiet:
        print(format_report(report))


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
    _check_outputs(outputs, [], options)
    for output in outputs:
        files.check_format(output)
        if output.suffix.lower() == PROJECT:
            raise salcore.ParameterError(f"{output}: levels are mesh files; name a mesh format")
    mesh_set = _load(options.input, options.layer, options)
    source = mesh_set.current_mesh()
    constraints = _constraints(source, options)
    with _progress(options.quiet) as progress:
        analysis = _analyze(mesh_set, options, progress)
        levels = [
            analysis.simplify(ratio=ratio, progress=progress, **constraints)
            for ratio in options.ratios
        ]
    for output, result in zip(outputs, levels, strict=True):
        bridge.add_simplified(mesh_set, source, result, output.stem, with_faces=not options.points)
        _write(mesh_set, output, source, options)
        if not options.quiet:
            faces = "" if result.faces is None else f", {len(result.faces):,} faces"
            print(f"  {output.name}: {len(result.indices):,} points{faces}")


def _constraints(mesh: Any, options: argparse.Namespace) -> dict[str, Any]:
    """Return the constraints on a simplification: selected points, and seams of the texture."""
    textured = not (options.points or options.free_seams)
    return {
        "protect": mesh.vertex_selection_array() if options.protect_selected else None,
        "seams": bridge.read_seams(mesh) if textured else None,
    }


def _saliency(options: argparse.Namespace) -> None:
    mesh_set, analysis = _open_and_analyze(options)
    colors = salcore.saliency_colors(analysis.saliency)
    bridge.set_scalar(mesh_set, analysis.saliency, "saliency")
    _write_map(mesh_set, options, analysis, "saliency", colors)


def _regions(options: argparse.Namespace) -> None:
    mesh_set, analysis = _open_and_analyze(options)
    colors = salcore.region_colors(analysis.regions)
    bridge.set_scalar(mesh_set, analysis.regions, "region")
    _write_map(mesh_set, options, analysis, f"{analysis.segmentation.count:,} regions", colors)


def _open_and_analyze(options: argparse.Namespace) -> tuple[Any, salcore.Analysis]:
    """Return the layers of the input, and the analysis of the current one."""
    mesh_set = _open(options)
    with _progress(options.quiet) as progress:
        return mesh_set, _analyze(mesh_set, options, progress)


def _write_map(
    mesh_set: Any, options: argparse.Namespace, analysis: salcore.Analysis, title: str, colors: Any
) -> None:
    """Write the current layer in these colours, and draw the picture if one is asked for."""
    bridge.set_colors(mesh_set, colors)
    _write(mesh_set, options.output, mesh_set.current_mesh(), options)
    if options.picture is not None:
        points, faces, _ = bridge.read(mesh_set.current_mesh())
        shape = (points, faces, analysis.normals)
        panels = [Panel(options.input.name, *shape), Panel(title, *shape, colors)]
        save_picture(options.picture, [panels], up=options.up)


def _compare(options: argparse.Namespace) -> None:
    if options.report is not None:
        inputs = [options.original, options.simplified]
        _check_report(options.report, inputs, force=options.force)
    surfaces = []
    for of in ("original", "simplified"):
        layer = getattr(options, f"{of}_layer")
        mesh_set = _load(getattr(options, of), layer, options, f"{of}-")
        surfaces.append(bridge.read_surface(mesh_set.current_mesh()))
    with _progress(options.quiet) as progress:
        errors = salcore.compare(*surfaces, progress=progress).as_dict()
    if options.report is not None:
        write_text(options.report, json.dumps(errors, indent=2))
    if not options.quiet:
        print(format_errors(errors))


def _demo(options: argparse.Namespace) -> None:
    with _progress(options.quiet) as progress:
        reports = demo.run(options.folder, progress)
    for name, report in reports.items():
        print(f"{name}:\n{format_report(report)}")
    print(f"Look at {options.folder / 'demo.png'}; the files beside it open in MeshLab.")


def _say(message: str) -> None:
    """Print one line on standard error, without control characters that a file name may hold."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
    print(f"salient-simplify: {line}", file=sys.stderr)


def _warn(options: argparse.Namespace) -> files.Warn:
    """Return the function that takes warnings."""
    return files.ignore if options.quiet else _say


_COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "simplify": _simplify,
    "lods": _lods,
    "saliency": _saliency,
    "regions": _regions,
    "compare": _compare,
    "demo": _demo,
}
