# SPDX-License-Identifier: GPL-3.0-or-later
"""What the wheel and the source distribution hold: both packages whole, and nothing else."""

import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

import salcore

ROOT = Path(__file__).parents[2]
PACKAGES = ("salcore", "meshlab_filter")
NAME = f"salient_simplify-{salcore.__version__}"
BUILD = """
import sys
backend, output = sys.argv[1:]
sys.path.insert(0, backend)
from setuptools import build_meta
build_meta.build_sdist(output)
build_meta.build_wheel(output)
"""


def sources():
    """The files of both packages."""
    return {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder with both distributions, built from a copy of the tree."""
    folder = tmp_path_factory.mktemp("distributions")
    tree, backend = folder / "tree", folder / "backend"
    # What an earlier build left in the tree would be packed again.
    leftovers = shutil.ignore_patterns(".git", "build", "*.egg-info", "__pycache__")
    shutil.copytree(ROOT, tree, ignore=leftovers)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    required = project["build-system"]["requires"]
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--target", backend, *required)
    subprocess.run(pip, check=True)
    subprocess.run([sys.executable, "-c", BUILD, backend, folder], cwd=tree, check=True)
    return folder


@pytest.mark.network
def test_the_wheel_holds_both_packages_and_no_more(built):
    (path,) = built.glob("*.whl")
    with zipfile.ZipFile(path) as wheel:
        held = {name for name in wheel.namelist() if not name.endswith("/")}
    described = {name for name in held if name.startswith(f"{NAME}.dist-info/")}
    assert held - described == sources()
    assert f"{NAME}.dist-info/licenses/LICENSE" in described


@pytest.mark.network
def test_the_source_distribution_holds_both_packages_and_no_more(built):
    (path,) = built.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        held = {each.name.removeprefix(f"{NAME}/") for each in archive if each.isfile()}
    described = {name for name in held if name.startswith("salient_simplify.egg-info/")}
    assert held - described == sources() | {
        "LICENSE", "PKG-INFO", "README.md", "pyproject.toml", "setup.cfg"
    }  # fmt: skip


def test_every_folder_with_modules_is_a_package():
    folders = {(ROOT / name).parent for name in sources()}
    assert [folder for folder in folders if not (folder / "__init__.py").is_file()] == []


def test_every_public_name_has_a_home():
    assert sorted(name for names in salcore._HOMES.values() for name in names.split()) == sorted(
        salcore.__all__
    )
    for name in salcore.__all__:
        assert getattr(salcore, name) is not None
        assert name in dir(salcore)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = salcore.nothing
