# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as users have it: staged, laid into Blender's folder of extensions, and enabled.

scipy comes from the tests' environment here; tests/packaging installs the zip with its wheels.
"""

import importlib
import importlib.util
import os
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
ROOT = Path(__file__).parents[2]
NAME = "bl_ext.user_default.salient_simplify"
PYTHONS = {(3, 11), (3, 13)}
"""Pythons that bpy has wheels for; elsewhere these tests say so and are skipped."""

HAS_BPY = importlib.util.find_spec("bpy") is not None
if not HAS_BPY and sys.version_info[:2] in PYTHONS:
    raise RuntimeError("no bpy: install the extra 'blender' to run tests/blender")
if not HAS_BPY:
    collect_ignore_glob = ["test_*.py"]


def pytest_report_header():
    """Say so where Blender's tests cannot run."""
    if not HAS_BPY:
        version = "{}.{}".format(*sys.version_info[:2])
        return f"tests/blender: not collected, there is no bpy for Python {version}"
    return None


if HAS_BPY:
    _USER = tempfile.TemporaryDirectory(prefix="salient-blender-")
    os.environ["BLENDER_USER_RESOURCES"] = _USER.name  # before bpy is imported

    _spec = importlib.util.spec_from_file_location(
        "package", ROOT / "blender_addon" / "packaging" / "package.py"
    )
    _package = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(_package)
    _package.stage(Path(_USER.name) / "extensions" / "user_default" / "salient_simplify")

    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=NAME)
    ADDONS = sorted(bpy.context.preferences.addons.keys())


_STATUS = [0]


def pytest_sessionfinish(session, exitstatus):
    """Remember how the tests went."""
    _STATUS[0] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """Leave without bpy's own end, which now and then waits for ever for one of its threads."""
    if HAS_BPY:
        _USER.cleanup()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_STATUS[0])


@pytest.fixture(scope="session")
def extension():
    """Return the enabled extension's package."""
    return importlib.import_module(NAME)


@pytest.fixture(autouse=True)
def empty_scene():
    """Start every test with an empty file, and with the preferences that the first one had.

    To read the preferences anew takes five times as long, for it turns off all add-ons.
    """
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    yield
    if sorted(bpy.context.preferences.addons.keys()) != ADDONS:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.preferences.addon_enable(module=NAME)


@pytest.fixture
def module(extension):
    """Return a function that finds a module of the extension by its name."""
    return lambda name: importlib.import_module(f"{NAME}.{name}")


@pytest.fixture
def work(module):
    """Return the add-on's module of work, with a child that is ready; none is left afterwards."""
    from workers import children, wait_for

    found = module("operators.work")
    found.stop()
    assert children() == []
    found.host.start()
    wait_for(found.host, "idle")
    yield found
    found.stop()
    assert children() == []
