# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel and the source distribution: what they hold and say, and the wheel installed."""

import email
import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from datetime import date
from pathlib import Path

import pytest
from environments import environment_with
from packaging.metadata import Metadata
from shapes import torus

import salcore

ROOT = Path(__file__).parents[2]
PACKAGES = ("salcore", "meshlab_filter")
NAME = f"salient_simplify-{salcore.__version__}"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGE = (ROOT / "docs" / "package.md").read_text(encoding="utf-8")
BUILD = """
import sys
from setuptools import build_meta
getattr(build_meta, sys.argv[1])(sys.argv[2])
"""


def sources(*folders, pattern="*"):
    """The files of these folders, without Python's caches."""
    return {
        path.relative_to(ROOT).as_posix()
        for folder in folders
        for path in (ROOT / folder).rglob(pattern)
        if path.is_file() and "__pycache__" not in path.parts
    }


def build(what, tree, output):
    subprocess.run([sys.executable, "-c", BUILD, what, output], cwd=tree, check=True, text=True)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder with both distributions: the wheel is built from what the other one holds."""
    folder = tmp_path_factory.mktemp("distributions")
    # What an earlier build left in the tree would be packed again.
    leftovers = shutil.ignore_patterns(".*", "build", "*.egg-info", "__pycache__", "pictures")
    shutil.copytree(ROOT, folder / "tree", ignore=leftovers)
    build("build_sdist", folder / "tree", folder)
    with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
        archive.extractall(folder / "source", filter="data")
    build("build_wheel", folder / "source" / NAME, folder)
    return folder


@pytest.fixture(scope="module")
def wheel(built):
    (path,) = built.glob("*.whl")
    return path


def test_the_wheel_holds_both_packages_and_no_more(wheel):
    assert wheel.name == f"{NAME}-py3-none-any.whl"
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if not name.endswith("/")}
    described = {name for name in held if name.startswith(f"{NAME}.dist-info/")}
    assert held - described == sources(*PACKAGES)
    assert {name.partition("/")[2] for name in described} == {
        "METADATA", "RECORD", "WHEEL", "entry_points.txt", "licenses/LICENSE", "top_level.txt"
    }  # fmt: skip


def test_the_source_distribution_holds_what_is_built_and_tested_and_no_more(built):
    (path,) = built.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        held = {each.name.removeprefix(f"{NAME}/") for each in archive if each.isfile()}
    described = {name for name in held if name.startswith("salient_simplify.egg-info/")}
    assert held - described == {
        *sources(*PACKAGES, "blender_addon"),
        *sources("benchmarks", pattern="*.py"),
        *(sources("tests") - sources("tests/packaging")),
        "CHANGELOG.md", "LICENSE", "MANIFEST.in", "PKG-INFO", "README.md",
        "SECURITY.md", "docs/package.md", "pyproject.toml", "setup.cfg",
    }  # fmt: skip
    assert path.stat().st_size < 2e6


def test_what_the_package_index_shows_is_there(wheel):
    """All that it may show but links: there is no public address."""
    with zipfile.ZipFile(wheel) as archive:
        said = archive.read(f"{NAME}.dist-info/METADATA")
    metadata = Metadata.from_email(said, validate=True)
    assert (metadata.name, str(metadata.version)) == ("salient-simplify", salcore.__version__)
    assert metadata.license_expression == "GPL-3.0-or-later"
    assert metadata.license_files == ["LICENSE"]
    assert metadata.summary == PROJECT["description"]
    assert metadata.maintainer == PROJECT["maintainers"][0]["name"]
    assert metadata.keywords == PROJECT["keywords"]
    assert metadata.classifiers == PROJECT["classifiers"]
    assert str(metadata.requires_python) == ">=3.11"
    assert {"meshlab", "plot", "scans", "scale"} <= set(metadata.provides_extra)
    assert metadata.description_content_type == "text/markdown"
    assert metadata.description == PAGE
    assert email.message_from_bytes(said)["Project-URL"] is None


def test_the_page_of_the_package_stands_alone():
    """The index has no files beside the page: no link may lead to one, and no picture."""
    assert not re.findall(r"\]\((?!https://)", PAGE)
    assert "<img" not in PAGE
    extras = set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE))
    assert extras == PROJECT["optional-dependencies"].keys() - {
        "test", "blender", "docs", "benchmarks", "dev"
    }  # fmt: skip


def test_the_newest_changes_are_this_versions_and_dated():
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    version, day = re.search(r"^## (\S+) — (\S+)$", changes, re.MULTILINE).groups()
    assert version == salcore.__version__
    date.fromisoformat(day)


CHECK = """
import json, sys
sys.path.insert(0, sys.argv.pop(1))
known = json.loads(sys.argv.pop(1))
from trove_classifiers import classifiers
from twine.__main__ import main
print("unknown:", set(known) - classifiers)
sys.exit(main())
"""


@pytest.mark.network
def test_twine_and_the_index_take_it(built, tmp_path):
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet")
    subprocess.run([*pip, "--target", tmp_path, "twine", "trove-classifiers"], check=True)
    files = [path for path in built.glob(f"{NAME}*") if path.is_file()]
    known = json.dumps(PROJECT["classifiers"])
    command = (sys.executable, "-c", CHECK, tmp_path, known, "check", "--strict", *files)
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "unknown: set()" in done.stdout
    assert done.stdout.count("PASSED") == len(files) == 2


def install(wheel, folder, *names):
    """Install the wheel beside these distributions alone, and return the environment's Python."""
    python = environment_with(folder, *names)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", python)
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", wheel], check=True)
    return Path(python)


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    """The wheel as it is installed without extras."""
    return install(wheel, tmp_path_factory.mktemp("bare"), "numpy", "scipy")


@pytest.fixture(scope="module")
def with_files(wheel, tmp_path_factory):
    """The wheel as it is installed with the extra ``meshlab``."""
    more = ("plyfile", "pymeshlab", "shtab", "tqdm")
    return install(wheel, tmp_path_factory.mktemp("meshlab"), "numpy", "scipy", *more)


@pytest.fixture
def run(tmp_path):
    """Run an installed command, in a folder that holds one cloud before and after."""
    rows = "\n".join(" ".join(map(repr, row)) for row in torus(30, 20)[0].tolist())
    (tmp_path / "in.xyz").write_text(rows + "\n")

    def run(python, line):
        done = subprocess.run(
            [python.with_name("salient-simplify"), *line.split()],
            cwd=tmp_path, capture_output=True, text=True, env={"PATH": ""},
        )  # fmt: skip
        assert len(done.stderr.splitlines()) <= 1, done.stderr
        return done.returncode, done.stdout, done.stderr

    yield run
    assert [path.name for path in tmp_path.iterdir()] == ["in.xyz"]


def test_the_core_works(bare):
    code = (
        "import numpy as np, salcore; points = np.random.default_rng(0).random((500, 3)); "
        "print(salcore.__version__, len(salcore.simplify(points, count=50).indices))"
    )
    done = subprocess.check_output([bare, "-I", "-c", code], text=True)
    assert done.split() == [salcore.__version__, "50"]


def test_help_works(bare, run):
    assert run(bare, "--version") == (0, f"salient-simplify {salcore.__version__}\n", "")
    for line in ("--help", "simplify --help", "simplify --help-all"):
        status, said, errors = run(bare, line)
        assert (status, errors) == (0, "")
        assert said.startswith("usage: salient-simplify")


@pytest.mark.parametrize("line", ["simplify in.xyz out.xyz --ratio 0.5", "demo"])
def test_the_command_says_what_it_needs(bare, run, line):
    status, said, errors = run(bare, line)
    assert (status, said) == (1, "")
    assert "plyfile" in errors
    assert "pip install 'salient-simplify[meshlab]'" in errors


@pytest.mark.parametrize(
    ("line", "named", "extra"),
    [
        ("demo", "pictures", "plot"),
        ("saliency in.xyz out.ply --picture map.png", "pictures", "plot"),
        ("simplify in.xyz out.laz --ratio 0.5", "out.laz", "scans"),
        ("lods in.xyz out_{}.pcd --ratios 0.5", "out_0.pcd", "scans"),
    ],
)
def test_what_lacks_an_extra_ends_before_the_work(with_files, run, line, named, extra):
    status, said, errors = run(with_files, line)
    assert (status, said) == (2, "")
    assert f"error: {named}" in errors
    assert f"pip install 'salient-simplify[{extra}]'" in errors


def test_every_folder_with_modules_is_a_package():
    folders = {(ROOT / name).parent for name in sources(*PACKAGES)}
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
