# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages of figures, in Markdown."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from benchmarks.common.build import build, said
from benchmarks.common.models import ROOT, add_models_option

FIGURES = ROOT / "docs" / "figures"


def options(about: str) -> argparse.Namespace:
    """Return what a benchmark is asked for that writes one page: `models` and `figures`."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    add_models_option(parser)
    parser.add_argument("--figures", type=Path, default=FIGURES, help="folder of the page")
    chosen = parser.parse_args()
    chosen.figures.mkdir(parents=True, exist_ok=True)
    return chosen


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table; its first column is text, the others are figures."""
    head = list(head)
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def write(path: Path, title: str, module: str, *parts: str, models: bool = True) -> None:
    """Write a page that says which module made it, of which build; `models`: from a folder."""
    command = f"python -m {module}" + " --models FOLDER" * models
    how = f"`{command}` writes this page. {said(build())}"
    path.write_text("\n\n".join([f"# {title}", how, *parts]) + "\n", encoding="utf-8")
