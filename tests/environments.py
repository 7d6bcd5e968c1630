# SPDX-License-Identifier: GPL-3.0-or-later
"""Virtual environments that hold a few of this environment's distributions and nothing else."""

import importlib.metadata
import os
import subprocess
import venv
from pathlib import Path

from packaging.requirements import Requirement


def with_requirements(names):
    """The distributions of these names and all that they require, by name."""
    found, waiting = set(), list(names)
    while waiting:
        if (name := waiting.pop()) not in found:
            found.add(name)
            required = map(Requirement, importlib.metadata.requires(name) or ())
            waiting += [
                r.name for r in required if not r.marker or r.marker.evaluate({"extra": ""})
            ]
    return found


def environment_with(folder, *names):
    """Make a virtual environment with these distributions and what they require, alone.

    They are linked, not installed anew: bpy takes more than a gigabyte. Return its Python.
    """
    builder = venv.EnvBuilder(symlinks=os.name != "nt")
    builder.create(folder)
    python = builder.ensure_directories(folder).env_exe
    probe = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.check_output([python, "-I", "-c", probe], text=True).strip())
    for name in with_requirements(names):
        distribution = importlib.metadata.distribution(name)
        for top in {file.parts[0] for file in distribution.files} - {"..", "__pycache__"}:
            target = Path(distribution.locate_file(top)).resolve()
            (site / top).symlink_to(target, target_is_directory=target.is_dir())
    return python
