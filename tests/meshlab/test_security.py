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
PACKAGING = "blender_addon/package.py"
"""It runs pip and Blender's own builder, for developers, and is not part of the extension."""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_network_no_shell_no_code_from_files(path):
    starters = set() if path == ROOT / PACKAGING else STARTERS
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
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            assert (node.value.id != "os") or node.attr not in OF_OS
        if isinstance(node, ast.keyword) and node.arg in ("shell", "allow_pickle"):
            assert isinstance(node.value, ast.Constant)
            assert not node.value.value
