# SPDX-License-Identifier: GPL-3.0-or-later
"""Pack the Blender extension: one zip for each platform, with wheels inside.

Run ``python blender_addon/packaging/package.py``. This folder itself stays outside the zip.
"""

import argparse
import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ADDON = Path(__file__).resolve().parents[1]
ROOT = ADDON.parent
MANIFEST = "blender_manifest.toml"


class Wheel(NamedTuple):
    """One wheel: its library and version, the Python and platform that it is for, its SHA-256."""

    library: str
    version: str
    python: str
    tag: str
    digest: str


SCIPY = {"cp311": "1.17.1", "cp313": "1.18.1"}
LAZRS = "0.8.2"
OLDEST = "311"
"""Python that wheels for all of them are asked for."""


def _scipy(python: str, tag: str, digest: str) -> Wheel:
    return Wheel("scipy", SCIPY[python], python, tag, digest)


def _lazrs(python: str, tag: str, digest: str) -> Wheel:
    return Wheel("lazrs", LAZRS, python, tag, digest)


PURE = (
    Wheel("laspy", "2.7.0", "py3", "any",
          "15f5344c62a1023461996bdf5d1ba5fdd813e96694a524fee712931134f3792f"),
    Wheel("plyfile", "1.1.3", "py3", "any",
          "581302f07b1c298431dcaa9038bba2ae80f3f7868b29ccb826a07bc4488ff38a"),
)  # fmt: skip
"""Readers of scans without code of their own for a platform; laspy wants lazrs for LAZ."""

# What each platform's zip carries. No Blender brings scipy along, all bring numpy. Blender 4.5
# and 5.0 run Python 3.11, later ones 3.13; 4.5 was the last to run on Macs with Intel processors.
# Blender picks wheels without a look at the system's version, so each tag is the oldest there is.
WHEELS = {
    "linux-x64": (
        _scipy("cp311", "manylinux_2_28_x86_64",
               "43af8d1f3bea642559019edfe64e9b11192a8978efbd1539d7bc2aaa23d92de4"),
        _scipy("cp313", "manylinux_2_28_x86_64",
               "fdaf5ea890a6183d0565f51a61799d67081bd5b1cf03c5f4b3fd3732108625c9"),
        _lazrs("cp311", "manylinux_2_17_x86_64",
               "34d84a4e5874c03b986e7b69b1c972c5dfe023537a1ac4c198e3012f0042bb0a"),
        _lazrs("cp313", "manylinux_2_17_x86_64",
               "4b7b5de291b1c6892bda5a3cec6a06ab582ed5bff513066cc3ba947ae1739a87"),
        *PURE,
    ),
    "windows-x64": (
        _scipy("cp311", "win_amd64",
               "d30e57c72013c2a4fe441c2fcb8e77b14e152ad48b5464858e07e2ad9fbfceff"),
        _scipy("cp313", "win_amd64",
               "559ed65f60c1af5a03f3912605a1b5114f522c7c32fb23c3376ae8f03219fe28"),
        _lazrs("cp311", "win_amd64",
               "29e49fb839ee82f014495cf79bb43559b64696b3440db878e340b4aab0b53df9"),
        _lazrs("cp313", "win_amd64",
               "f76330be981c0385841e3d11428c7808b3527c0e762b6e664b5c446c3477d6bd"),
        *PURE,
    ),
    "macos-arm64": (
        _scipy("cp311", "macosx_12_0_arm64",
               "e18f12c6b0bc5a592ed23d3f7b891f68fd7f8241d69b7883769eb5d5dfb52696"),
        _scipy("cp313", "macosx_12_0_arm64",
               "e6fb6a55cc0ba97b59a1f288fb86dc6fce8bdfc0fffcbfd015e3a954bf2a2d93"),
        _lazrs("cp311", "macosx_11_0_arm64",
               "b5029d4a889f0a2eafc76857c37f9bb96dd223addd3e252339b66e88f9a0178f"),
        _lazrs("cp313", "macosx_11_0_arm64",
               "014805e852a1dfd7d53d55561fb6c331ba59aacfc9a4832b4d9f936c8552753a"),
        *PURE,
    ),
    "macos-x64": (
        _scipy("cp311", "macosx_10_14_x86_64",
               "1f95b894f13729334fb990162e911c9e5dc1ab390c58aa6cbecb389c5b5e28ec"),
        _lazrs("cp311", "macosx_10_12_x86_64",
               "ddeea17cd291fbf5e6a18e24440d25a7389d5a4cc3930466421a688464f5f188"),
        *PURE,
    ),
}  # fmt: skip


class PackageError(RuntimeError):
    """The extension could not be packed; the message says why in one line."""


def stage(folder: Path, wheels: Mapping[str, Sequence[Path]] | None = None) -> None:
    """Lay out the extension in a folder, as Blender's builder and Blender itself want it.

    Parameters
    ----------
    folder : Path
        Where to; may exist already, files of the same name are replaced.
    wheels : mapping of str to sequence of Path, optional
        The wheels to bundle for each of Blender's platforms. Without them the manifest names
        neither platforms nor wheels, and the libraries must come from elsewhere.
    """
    unwanted = shutil.ignore_patterns("__pycache__", ".*", "*.pyc", "packaging")
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


def fetch(wheel: Wheel, folder: Path) -> Path:
    """Find a wheel in a folder, or let pip download it into there.

    Parameters
    ----------
    wheel : Wheel
    folder : Path

    Returns
    -------
    Path

    Raises
    ------
    PackageError
        If there is no such wheel, or it is not the one whose checksum stands in the table.
    """
    library, version, python, tag, digest = wheel
    number = OLDEST if python == "py3" else python.removeprefix("cp")
    pattern = f"{library}-{version}-{python}-*{tag}*.whl"

    def present() -> list[Path]:
        # A download that was cut short is no zip file and counts as missing.
        return [path for path in sorted(folder.glob(pattern)) if zipfile.is_zipfile(path)]

    if not present():
        command = (
            # Without the check for a newer pip, whose notice would hide what went wrong.
            *("-m", "pip", "--disable-pip-version-check", "download", "--quiet"),
            *("--no-deps", "--only-binary=:all:"),
            *("--python-version", number, "--platform", tag, "--dest", str(folder)),
            f"{library}=={version}",
        )
        failure = f"no wheel of {library} {version} for {python} and {tag}"
        _run(command, failure)
        if not present():
            raise PackageError(f"{failure}: pip chose another one")
    path = present()[0]
    if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
        raise PackageError(f"{path} has another checksum than the wheel that was tested; remove it")
    return path


def find_builder() -> Path:
    """Find Blender's own builder of extensions beside the installed bpy, without importing it.

    Returns
    -------
    Path

    Raises
    ------
    PackageError
        If this Python has no bpy.
    """
    spec = importlib.util.find_spec("bpy")
    for folder in (spec and spec.submodule_search_locations) or ():
        for path in Path(folder).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"):
            return path
    raise PackageError(
        "this Python has no bpy: install it, or name blender_ext.py by --blender-ext"
    )


def build(
    platforms: Sequence[str], output: Path, wheels: Path | None = None, builder: Path | None = None
) -> list[Path]:
    """Build and validate one zip for each platform.

    Parameters
    ----------
    platforms : sequence of str
        Keys of `WHEELS`.
    output : Path
        The folder for the zips. Those of the same name are replaced, but only once all new ones
        are valid.
    wheels : Path, optional
        A folder whose wheels are used, and into which missing ones are downloaded.
    builder : Path, optional
        Blender's ``blender_ext.py``; by default the one beside the installed bpy.

    Returns
    -------
    list of Path
        The zips, in the order of their names.

    Raises
    ------
    PackageError
        If a wheel is missing, or Blender's builder refuses the extension.
    """
    builder = builder or find_builder()
    if not builder.is_file():
        raise PackageError(f"there is no file {builder}")
    output.mkdir(parents=True, exist_ok=True)
    # Inside the output folder, so that finished zips move over whole or not at all.
    with TemporaryDirectory(dir=output, prefix=".package-") as folder:
        work = Path(folder)
        cache = wheels or work / "wheels"
        (work / "zips").mkdir()
        # Each by itself: of several at once, the builder leaves all wheels in each zip's manifest.
        for name in platforms:
            stage(work / name, {name: [fetch(wheel, cache) for wheel in WHEELS[name]]})
            options = ("--source-dir", str(work / name), "--output-dir", str(work / "zips"))
            _run(
                (str(builder), "build", *options, "--split-platforms"), "Blender cannot build this"
            )
        built = sorted((work / "zips").glob("*.zip"))
        for path in built:
            _run((str(builder), "validate", str(path)), f"Blender finds {path.name} invalid")
        return [path.replace(output / path.name) for path in built]


def _run(arguments: Sequence[str], failure: str) -> None:
    """Run Python on a script or module; if that fails, raise with the last line it said."""
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True)
    if done.returncode:
        said = (done.stdout + done.stderr).strip() or f"exit status {done.returncode}"
        raise PackageError(f"{failure}: {said.splitlines()[-1]}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; see ``--help``.

    Parameters
    ----------
    arguments : sequence of str, optional

    Returns
    -------
    int
        The exit status: 0, or 2 after an error.
    """
    parser = argparse.ArgumentParser(description="Pack the Blender extension, libraries included.")
    parser.add_argument(
        "--platform", action="append", choices=WHEELS, help="may be repeated; default: all"
    )
    parser.add_argument(
        "--output", type=Path, default=ROOT / "dist", metavar="DIR", help="default: dist"
    )
    parser.add_argument(
        "--wheels", type=Path, metavar="DIR", help="keep wheels here and use those that are here"
    )
    parser.add_argument(
        "--blender-ext", type=Path, metavar="PATH", help="default: the one beside bpy"
    )
    chosen = parser.parse_args(arguments)
    try:
        zips = build(
            chosen.platform or tuple(WHEELS), chosen.output, chosen.wheels, chosen.blender_ext
        )
    except (PackageError, OSError) as error:
        sys.stderr.write(f"package.py: {error}\n")
        return 2
    for path in zips:
        sys.stdout.write(f"{path} {path.stat().st_size / 1e6:.1f} MB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
