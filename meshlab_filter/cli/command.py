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

import salcore
from salcore.maps import MAPS_BEGIN
from salcore.options import given_options
from salcore.progress import Progress

from ..errors import FileError, Warn, ignore
from ..io import files
from ..io.documents import Document, open_document, open_documents, open_layers
from ..io.headers import PROJECT
from ..io.scans import EACH
from ..io.staging import write_text
from ..io.supervise import FAILURE
from ..parameters import Callback, check_not_empty, make_parameters
from . import demo, tiles
from .constraints import constraints_of, say_unused
from .figures import format_errors, format_report
from .indices import check_indices, write_indices
from .options import make_parser
from .parser import MISTAKE
from .picture import Panel, check_picture, save_picture

INTERRUPTED = 130
"""Exit status after Ctrl-C, by custom 128 plus the signal's number."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit status.

    0 for success, 2 for a mistake of the user, 1 for a failure of the machine such as a full disk,
    130 after Ctrl-C; all but the first with one line on standard error.
    """
    return run(make_parser().parse_args(arguments))


def run(options: argparse.Namespace) -> int:
    """Run what `main` has parsed."""
    try:
        if isinstance(getattr(options, "input", None), list):
            options.input = files.matching(options.input)
        _COMMANDS[options.command](options)
        sys.stdout.flush()
    except salcore.MemoryLimitError as error:
        return _fail(FAILURE, str(error))
    except salcore.SalcoreError as error:
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
        if type(error).__name__ == "PyMeshLabException":  # MeshLab may not have been loaded
            return _fail(MISTAKE, str(error))
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}, line {last.lineno}"
        return _fail(FAILURE, f"a fault of this program, please report it: {error!r} in {where}")
    return 0


def _fail(status: int, message: str) -> int:
    """Print an error and return the exit status."""
    _say(f"error: {message}")
    return status


@contextmanager
def _progress(quiet: bool, left: str = "") -> Iterator[Callback | None]:
    """Show a progress bar with the stage's name, and what else is `left`, on a terminal only."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(
        total=1.0, bar_format=f"{{desc:16}} {{percentage:3.0f}}% {{bar}}{left}", leave=False
    ) as bar:

        def show(stage: str, fraction: float) -> None:
            bar.set_description_str(stage, refresh=False)
            bar.n = fraction
            bar.refresh()

        yield show


def _open(options: argparse.Namespace) -> Document:
    """Check the outputs, then open the input."""
    picture, report = getattr(options, "picture", None), getattr(options, "report", None)
    indices = getattr(options, "indices", None)
    if picture is not None:
        check_picture(picture)
    if indices is not None:
        check_indices(indices)
    files.check_format(options.output)
    _check_outputs([options.output], [report, picture, indices], options)
    return _open_input(options, [options.output])


def _open_input(options: argparse.Namespace, outputs: list[Path]) -> Document:
    """Open the input for writing to these outputs."""
    document = open_documents(
        options.input, options.layer, _warn(options), outputs=outputs, columns=options.columns
    )
    as_points = getattr(options, "points", False) or getattr(options, "alpha", None) is not None
    if document.arrays[1] is not None and not as_points:
        for output in outputs:
            files.check_holds_faces(output)
    return document


def _check_outputs(
    meshes: list[Path], reports: list[Path | None], options: argparse.Namespace
) -> None:
    """Refuse outputs that would overwrite a file or one another."""
    for path in meshes:
        files.check_output(path, options.input, force=options.force)
    given = [path for path in reports if path is not None]
    for path in given:
        _check_report(path, options.input, force=options.force)
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


def _analyze(
    document: Document, options: argparse.Namespace, progress: Callback | None
) -> salcore.Analysis:
    """Analyse a document with the parameters of the command line."""
    values = {"preset": options.preset} | given_options(options, salcore.TABLE)
    return salcore.analyze(*document.arrays, make_parameters(**values), progress=progress)


def _simplify(options: argparse.Namespace) -> None:
    if options.layer == EACH:
        _simplify_each(options)
        return
    if tiles.chosen(options):
        _simplify_tiles(options)
        return
    document = _open(options)
    report, result = _simplify_one(document, options.output, options)
    if options.indices is not None:
        write_indices(options.indices, result)
    if options.report is not None:
        write_text(options.report, json.dumps(report, indent=2))


def _simplify_tiles(options: argparse.Namespace) -> None:
    """Simplify scans that are larger than memory."""
    _check_outputs([options.output], [options.report], options)
    with _progress(options.quiet, " {remaining} left") as progress:
        figures = tiles.simplify(options, progress, _warn(options))
    if not options.quiet:
        print(
            f"  {options.output.name}: {figures['kept_points']:,} of "
            f"{figures['input_points']:,} points"
        )
        if figures.get("errors") is not None:
            print(format_errors(figures["errors"]))


def _simplify_one(
    document: Document, output: Path, options: argparse.Namespace
) -> tuple[dict[str, Any], salcore.Simplification]:
    """Simplify a document into a file, and return the report and the result."""
    target = given_options(options, salcore.TARGETS)
    say_unused(document, options, _warn(options))
    constraints = constraints_of(document, options)
    with _progress(options.quiet) as progress:
        analysis = _analyze(document, options, progress)
        result = analysis.simplify(progress=progress, **target, **constraints)
        check_not_empty(result)
        if not options.no_errors:
            result.measure(progress)
    _write(document, analysis, result, output, options)
    report = result.make_report(errors=not options.no_errors).as_dict()
    if options.points:
        report["faces_after"] = 0
    if not options.quiet:
        print(f"{output.name}:\n{format_report(report)}")
    return report, result


def _simplify_each(options: argparse.Namespace) -> None:
    """Simplify each layer of a file on its own, to a file each."""
    if len(options.input) > 1 or "{}" not in options.output.name or options.indices is not None:
        raise salcore.ParameterError(
            "--layer each: name one input, an output with {} for the layer's number, such as "
            "part_{}.ply, and no --indices"
        )
    files.check_format(options.output)
    path, output = options.input[0], options.output
    documents = open_layers(path, _warn(options), output=output, columns=options.columns)
    names = [output.with_name(output.name.replace("{}", str(k))) for k in range(len(documents))]
    _check_outputs(names, [options.report], options)
    reports = {}
    for name, document in zip(names, documents, strict=True):
        if not options.quiet:
            print(f"layer {document.label}, in")
        reports[name.name], _ = _simplify_one(document, name, options)
    if options.report is not None:
        write_text(options.report, json.dumps(reports, indent=2))


def _write(
    document: Document,
    analysis: salcore.Analysis,
    result: salcore.Simplification,
    output: Path,
    options: argparse.Namespace,
) -> None:
    """Write what a simplification keeps, and say what it gave up."""
    transferred = options.transfer_normals and result.faces is not None and not options.points
    document.write_simplified(
        result,
        output,
        normals=analysis.normals,
        corner_normals=result.transfer_normals() if transferred else None,
        with_faces=not options.points,
        force=options.force,
    )
    for note in result.notes:
        _warn(options)(f"{output}: {note}")


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
    document = _open_input(options, outputs)
    say_unused(document, options, _warn(options))
    constraints = constraints_of(document, options)
    with _progress(options.quiet) as progress:
        analysis = _analyze(document, options, progress)
        levels = [
            analysis.simplify(ratio=ratio, progress=progress, **constraints)
            for ratio in options.ratios
        ]
    for output, result in zip(outputs, levels, strict=True):
        _write(document, analysis, result, output, options)
        if not options.quiet:
            faces = "" if result.faces is None else f", {len(result.faces):,} faces"
            print(f"  {output.name}: {len(result.indices):,} points{faces}")


def _saliency(options: argparse.Namespace) -> None:
    document, analysis = _open_and_analyze(options, regions=False)
    values = analysis.saliency
    shown = (values, "saliency", salcore.saliency_colors(values))
    _write_map(document, options, analysis, "saliency", *shown)


def _regions(options: argparse.Namespace) -> None:
    document, analysis = _open_and_analyze(options, regions=True)
    values = analysis.regions
    shown = (values, "region", salcore.region_colors(values))
    _write_map(document, options, analysis, f"{analysis.segmentation.count:,} regions", *shown)


def _open_and_analyze(
    options: argparse.Namespace, *, regions: bool
) -> tuple[Document, salcore.Analysis]:
    """Return the input and its analysis, with saliency at every scale, and regions if asked for."""
    document = _open(options)
    with _progress(options.quiet) as progress:
        work = Progress(progress)
        analysis = _analyze(document, options, work.portion(0.0, MAPS_BEGIN))
        analysis.prepare(regions=regions, progress=work.portion(MAPS_BEGIN, 1.0))
        return document, analysis


def _write_map(
    document: Document,
    options: argparse.Namespace,
    analysis: salcore.Analysis,
    title: str,
    values: Any,
    name: str,
    colors: Any,
) -> None:
    """Write the input in these colours, and draw the picture if one is asked for."""
    document.write_map(values, name, colors, options.output, force=options.force)
    if not options.quiet:
        print(f"{options.output.name}: {len(values):,} points, {title} as quality and colour")
    if options.picture is not None:
        points, faces, _ = document.arrays
        shape = (points, faces, analysis.normals)
        panels = [Panel(options.input[0].name, *shape), Panel(title, *shape, colors)]
        save_picture(options.picture, [panels], up=options.up)


def _compare(options: argparse.Namespace) -> None:
    if options.report is not None:
        inputs = [options.original, options.simplified]
        _check_report(options.report, inputs, force=options.force)
    surfaces = []
    for of in ("original", "simplified"):
        path, layer = getattr(options, of), getattr(options, f"{of}_layer")
        document = open_document(path, layer, _warn(options), option=f"--{of}-layer")
        surfaces.append(document.surface())
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
    print(
        f"Look at {options.folder / 'demo.png'}; the files beside it open in MeshLab and Blender."
    )


def _say(message: str) -> None:
    """Print one line on standard error, without control characters that a file name may hold."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
    print(f"salient-simplify: {line}", file=sys.stderr)


def _warn(options: argparse.Namespace) -> Warn:
    """Return the function that takes warnings."""
    return ignore if options.quiet else _say


_COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "simplify": _simplify,
    "lods": _lods,
    "saliency": _saliency,
    "regions": _regions,
    "compare": _compare,
    "demo": _demo,
}
