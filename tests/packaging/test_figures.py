# SPDX-License-Identifier: GPL-3.0-or-later
"""Every figure in the README and the documentation stands in a file that a measurement wrote."""

import re
from pathlib import Path

import pytest

from docs import tables

ROOT = Path(__file__).parents[2]
MEASURED = sorted((ROOT / "docs" / "figures").glob("*.md"))
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("[!p]*.md")),  # parameters.md is made from the code
    *sorted((ROOT / "docs" / "tasks").glob("*.md")),
]
UNIT = r"\s?(?:%|‰|s|GB|MB|kB|bytes|seconds|minutes|hours|times|points|triangles|faces)\b|\s?[%‰]"
NUMBER = re.compile(rf"(?<![\w.])\d[\d,]*(?:\.\d+)?(?={UNIT})|(?<![\w.])\d[\d,]*\.\d+(?![\w.])")
NOT_PROSE = (
    r"^```.*?^```",  # commands
    r"`[^`\n]*`",  # names
    r"\]\([^)]*\)",  # where links lead
    r"\((?:\d\.\d+[, )]*(?:to |and )?)+|§\d\.\d",  # the paper's equations and sections
    r"<!-- ([\w, ]+) -->.*?<!-- end of \1 -->",  # tables that the code writes
)
GIVEN = {
    "README.md": "0.5 2 5 10 4.0 3.0 3.11 31 4 4.5 5.2",
    "docs/elimination.md": "0.01 0.02 0.3 1.5 2",
    "docs/evidence.md": "2 10",
    "docs/index.md": "0.125 0.5 1 2 10 88200",
    "docs/large-scans.md": "0.3 0.5 0.8 1 1.1 1.5 5 6 10 16 20 35 50 55 90 140 200 350 900",
    "docs/limits.md": "65535",
    "docs/method.md": "0.00874 0.08 0.1 0.125 0.9 1 2 3.2",
    "docs/tasks/guide.md": "20",
    "docs/tasks/settings.md": "4.0",
}
"""What is no measurement, for each page: settings, bounds, constants, versions, the paper's."""

LATER = {"saliency.md"}
"""Measured after a change of the regions alone, which no other page works out."""


def numbers(text: str) -> set[str]:
    """Return the numbers of a text that have a unit or a decimal point, as they stand there."""
    text = re.sub(r"(?<=\d)[  ](?=\d{3}\b)", "", text)
    return {number.replace(",", "") for number in NUMBER.findall(text)}


def sections(page: Path) -> list[tuple[str, set[str]]]:
    """Return the prose of each section of a page, and the numbers in the files that it links to."""
    found = []
    for section in re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE):
        files = {path for path in MEASURED if f"figures/{path.name}" in section}
        for pattern in NOT_PROSE:
            section = re.sub(pattern, " ", section, flags=re.MULTILINE | re.DOTALL)
        texts = (path.read_text(encoding="utf-8") for path in files)
        measured = (re.findall(r"\d[\d,]*(?:\.\d+)?", text) for text in texts)
        found.append((section, {figure.replace(",", "") for each in measured for figure in each}))
    return found


def test_all_figures_are_of_one_build():
    cores = {path.name: set(re.findall(r"core (\w{10})", path.read_text())) for path in MEASURED}
    assert all(len(found) == 1 for found in cores.values()), cores
    assert len(set.union(*(cores[name] for name in cores.keys() - LATER))) == 1, cores


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_figure_without_a_measurement(page):
    given = set(GIVEN.get(page.relative_to(ROOT).as_posix(), "").split())
    everything = set()
    for text, measured in sections(page):
        unknown = numbers(text) - measured - given
        heading = text.splitlines()[0]
        assert not unknown, f"{heading}: {sorted(unknown)}: link what measures them, or see GIVEN"
        everything |= numbers(text)
    assert not given - everything, "no longer on the page"


def test_the_tables_are_those_of_the_code_and_of_the_files():
    for name, found in tables.blocks().items():
        page = (ROOT / name).read_text(encoding="utf-8")
        assert tables.with_tables(page, found) == page, "run python -m docs.tables"
