# SPDX-License-Identifier: GPL-3.0-or-later
"""The background command: ``blender -c salient_simplify in.ply out.ply --ratio 0.1``."""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy

from .geometry import results, sources
from .geometry.read import HostError
from .geometry.topology import Reduced
from .salcore import PRESETS, TARGETS, Parameter, Parameters, SalcoreError
from .settings import properties
from .settings.words import sentence
from .worker import requests

NAME = "salient_simplify"
KEEP = {"keep_seams": True, "keep_sharp": True, "keep_border": False, "keep_topology": False}
"""What has to stay, unless options say something else."""
MISTAKE = 2
NO_WEIGHTS = {"protect": "", "importance": "", "importance_factor": 0.0}
FIRST = {"weld": False, "remove_loose": False}
"""What is done before, unless options say something else."""
IMPORTERS: dict[str, tuple[str, dict[str, Any]]] = {
    ".ply": ("wm.ply_import", {}),
    ".obj": ("wm.obj_import", {}),
    ".stl": ("wm.stl_import", {}),
    ".glb": ("import_scene.gltf", {}),
    ".gltf": ("import_scene.gltf", {}),
    ".usd": ("wm.usd_import", {}),
    ".usdc": ("wm.usd_import", {}),
    ".abc": ("wm.alembic_import", {}),
}
EXPORTERS: dict[str, tuple[str, dict[str, Any]]] = {
    ".ply": ("wm.ply_export", {"export_attributes": True}),
    ".obj": ("wm.obj_export", {}),
    ".stl": ("wm.stl_export", {}),
    ".glb": ("export_scene.gltf", {"export_format": "GLB"}),
    ".gltf": ("export_scene.gltf", {"export_format": "GLTF_EMBEDDED"}),
    ".usd": ("wm.usd_export", {}),
    ".usdc": ("wm.usd_export", {}),
    ".abc": ("wm.alembic_export", {}),
}
"""Blender's own readers and writers, with what makes them keep most."""


def main(arguments: list[str]) -> int:
    """Simplify a file into another and return the exit status: 2 for a user's mistake."""
    try:
        options = make_parser().parse_args(arguments)
    except SystemExit as end:
        return int(end.code or 0)
    try:
        print(_simplify(options))  # noqa: T201 - the figures are what the command says
    except (SalcoreError, OSError, RuntimeError) as error:
        print(f"error: {str(error).strip()}")  # noqa: T201
        return MISTAKE
    return 0


def make_parser() -> argparse.ArgumentParser:
    """Return the parser; its options follow from salcore's table."""
    parser = argparse.ArgumentParser(
        prog=f"blender -c {NAME}",
        description="Cut the meshes of a file down to their salient points.",
    )
    parser.add_argument("input", type=Path, help=f"file to read: {' '.join(IMPORTERS)}")
    parser.add_argument("output", type=Path, help=f"file to write: {' '.join(EXPORTERS)}")
    parser.add_argument("--force", action="store_true", help="overwrite an existing output")
    presets = (*PRESETS, *properties.MORE_PRESETS)
    parser.add_argument("--preset", choices=presets, default="default")
    targets = parser.add_mutually_exclusive_group(required=True)
    for row in TARGETS:
        _add(targets, row)
    for name, default in (KEEP | FIRST).items():
        words = properties.input_annotations(set())[name].keywords
        option = f"--{name.replace('_', '-')}"
        text = words["description"].replace("%", "%%")
        parser.add_argument(
            option, action=argparse.BooleanOptionalAction, default=default, help=text
        )
    text = properties.input_annotations(set())["symmetry"].keywords["description"]
    parser.add_argument("--symmetry", choices=("x", "y", "z"), default="none", help=text)
    parser.add_argument(
        "--measure", action=argparse.BooleanOptionalAction, default=True,
        help="measure the errors; on large meshes this takes longer than the rest",
    )  # fmt: skip
    for row in properties.ROWS:
        _add(parser, row)
    return parser


def _add(group: Any, row: Parameter) -> None:
    """Add the option of one row of the table; left out, the preset's value holds."""
    words: dict[str, Any] = {"dest": row.name, "help": sentence(row).replace("%", "%%")}
    if row.type is bool:
        words["action"] = argparse.BooleanOptionalAction
    elif row.type is str:
        words["choices"] = row.choices
    else:
        words["type"] = row.type
    group.add_argument(f"--{row.name.replace('_', '-')}", default=None, **words)


def _simplify(options: argparse.Namespace) -> str:
    """Read, simplify, write; return notes and a line of figures."""
    read, read_options = _format(options.input, IMPORTERS, "input")
    write, write_options = _format(options.output, EXPORTERS, "output")
    if not options.input.is_file():
        raise HostError(f"input={options.input}: is no file; give the file to simplify")
    if options.output.exists() and not options.force:
        raise HostError(f"output={options.output}: exists; choose another name or give --force")
    if not options.output.parent.is_dir():
        raise HostError(f"output={options.output}: its folder does not exist; make it first")
    changes = {
        row.name: getattr(options, row.name)
        for row in properties.ROWS
        if getattr(options, row.name) is not None
    }
    settings = properties.preset(options.preset).as_dict() | changes | {"error_unit": "length"}
    parameters = Parameters(**settings)
    (target,) = (
        {row.name: getattr(options, row.name)}
        for row in TARGETS
        if getattr(options, row.name) is not None
    )
    bpy.ops.wm.read_factory_settings(use_empty=True)
    read(filepath=str(options.input.absolute()), **read_options)
    found = [sources.Source([obj], obj.data) for obj in sources.eligible(bpy.data.objects)]
    if not found:
        raise HostError(f"input={options.input}: holds no mesh and no point cloud")
    before, after = sum(source.count for source in found), 0
    switches = {name: getattr(options, name) for name in KEEP | FIRST}
    kept = SimpleNamespace(**NO_WEIGHTS, **switches, symmetry=options.symmetry.upper())
    answers: list[Any] = []
    notes: list[str] = []
    for k, source in enumerate(found):
        request = {
            "task": "simplify",
            "parameters": parameters.as_dict(),
            "targets": [target],
            "number": k,
            **sources.to_simplify(source, kept),
        }
        answers.append(requests.run(request))
    for source, answer in zip(found, answers, strict=True):
        result = Reduced.from_dict(answer["levels"][0])
        after += len(result.indices)
        notes += [f"note: {source.object.name}: {note}" for note in result.notes]
        results.replace(source, result)
    errors = (
        requests.run({"task": "measure", "numbers": list(range(len(found)))})
        if options.measure
        else []
    )
    _write_whole(options.output, write, write_options)
    text = f"{after} of {before} points"
    if errors:
        text += f", largest error {max(error['max'] for error in errors):.4g}"
    return "\n".join([*notes, text])


def _format(path: Path, known: dict[str, Any], name: str) -> tuple[Any, dict[str, Any]]:
    """Return the operator for a file's ending, and its options."""
    if path.suffix.lower() not in known:
        raise HostError(
            f"{name}={path}: no format has the ending {path.suffix!r}; use {' '.join(known)}"
        )
    operator, options = known[path.suffix.lower()]
    module, function = operator.split(".")
    return getattr(getattr(bpy.ops, module), function), options


def _write_whole(path: Path, write: Any, options: dict[str, Any]) -> None:
    """Write a file under another name first, so that it appears whole or not at all."""
    with tempfile.TemporaryDirectory(dir=path.absolute().parent, prefix=f".{path.stem}-") as folder:
        part = Path(folder) / path.name
        write(filepath=str(part), **options)
        if not part.is_file():
            raise HostError(f"output={path}: Blender wrote nothing; see its messages above")
        for file in sorted(Path(folder).iterdir(), key=lambda file: file == part):
            os.replace(file, path.absolute().parent / file.name)
