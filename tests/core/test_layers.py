# SPDX-License-Identifier: GPL-3.0-or-later
"""What the core may know and do: numpy, scipy, itself; no host, no screen, no work at import."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import salcore

MODULES = sorted(Path(salcore.__file__).parent.glob("*.py"))
KNOWN = {"numpy", "scipy", *sys.stdlib_module_names}
SILENT = {"logging", "warnings", "sys", "subprocess", "socket", "urllib", "random"}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_a_module_knows_only_numpy_scipy_and_the_core(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level <= 1
            names = set() if node.level else {node.module.partition(".")[0]}
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in ("print", "open", "input", "exec", "eval")
            continue
        else:
            continue
        assert names <= KNOWN - SILENT, path.name


def test_importing_the_core_says_nothing_and_starts_nothing():
    code = (
        "import sys, threading\n"
        "import salcore\n"
        "hosts = {'bpy', 'pymeshlab', 'meshlab_filter', 'matplotlib', 'tqdm', 'trimesh'}\n"
        "assert not hosts & set(sys.modules), hosts & set(sys.modules)\n"
        "assert threading.active_count() == 1\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_no_thread_outlives_a_call():
    code = (
        "import threading, numpy, salcore\n"
        "steps = salcore.analysis_steps(numpy.random.default_rng(0).random((40000, 3)))\n"
        "for _ in range(6): next(steps)\n"
        "steps.close()\n"
        "salcore.simplify(numpy.random.default_rng(0).random((3000, 3)), alpha=10).report\n"
        "assert threading.active_count() == 1, threading.enumerate()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_all_public_names_exist_and_are_documented():
    assert sorted(salcore.__all__, key=str.lower) == sorted(set(salcore.__all__), key=str.lower)
    for name in salcore.__all__:
        thing = getattr(salcore, name)
        if callable(thing):
            assert thing.__doc__
