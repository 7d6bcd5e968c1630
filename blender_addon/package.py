# SPDX-License-Identifier: GPL-3.0-or-later
"""Pack the Blender extension: one zip for each platform, with scipy's wheels inside.

Run ``python blender_addon/package.py``. This file itself stays outside the zip.
"""

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

ADDON = Path(__file__).resolve().parent
ROOT = ADDON.parent
MANIFEST = "blender_manifest.toml"


def stage(folder: Path, wheels: Mapping[str, Sequence[Path]] | None = None) -> None:
    """Lay out the extension in a folder, as Blender's builder and Blender itself want it.

    Parameters
    ----------
    folder : Path
        Where to; may exist already, files of the same name are replaced.
    wheels : mapping of str to sequence of Path, optional
        The wheels to bundle for each of Blender's platforms. Without them the manifest names
        neither platforms nor wheels, and scipy must come from elsewhere.
    """
    unwanted = shutil.ignore_patterns("__pycache__", ".*", "*.pyc", Path(__file__).name)
    shutil.copytree(ADDON, folder, ignore=unwanted, dirs_exist_ok=True)
    shutil.copytree(ROOT / "salcore", folder / "salcore", ignore=unwanted, dirs_exist_ok=True)
    shutil.copyfile(ROOT / "LICENSE", folder / "LICENSE")
    if wheels:
        files = sorted({wheel for several in wheels.values() for wheel in several})
        (folder / "wheels").mkdir(exist_ok=True)
        for wheel in files:
            shutil.copyfile(wheel, folder / "wheels" / wheel.name)
        # These keys belong to no table, so they come before the first one. JSON's lists of
        # plain strings are TOML's too.
        head = (
            f"platforms = {json.dumps(sorted(wheels))}\n"
            f"wheels = {json.dumps([f'./wheels/{wheel.name}' for wheel in files])}\n"
        )
        manifest = folder / MANIFEST
        manifest.write_text(head + manifest.read_text(encoding="utf-8"), encoding="utf-8")
