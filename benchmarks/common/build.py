# SPDX-License-Identifier: GPL-3.0-or-later
"""What was measured, where and when: every file of figures says so."""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import salcore
from benchmarks.common.models import ROOT

Build = dict[str, str]


def build() -> Build:
    """Return the version, commit and core that are measured, the machine and the day.

    The core is a digest of the code of `salcore`: files of figures with the same one are of one
    build, whatever was committed beside the core, or worded otherwise in it, in between.
    """
    return {
        "version": salcore.__version__,
        "commit": _commit(),
        "core": core(),
        "machine": f"{os.cpu_count()} processors ({processor()}), {platform.system()}",
        "python": platform.python_version(),
        "date": datetime.now(UTC).date().isoformat(),
    }


def said(build: Build) -> str:
    """Return where figures come from, as a sentence."""
    return (
        f"Measured on {build['date']} with version {build['version']} (commit {build['commit']}, "
        f"core {build['core']}) by Python {build['python']} on {build['machine']}."
    )


def core() -> str:
    """Return a digest of the core's code, without comments, docstrings and messages.

    The same code has another digest under another Python, for syntax trees differ.
    """
    digest = hashlib.sha256()
    for path in sorted((ROOT / "salcore").rglob("*.py")):
        tree = Wordless().visit(ast.parse(path.read_text(encoding="utf-8")))
        digest.update(f"{path.relative_to(ROOT).as_posix()}\n{ast.dump(tree)}\n".encode())
    return digest.hexdigest()[:10]


class Wordless(ast.NodeTransformer):
    """Takes sentences out of a syntax tree: texts with a space, and texts that are put together."""

    def visit_Constant(self, node: ast.Constant) -> ast.Constant:
        if isinstance(node.value, str) and " " in node.value:
            return ast.Constant("")
        return node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.Constant:
        return ast.Constant("")


def processor() -> str:
    """Return the processor's name, or its kind where the system does not say."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _commit() -> str:
    """Return the commit, with a plus if files differ from it; "none" outside a repository."""
    try:
        command = ["git", "rev-parse", "--short=10", "HEAD"]
        commit = subprocess.check_output(command, cwd=ROOT, text=True, stderr=subprocess.DEVNULL)
        changed = subprocess.check_output(
            ["git", "status", "--porcelain", "--", "*.py"], cwd=ROOT, text=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "none"
    return commit.strip() + ("+" if changed else "")
