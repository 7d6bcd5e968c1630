# SPDX-License-Identifier: GPL-3.0-or-later
"""Check the paths that a user names, and load them."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import FileError, Warn, ignore
from . import formats
from .headers import PROJECT, check_complete, declared_vertices, unread_properties

CHECKER = "dummy.png"
"""What MeshLab calls the image that it puts where one is missing."""


def matching(names: Sequence[str]) -> list[Path]:
    """Return the files that names and patterns stand for, those of a pattern in order.

    Raises
    ------
    FileError
        If nothing matches a pattern.
    """
    paths: list[Path] = []
    for name in names:
        if os.path.lexists(name) or not glob.has_magic(name):
            paths.append(Path(name))
            continue
        found = sorted(glob.glob(name, recursive=True))
        if not found:
            raise FileError(f"{name}: no file matches this pattern")
        paths += map(Path, found)
    return list(dict.fromkeys(paths))


def check_input(path: Path) -> None:
    """Refuse a path that is no readable, whole file.

    Raises
    ------
    FileError
    """
    if not os.path.lexists(path):
        raise FileError(f"{path}: no such file")
    if path.is_symlink() and not path.exists():
        raise FileError(f"{path}: is a link that leads nowhere")
    if path.is_dir():
        raise FileError(f"{path}: is a folder; name a mesh file or a MeshLab project")
    if not path.is_file():
        raise FileError(f"{path}: is no regular file; name a mesh file or a MeshLab project")
    if not os.access(path, os.R_OK):
        raise FileError(f"{path}: cannot be read; check its permissions")
    _check_name(path)
    check_complete(path)


def load_meshlab(path: Path) -> None:
    """Load MeshLab's library, which a file needs.

    Raises
    ------
    FileError
        If it is not installed, or the system lacks what it needs.
    """
    try:
        import pymeshlab  # noqa: F401
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError):
            remedy = "install it with pip install 'salient-simplify[meshlab]'"
        else:
            remedy = (
                f"and it cannot be loaded here ({error}); install the system's OpenGL library, on "
                "Debian and Ubuntu with apt install libgl1 libopengl0"
            )
        raise FileError(
            f"{path}: {path.suffix or 'such'} files need MeshLab's library; {remedy}. Without it "
            f"there are {', '.join(sorted(formats.WRITERS))}"
        ) from error


def load(path: Path, warn: Warn = ignore) -> Any:
    """Load a mesh file, or a project with all its layers, into a new `pymeshlab.MeshSet`.

    Parameters
    ----------
    path : Path
    warn : callable
        Called with a sentence if the file holds more than was read.

    Raises
    ------
    FileError
        If the file is missing, a folder, unreadable, truncated or not understood.
    """
    check_input(path)
    load_meshlab(path)
    from . import pymeshlab_io

    mesh_set = pymeshlab_io.load(path)
    read = mesh_set.current_mesh().vertex_number()
    if mesh_set.mesh_number() == 1 and not read:
        raise FileError(f"{path}: holds no points; it may be damaged or of another format")
    declared = declared_vertices(path)
    if declared is not None and declared > read:
        warn(
            f"{path}: {declared - read} of {declared} points have no valid coordinates "
            "and were left out by the reader"
        )
    checked = any(CHECKER in mesh.textures() for mesh in mesh_set)
    if checked and not (path.parent / CHECKER).is_file():
        warn(
            f"{path}: an image of its textures is missing; MeshLab puts a checker, {CHECKER}, in "
            "its place"
        )
    unread = unread_properties(path)
    if unread:
        warn(f"{path}: MeshLab does not read {', '.join(unread)}; the output is without")
    return mesh_set


def choose_layer(
    mesh_set: Any, layer: str | None, warn: Warn = ignore, option: str = "--layer"
) -> None:
    """Make the layer of a name or number the current one; None leaves it as it is.

    `option` is the command's option that chooses the layer, for messages.
    """
    labels = {mesh.id(): mesh.label() for mesh in mesh_set}
    if layer is None:
        if len(labels) > 1:
            number = mesh_set.current_mesh_id()
            warn(
                f"the file has {len(labels)} layers; this is about number {number} "
                f"({labels[number]}), choose another with {option}"
            )
        return
    for number, label in labels.items():
        if layer in (label, str(number)):
            mesh_set.set_current_mesh(number)
            return
    listed = ", ".join(f"{number} ({label})" for number, label in labels.items())
    raise FileError(f"layer {layer!r}: there is none of that name or number; the file has {listed}")


def check_output(path: Path, inputs: list[Path], *, force: bool) -> None:
    """Refuse an output that would overwrite a file, or that cannot be written.

    Raises
    ------
    FileError
        If the file exists and `force` is False, if it is a folder, a link or a device, or if its
        folder is missing.
    """
    if path.is_symlink():
        raise FileError(f"{path}: is a link to {os.readlink(path)}; name that file itself")
    if path.is_dir():
        raise FileError(f"{path}: is a folder; name a file")
    if path.exists() and not path.is_file():
        raise FileError(f"{path}: is no regular file; name another")
    if not path.parent.is_dir():
        raise FileError(f"{path.parent}: no such folder; make it first")
    if not os.access(path.parent, os.W_OK):
        raise FileError(f"{path.parent}: cannot be written to; check its permissions")
    if path.exists() and not force:
        same = any(path.samefile(other) for other in inputs if other.exists())
        what = "is the input" if same else "exists already"
        raise FileError(f"{path}: {what}; name another file, or overwrite it with --force")
    _check_name(path)


def _check_name(path: Path) -> None:
    """Refuse a name that is not valid UTF-8, which MeshLab cannot open."""
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError as error:
        raise FileError(
            f"{str(path)!r}: the name is no valid UTF-8, which MeshLab needs; rename it"
        ) from error


def check_format(path: Path) -> None:
    """Refuse an output that cannot be written in its format; called before any work is done.

    Raises
    ------
    FileError
    """
    ending = path.suffix.lower()
    if ending == PROJECT or formats.check_writer(path):
        return
    if path.is_dir():
        raise FileError(f"{path}: is a folder; name a file in it, such as {path / 'light.ply'}")
    if not ending:
        raise FileError(f"{path}: the name has no ending; choose a format such as .ply or .obj")
    load_meshlab(path)
    from . import pymeshlab_io

    if not pymeshlab_io.writes(ending):
        raise FileError(
            f"{path}: {ending} files are not written; choose a format such as .ply or .obj"
        )


def check_holds_faces(path: Path) -> None:
    """Refuse an output for a mesh in a format that holds points alone.

    Raises
    ------
    FileError
    """
    module = formats.writer(path)
    if module is not None and not module.FACES:
        raise FileError(
            f"{path}: {path.suffix} files hold points alone; give --points to leave the faces out, "
            "or choose a format with faces, such as .ply"
        )
