# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender extension: its wheels, its zip, and the zip at work in an empty Blender."""

import base64
import csv
import hashlib
import importlib.util
import io
import json
import os
import platform
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from environments import environment_with
from packaging.utils import parse_wheel_filename

import salcore

ROOT = Path(__file__).parents[2]
ADDON = ROOT / "blender_addon"
SCRIPT = ADDON / "packaging" / "package.py"
MANIFEST = tomllib.loads((ADDON / "blender_manifest.toml").read_text(encoding="utf-8"))

spec = importlib.util.spec_from_file_location("package", SCRIPT)
package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)

ALL_WHEELS = list(dict.fromkeys(each for several in package.WHEELS.values() for each in several))
PYTHONS = [
    (name, python)
    for name, several in package.WHEELS.items()
    for python in sorted({wheel.python for wheel in several} - {"py3"})
]

PYTHON = "{}.{}".format(*sys.version_info)
HOST = "{}-{}".format(
    {"Darwin": "macos"}.get(platform.system(), platform.system().lower()),
    {"x86_64": "x64", "amd64": "x64"}.get(platform.machine().lower(), platform.machine().lower()),
)
# Where bpy exists but is not installed these tests fail: they must not drop out unnoticed.
needs_bpy = pytest.mark.skipif(
    f"cp{PYTHON.replace('.', '')}" not in {wheel.python for wheel in package.WHEELS.get(HOST, ())},
    reason=f"there is no bpy for Python {PYTHON} on {HOST}",
)


def run(*arguments, **options):
    """Run this Python with arguments, and give its exit status, output and errors."""
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, **options
    )
    return done.returncode, done.stdout, done.stderr


def files(folder):
    """The files under a folder by their names in a zip, without Python's caches."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """The folder pip downloads into."""
    return tmp_path_factory.mktemp("wheels")


@pytest.fixture(scope="module")
def zips(tmp_path_factory, wheels):
    """The zips for all platforms by their names, built as a newcomer would."""
    output = tmp_path_factory.mktemp("dist")
    status, said, errors = run(SCRIPT, "--wheels", wheels, "--output", output)
    assert (status, errors) == (0, "")
    paths = sorted(output.iterdir())
    assert said == "".join(f"{path} {path.stat().st_size / 1e6:.1f} MB\n" for path in paths)
    names = [path.stem.rpartition("-")[2].replace("_", "-") for path in paths]
    assert sorted(names) == sorted(package.WHEELS)
    return dict(zip(names, paths, strict=True))


def test_version_and_licence_are_the_cores():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert MANIFEST["version"] == salcore.__version__
    assert MANIFEST["license"] == [f"SPDX:{project['license']}"]


@needs_bpy
def test_blender_finds_the_extension_valid(tmp_path):
    package.stage(tmp_path)
    builder = package.find_builder()
    tags = builder.parents[3] / "modules/_bpy_internal/extensions/tags.py"
    status, said, errors = run(builder, "validate", tmp_path, "--valid-tags", tags)
    assert (status, errors) == (0, ""), said


def test_what_the_extension_site_shows_is_there():
    """All that its manifest may say but the website: there is no public address."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert MANIFEST.keys() == {
        "schema_version", "id", "version", "name", "tagline", "maintainer", "type", "tags",
        "blender_version_min", "license", "copyright", "permissions",
    }  # fmt: skip
    assert "urls" not in project, "the extension's manifest can name the website, too"
    assert [{"name": MANIFEST["maintainer"]}] == project["maintainers"]
    for sentence in (MANIFEST["tagline"], *MANIFEST["permissions"].values()):
        assert len(sentence) <= 64
        assert sentence[-1].isalnum()
    assert MANIFEST["permissions"].keys() == {"files"}


def test_every_platform_has_all_libraries_for_all_its_pythons():
    for name, wheels in package.WHEELS.items():
        pythons = {wheel.python for wheel in wheels} - {"py3"}
        assert pythons == ({"cp311"} if name == "macos-x64" else {"cp311", "cp313"})
        for library in ("scipy", "lazrs"):
            assert {w.python for w in wheels if w.library == library} == pythons
        assert {w.library for w in wheels if w.python == "py3"} == {"laspy", "plyfile"}
        known = {"linux-x64": "manylinux", "windows-x64": "win", "macos": "macosx"}
        system = next(tag for key, tag in known.items() if name.startswith(key))
        assert all(w.tag.startswith(system) for w in wheels if w.python != "py3")
        assert len(set(wheels)) == len(wheels)


def test_files_that_need_a_library_find_it_among_the_wheels():
    wanted = set()
    for path in (ADDON / "geometry").glob("*.py"):
        wanted |= set(re.findall(r'required\("(\w+)", path\)', path.read_text(encoding="utf-8")))
    bundled = {wheel.library for wheels in package.WHEELS.values() for wheel in wheels}
    assert wanted == bundled - {"scipy"}


def test_every_wheel_is_pinned():
    digests = {wheel.digest for wheel in ALL_WHEELS}
    assert len(digests) == len(ALL_WHEELS)
    assert all(re.fullmatch("[0-9a-f]{64}", digest) for digest in digests)


def test_another_wheel_than_the_tested_one_is_refused(tmp_path):
    wheel = package.PURE[0]
    path = tmp_path / f"{wheel.library}-{wheel.version}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("laspy/__init__.py", "")
    with pytest.raises(package.PackageError, match="another checksum than the wheel that was test"):
        package.fetch(wheel, tmp_path)


@pytest.mark.network
@pytest.mark.parametrize(("name", "python"), PYTHONS)
def test_the_index_knows_the_checksums(name, python, tmp_path):
    wanted = [wheel for wheel in package.WHEELS[name] if wheel.python in (python, "py3")]
    tags = sorted({wheel.tag for wheel in wanted} - {"any"})
    command = (
        *("-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--dry-run"),
        # Older versions of pip compare what scipy requires with the Python that runs them.
        *("--no-deps", "--only-binary=:all:", "--ignore-requires-python", "--report", "-"),
        *("--target", tmp_path, "--python-version", python.removeprefix("cp")),
        *(option for tag in tags for option in ("--platform", tag)),
        *(f"{wheel.library}=={wheel.version}" for wheel in wanted),
    )
    status, said, errors = run(*command)
    assert status == 0, errors
    found = {
        each["metadata"]["name"]: each["download_info"]["archive_info"]["hashes"]["sha256"]
        for each in json.loads(said)["install"]
    }
    assert found == {wheel.library: wheel.digest for wheel in wanted}


@pytest.mark.network
def test_a_missing_wheel_is_one_clear_error(tmp_path):
    absent = package.Wheel("scipy", "1.18.1", "cp313", "macosx_10_14_x86_64", "")
    expected = r"no wheel of scipy 1\.18\.1 for cp313 and macosx_10_14_x86_64: ERROR: [^\n]+$"
    with pytest.raises(package.PackageError, match=expected):
        package.fetch(absent, tmp_path)


@pytest.mark.network
@needs_bpy
def test_a_broken_extension_leaves_no_zip(tmp_path, zips, wheels):
    refusing = tmp_path / "refusing.py"
    refusing.write_text("import sys\nsys.exit('FATAL_ERROR: no')\n")
    options = ("--platform", HOST, "--wheels", wheels, "--output", tmp_path / "dist")
    status, said, errors = run(SCRIPT, *options, "--blender-ext", refusing)
    assert (status, said) == (2, "")
    assert errors == "package.py: Blender cannot build this: FATAL_ERROR: no\n"
    assert not list((tmp_path / "dist").iterdir())


def test_staging_without_wheels(tmp_path):
    package.stage(tmp_path)
    staged = files(tmp_path)
    assert tomllib.loads(staged["blender_manifest.toml"].decode()) == MANIFEST
    assert not {"platforms", "wheels"} & MANIFEST.keys()
    assert not [name for name in staged if name.endswith(".whl")]


@pytest.mark.network
@needs_bpy
@pytest.mark.parametrize("name", package.WHEELS)
def test_a_zip_holds_what_it_should_and_no_more(name, zips, wheels):
    assert zips[name].stat().st_size <= 80e6  # the extension site takes 200
    chosen = {package.fetch(wheel, wheels).name for wheel in package.WHEELS[name]}
    expected = {
        **{name: data for name, data in files(ADDON).items() if not name.startswith("packaging/")},
        **{f"salcore/{name}": data for name, data in files(ROOT / "salcore").items()},
        **{f"wheels/{name}": (wheels / name).read_bytes() for name in chosen},
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    with zipfile.ZipFile(zips[name]) as archive:
        assert archive.testzip() is None
        held = {each: archive.read(each) for each in archive.namelist()}
    assert sorted(held) == sorted(expected)
    manifest = tomllib.loads(held.pop("blender_manifest.toml").decode())
    # The wheels among them: byte for byte what pip downloaded, and what the table's digests are of.
    assert [each for each, data in held.items() if data != expected[each]] == []

    listed = {f"./wheels/{each}" for each in chosen}
    assert len(listed) == len(package.WHEELS[name])
    assert set(manifest["wheels"]) == set(manifest["build"]["generated"]["wheels"]) == listed
    assert manifest["platforms"] == manifest["build"]["generated"]["platforms"] == [name]
    assert {key: manifest[key] for key in MANIFEST} == MANIFEST


SYSTEMS = {
    "linux-x64": r"manylinux_2_(17|27|28)_x86_64|manylinux2014_x86_64",  # Blender wants 2.28
    "windows-x64": "win_amd64",
    "macos-arm64": r"macosx_1[12]_0_arm64",
    "macos-x64": r"macosx_10_1[24]_x86_64",
}
"""Tags of what runs where this platform's Blender does."""


@pytest.mark.network
@needs_bpy
@pytest.mark.parametrize("name", package.WHEELS)
def test_the_tags_of_a_zips_wheels_are_its_platforms(name, zips):
    with zipfile.ZipFile(zips[name]) as archive:
        bundled = [Path(each).name for each in archive.namelist() if each.endswith(".whl")]
    pythons = {}
    for library, _, _, tags in map(parse_wheel_filename, bundled):
        for tag in tags:
            assert tag.platform == "any" or re.fullmatch(SYSTEMS[name], tag.platform), tag
            pythons.setdefault(str(library), set()).add(tag.interpreter)
    several = {"cp311"} if name == "macos-x64" else {"cp311", "cp313"}
    assert pythons == {"scipy": several, "lazrs": several, "laspy": {"py3"}, "plyfile": {"py3"}}


@pytest.mark.network
@needs_bpy
@pytest.mark.parametrize("wheel", ALL_WHEELS, ids=lambda w: f"{w.library}-{w.python}-{w.tag}")
def test_a_bundled_wheel_agrees_with_its_record(wheel, zips, wheels):
    with zipfile.ZipFile(package.fetch(wheel, wheels)) as archive:
        (record,) = (name for name in archive.namelist() if name.endswith(".dist-info/RECORD"))
        rows = list(csv.reader(io.StringIO(archive.read(record).decode())))
        assert {row[0] for row in rows} == {n for n in archive.namelist() if n[-1] != "/"}
        for name, digest, size in rows:
            if name != record:
                content = archive.read(name)
                value = base64.urlsafe_b64encode(hashlib.sha256(content).digest())
                assert digest == f"sha256={value.decode().rstrip('=')}", name
                assert int(size) == len(content), name


@pytest.mark.network
@needs_bpy
def test_install_simplify_uninstall(zips, tmp_path):
    python = environment_with(tmp_path / "environment", "bpy")
    user = tmp_path / "user"
    user.mkdir()
    done = subprocess.run(
        [python, "-I", Path(__file__).with_name("installed_extension.py"), zips[HOST]],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(user)},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stdout + done.stderr
