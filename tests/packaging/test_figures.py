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
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "tasks").glob("*.md")),
]
UNIT = r"\s?(?:%|‰|s|GB|MB|kB|bytes|seconds|minutes|hours|times|points|triangles|faces)\b|\s?[%‰]"
NUMBER = re.compile(rf"(?<![\w.])\d[\d,]*(?:\.\d+)?(?={UNIT})|(?<![\w.])\d[\d,]*\.\d+(?![\w.])")
NOT_PROSE = (
    r"^```.*?^```",  # commands
    r"`[^`\n]*`",  # names
    r"\]\([^)]*\)",  # where links lead
    r"<!-- (\w+) -->.*?<!-- end of \1 -->",  # tables that the code writes
)
GIVEN = {
    # Not measured: settings, bounds, constants of the method, versions, what the paper prints.
}


def numbers(text: str) -> set[str]:
    """Return the numbers of a text that have a unit or a decimal point, as they stand there."""
    text = re.sub(r"(?<=\d)[  ](?=\d{3}\b)", ",", text)
    return {number.rstrip(",") for number in NUMBER.findall(text)}


def prose(page: Path) -> str:
    """Return a page's text without what is no prose."""
    text = page.read_text(encoding="utf-8")
    for pattern in NOT_PROSE:
        text = re.sub(pattern, " ", text, flags=re.MULTILINE | re.DOTALL)
    return text


def test_all_figures_are_of_one_build():
    cores = {path.name: set(re.findall(r"core (\w{10})", path.read_text())) for path in MEASURED}
    assert all(len(found) == 1 for found in cores.values()), cores
    assert len(set.union(*cores.values())) == 1, cores


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_figure_without_a_measurement(page):
    measured = set().union(
        *(re.findall(r"\d[\d,]*(?:\.\d+)?", path.read_text(encoding="utf-8")) for path in MEASURED)
    )
    given = GIVEN.get(page.relative_to(ROOT).as_posix(), "").split()
    unknown = numbers(prose(page)) - measured - set(given)
    assert not unknown, f"{sorted(unknown)}: write what measures them, or name them in GIVEN"
    assert not set(given) - numbers(prose(page)), "no longer on the page"


def test_tables_of_figures_are_the_files():
    for name, found in tables.blocks().items():
        page = (ROOT / name).read_text(encoding="utf-8")
        assert tables.with_tables(page, found) == page, "run python -m docs.tables"
