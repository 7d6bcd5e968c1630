# SPDX-License-Identifier: GPL-3.0-or-later
"""What the core may know and do: numpy, scipy, itself; no host, no screen, no work at import."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import salcore

ROOT = Path(salcore.__file__).parent
MODULES = sorted(ROOT.rglob("*.py"))
KNOWN = {"numpy", "scipy", *sys.stdlib_module_names}
SILENT = {"logging", "warnings", "sys", "subprocess", "socket", "urllib", "random"}


NAMES = [str(path.relative_to(ROOT)) for path in MODULES]


@pytest.mark.parametrize("path", MODULES, ids=NAMES)
def test_a_module_knows_only_numpy_scipy_and_the_core(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level <= len(path.relative_to(ROOT).parts)  # never out of the core
            names = set() if node.level else {node.module.partition(".")[0]}
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in ("print", "open", "input", "exec", "eval")
            continue
        else:
            continue
        assert names <= KNOWN - SILENT, path.name


def imported(path):
    """Return the folders (or modules of the top floor) of the core that a module imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.relative_to(ROOT).parent.parts
            yield from [".".join([*folder[: len(folder) - node.level + 1], node.module or ""])]


BELOW = {
    "arrays": set(),
    "input": {"arrays"},
    "method": {"arrays", "input"},
    "measure": {"arrays", "input", "method"},
    "decimation": {"arrays", "input", "method", "measure"},
}
EVERYWHERE = {"errors", "parameter", "parameters", "progress"}


@pytest.mark.parametrize("folder", BELOW)
def test_imports_never_run_upwards(folder):
    for path in (ROOT / folder).glob("*.py"):
        floors = {name.partition(".")[0] for name in imported(path)}
        assert floors <= BELOW[folder] | EVERYWHERE | {folder}, path.name


def test_no_function_of_the_core_is_a_generator():
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                yields = any(isinstance(n, ast.Yield | ast.YieldFrom) for n in ast.walk(node))
                manager = any("contextmanager" in ast.dump(d) for d in node.decorator_list)
                assert not yields or manager, f"{path.name}: {node.name}"


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
        "points = numpy.random.default_rng(0).random((40000, 3))\n"
        "calls = iter([True] * 6 + [False])\n"
        "try: salcore.analyze(points, progress=lambda *_: next(calls))\n"
        "except salcore.Cancelled: pass\n"
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
