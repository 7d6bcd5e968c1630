# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``salient-simplify``."""

from __future__ import annotations

import argparse
import json
import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab
from tqdm import tqdm

import salcore

from . import bridge, demo, files, filters
from .errors import FileError
from .figures import error_figures, figures
from .headers import PROJECT
from .options import MISTAKE, chosen, make_parser
from .picture import Panel, check_picture, save_picture
from .projects import save_project
from .saving import save_mesh
from .staging import write_text
from .watch import FAILURE

INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit status.

    0 for success, 2 for a user's mistake and 1 for a failure of the machine, such as a full disk
    (one line on standard error), 130 after Ctrl-C.
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
        # The reader of the figures has gone; the files are written. Python would complain at exit.
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
    _check_outputs([options.output, report, picture], options)
    return _load(options.input, options.layer, options)


def _load(path: Path, layer: str | None, options: argparse.Namespace, of: str = "") -> Any:
    """Load a file and choose the layer; `of` says in the option's name of which file it is."""
    mesh_set = files.load(path, _warn(options))
    files.choose_layer(mesh_set, layer, _warn(options), f"--{of}layer")
    return mesh_set


def _check_outputs(outputs: list[Path | None], options: argparse.Namespace) -> None:
    """Refuse outputs that would overwrite something, or one another."""
    given = [path for path in outputs if path is not None]
    for number, path in enumerate(given):
        files.check_output(path, [options.input], force=options.force)
        if path.absolute() in [other.absolute() for other in given[:number]]:
            raise FileError(f"{path}: is to be written twice; name two files")
    for path in given[1:]:
        _check_report(path, [options.input], force=options.force)


def _check_report(path: Path, inputs: list[Path], *, force: bool) -> None:
    """Refuse a report in the place of an input, even by force."""
    files.check_output(path, inputs, force=force)
    if path.exists() and any(path.samefile(other) for other in inputs if other.exists()):
        raise FileError(f"{path}: is an input; name another file")


def _write(mesh_set: Any, options: argparse.Namespace, source: Any) -> None:
    """Write the current layer, made from the layer `source`, or the whole project."""
    mesh = mesh_set.current_mesh()
    if source.face_number():
        # MeshLab's normals of faces are as long as the angles they stand for.
        mesh_set.apply_normal_normalization_per_vertex()
    if mesh is not source and mesh.face_number() and source.texture_number() > 1:
        _warn(options)(
            f"{options.output}: its {source.texture_number()} textures are left out, for only one "
            "can be carried over; their coordinates stay"
        )
    where = {"force": options.force, "like": source, "source": options.input}
    if options.output.suffix.lower() == PROJECT:
        save_project(mesh_set, options.output, **where)
        return
    if not np.array_equal(mesh.transform_matrix(), np.eye(4)):
        _warn(options)(
            f"{options.output}: holds the layer's own coordinates, as MeshLab's export does; its "
            "matrix is kept in a project only (.mlp)"
        )
    save_mesh(mesh_set, options.output, warn=_warn(options), **where)


def _analysis(
    mesh_set: Any, options: argparse.Namespace, progress: filters.Callback | None
) -> salcore.Analysis:
    """Analyse the current layer with the parameters chosen."""
    values = {"preset": options.preset} | chosen(options, salcore.TABLE)
    arrays = bridge.read(mesh_set.current_mesh())
    return salcore.analyze(*arrays, filters.make_parameters(**values), progress=progress)


def _analyze(mesh_set: Any, options: argparse.Namespace) -> tuple[bridge.Arrays, salcore.Analysis]:
    with _progress(options.quiet) as progress:
        analysis = _analysis(mesh_set, options, progress)
    return bridge.read(mesh_set.current_mesh()), analysis


def _simplify(options: argparse.Namespace) -> None:
    mesh_set = _open(options)
    source = mesh_set.current_mesh()
    target = chosen(options, salcore.TARGETS)
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
        write_text(options.report, json.dumps(report, indent=2))
    if not options.quiet:
        print(figures(report))


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
        if output.suffix.lower() == PROJECT:
            raise salcore.ParameterError(f"{output}: levels are mesh files; name a mesh format")
    mesh_set = _load(options.input, options.layer, options)
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
    colors = salcore.saliency_colors(analysis.saliency)
    bridge.set_scalar(mesh_set, analysis.saliency, "saliency")
    bridge.set_colors(mesh_set, colors)
    _write(mesh_set, options, mesh_set.current_mesh())
    _draw(options, arrays, analysis, "saliency", colors)


def _regions(options: argparse.Namespace) -> None:
    mesh_set = _open(options)
    arrays, analysis = _analyze(mesh_set, options)
    colors = salcore.region_colors(analysis.regions)
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
        inputs = [options.original, options.simplified]
        _check_report(options.report, inputs, force=options.force)
    surfaces = []
    for of in ("original", "simplified"):
        layer = getattr(options, f"{of}_layer")
        mesh_set = _load(getattr(options, of), layer, options, f"{of}-")
        surfaces.append(bridge.surface(mesh_set.current_mesh()))  # the mesh goes with its set
    errors = salcore.compare(*surfaces).as_dict()
    if options.report is not None:
        write_text(options.report, json.dumps(errors, indent=2))
    if not options.quiet:
        print(error_figures(errors))


def _demo(options: argparse.Namespace) -> None:
    with _progress(options.quiet) as progress:
        reports = demo.run(options.folder, progress)
    for name, report in reports.items():
        print(f"{name}:\n{figures(report)}")
    print(f"Look at {options.folder / 'demo.png'}; the files beside it open in MeshLab.")


def _say(message: str) -> None:
    """Print one line on standard error; no file's name gets at the terminal's controls."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
    print(f"salient-simplify: {line}", file=sys.stderr)


def _warn(options: argparse.Namespace) -> files.Warn:
    """Return what takes warnings."""
    return files.silent if options.quiet else _say


_COMMANDS = {
    "simplify": _simplify,
    "lods": _lods,
    "saliency": _saliency,
    "regions": _regions,
    "compare": _compare,
    "demo": _demo,
}
