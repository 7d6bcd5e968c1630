# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender extension: its wheels, its zip, and the zip at work in an empty Blender."""

import base64
import csv
import hashlib
import importlib.metadata
import importlib.util
import io
import json
import os
import platform
import re
import runpy
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import salcore

ROOT = Path(__file__).parents[2]
ADDON = ROOT / "blender_addon"
SCRIPT = ADDON / "packaging" / "package.py"
MANIFEST = tomllib.loads((ADDON / "blender_manifest.toml").read_text(encoding="utf-8"))

spec = importlib.util.spec_from_file_location("package", SCRIPT)
package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)

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
def built(tmp_path_factory, wheels):
    """The zip for this machine, built as a newcomer would."""
    output = tmp_path_factory.mktemp("dist")
    options = ("--platform", HOST, "--wheels", wheels, "--output", output)
    status, said, errors = run(SCRIPT, *options)
    assert (status, errors) == (0, "")
    (path,) = output.iterdir()
    assert said == f"{path} {path.stat().st_size / 1e6:.1f} MB\n"
    return path


def test_version_and_licence_are_the_cores():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert MANIFEST["version"] == salcore.__version__
    assert MANIFEST["license"] == [f"SPDX:{project['license']}"]


@needs_bpy
def test_tags_are_blenders():
    scripts = package.find_builder().parents[3]
    known = runpy.run_path(str(scripts / "modules/_bpy_internal/extensions/tags.py"))["addons"]
    assert set(MANIFEST["tags"]) <= known


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


@pytest.mark.network
@pytest.mark.parametrize(
    ("name", "python"),
    sorted((name, w.python) for name, several in package.WHEELS.items() for w in several
           if w.library == "scipy"),
)  # fmt: skip
def test_every_wheel_is_to_be_had(name, python, tmp_path):
    wheels = [wheel for wheel in package.WHEELS[name] if wheel.python in (python, "py3")]
    assert len(wheels) >= 4
    command = (
        *("-m", "pip", "install", "--quiet", "--dry-run", "--report", "-", "--target", tmp_path),
        # Older versions of pip compare what scipy requires with the Python that runs them.
        *("--no-deps", "--only-binary=:all:", "--ignore-requires-python"),
        *(f"--platform={tag}" for tag in sorted({wheel.tag for wheel in wheels} - {"any"})),
        *("--python-version", python[2:]),
        *(f"{wheel.library}=={wheel.version}" for wheel in wheels),
    )
    status, said, errors = run(*command)
    assert status == 0, errors
    found = {item["metadata"]["name"]: item["download_info"]["url"]
             for item in json.loads(said)["install"]}  # fmt: skip
    assert set(found) == {wheel.library for wheel in wheels}
    for wheel in wheels:
        assert found[wheel.library].endswith(".whl")
        assert wheel.tag in found[wheel.library].rpartition("-")[2]


@pytest.mark.network
def test_a_missing_wheel_is_one_clear_error(tmp_path):
    absent = package.Wheel("scipy", "1.18.1", "cp313", "macosx_10_14_x86_64")
    expected = r"no wheel of scipy 1\.18\.1 for cp313 and macosx_10_14_x86_64: ERROR: [^\n]+$"
    with pytest.raises(package.PackageError, match=expected):
        package.fetch(absent, tmp_path)


@pytest.mark.network
@needs_bpy
def test_a_broken_extension_leaves_no_zip(tmp_path, built, wheels):
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
def test_the_zip_holds_what_it_should_and_no_more(built, wheels):
    assert built.stat().st_size <= 80e6
    expected = {
        **{name: data for name, data in files(ADDON).items() if not name.startswith("packaging/")},
        **{f"salcore/{name}": data for name, data in files(ROOT / "salcore").items()},
        **{f"wheels/{name}": data for name, data in files(wheels).items()},
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    with zipfile.ZipFile(built) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    assert sorted(held) == sorted(expected)
    manifest = tomllib.loads(held.pop("blender_manifest.toml").decode())
    # The wheels among them: byte for byte what pip downloaded.
    assert [name for name, data in held.items() if data != expected[name]] == []

    bundled = {f"./{name}" for name in held if name.endswith(".whl")}
    assert len(bundled) == len(package.WHEELS[HOST])
    libraries = {name.removeprefix("./wheels/").partition("-")[0] for name in bundled}
    assert libraries == {"scipy", "laspy", "lazrs", "plyfile"}
    assert manifest["platforms"] == manifest["build"]["generated"]["platforms"] == [HOST]
    assert set(manifest["wheels"]) == set(manifest["build"]["generated"]["wheels"]) == bundled


@pytest.mark.network
@needs_bpy
def test_bundled_wheels_agree_with_their_records(built):
    with zipfile.ZipFile(built) as archive:
        bundled = [archive.read(name) for name in archive.namelist() if name.endswith(".whl")]
    for data in bundled:
        with zipfile.ZipFile(io.BytesIO(data)) as wheel:
            (record,) = (name for name in wheel.namelist() if name.endswith(".dist-info/RECORD"))
            rows = list(csv.reader(io.StringIO(wheel.read(record).decode())))
            assert {row[0] for row in rows} == {n for n in wheel.namelist() if n[-1] != "/"}
            for name, digest, size in rows:
                if name != record:
                    content = wheel.read(name)
                    value = base64.urlsafe_b64encode(hashlib.sha256(content).digest())
                    assert digest == f"sha256={value.decode().rstrip('=')}", name
                    assert int(size) == len(content), name


def with_requirements(name):
    """A distribution of this environment and all that it requires, by name."""
    found, waiting = set(), [name]
    while waiting:
        if (name := waiting.pop()) not in found:
            found.add(name)
            required = map(Requirement, importlib.metadata.requires(name) or ())
            waiting += [
                r.name for r in required if not r.marker or r.marker.evaluate({"extra": ""})
            ]
    return found


def environment_with_bpy_alone(folder):
    """Make a virtual environment with this environment's bpy and what bpy requires.

    They are linked, not installed anew: bpy takes more than a gigabyte.
    """
    builder = venv.EnvBuilder(symlinks=os.name != "nt")
    builder.create(folder)
    python = builder.ensure_directories(folder).env_exe
    probe = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.check_output([python, "-I", "-c", probe], text=True).strip())
    for name in with_requirements("bpy"):
        distribution = importlib.metadata.distribution(name)
        for top in {file.parts[0] for file in distribution.files} - {"..", "__pycache__"}:
            target = Path(distribution.locate_file(top)).resolve()
            (site / top).symlink_to(target, target_is_directory=target.is_dir())
    return python


@pytest.mark.network
@needs_bpy
def test_install_simplify_uninstall(built, tmp_path):
    python = environment_with_bpy_alone(tmp_path / "environment")
    user = tmp_path / "user"
    user.mkdir()
    done = subprocess.run(
        [python, "-I", Path(__file__).with_name("installed_extension.py"), built],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(user)},
        capture_output=True,
        text=True,
        timeout=80,
    )
    assert done.returncode == 0, done.stdout + done.stderr
