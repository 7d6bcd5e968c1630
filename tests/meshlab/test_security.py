# SPDX-License-Identifier: GPL-3.0-or-later
"""What the software does not do, read from its source."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = sorted(
    path for folder in ("salcore", "meshlab_filter", "blender_addon")
    for path in (ROOT / folder).rglob("*.py")
)  # fmt: skip
STARTERS = {"subprocess", "multiprocessing", "pty", "ctypes"}
NETWORK = {"socket", "urllib", "http", "ssl", "ftplib", "smtplib", "asyncio", "requests"}
CODE = {"pickle", "marshal", "shelve", "dill", "joblib"}
CALLS = {"eval", "exec", "compile", "__import__"}
OF_OS = {"system", "popen", "startfile", "spawnl", "spawnv", "execv", "execl", "execvp", "execve"}
ALLOWED = {
    # Run pip and Blender's own builder, for developers; not part of the extension.
    "blender_addon/packaging/package.py": {"subprocess"},
    # Start Blender's own Python, and talk to it in bytes through a local socket.
    "blender_addon/worker/host.py": {"subprocess", "multiprocessing"},
    "blender_addon/worker/child.py": {"multiprocessing"},
    # Starts Blender without a window, which bakes.
    "blender_addon/geometry/baking.py": {"subprocess"},
    # Runs its own stages in a pool of processes.
    "meshlab_filter/large/workers.py": {"multiprocessing"},
}
"""The only modules that start a program."""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_network_no_shell_no_code_from_files(path):
    starters = STARTERS - ALLOWED.get(path.relative_to(ROOT).as_posix(), set())
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported = {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            imported = {str(node.module).partition(".")[0]}
        else:
            imported = set()
        assert not imported & (starters | NETWORK | CODE)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in CALLS
        if isinstance(node, ast.Attribute):
            assert node.attr != "recv"  # of a connection: it unpickles
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            assert (node.value.id != "os") or node.attr not in OF_OS
        if isinstance(node, ast.keyword) and node.arg in ("shell", "allow_pickle"):
            assert isinstance(node.value, ast.Constant)
            assert not node.value.value
