# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the tables of parameters and formats into the README, from those in the code.

python docs/tables.py
"""

from __future__ import annotations

from pathlib import Path

from meshlab_filter.io.formats import FORMATS, MESHLAB
from salcore import TABLE, TARGETS, Parameter

README = Path(__file__).parent.parent / "README.md"
BEGIN, END = "<!-- parameters -->\n", "<!-- end of parameters -->"
FORMATS_BEGIN, FORMATS_END = "<!-- formats -->\n", "<!-- end of formats -->"


def cell(row: Parameter, value: object) -> str:
    """Return a value as the table shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    unit = f" {row.unit}" if row.unit else ""
    return f"{value:g}{unit}" if isinstance(value, (int, float)) else str(value)


def parameter_table() -> str:
    """Return all targets and parameters as a table in Markdown."""
    lines = [
        "| parameter | paper | default | preset paper | what it does |",
        "|---|---|---|---|---|",
    ]
    for row in (*TARGETS, *TABLE):
        default = "" if row in TARGETS else cell(row, row.default)
        paper = "" if row in TARGETS else cell(row, row.paper)
        lines.append(f"| `{row.name}` | {row.symbol} | {default} | {paper} | {row.sentence} |")
    return "\n".join(lines) + "\n"


def format_table() -> str:
    """Return all formats as a table in Markdown."""
    lines = [
        "| files | read | written | what travels | what the format cannot hold |",
        "|---|---|---|---|---|",
    ]
    for row in FORMATS:
        how = [
            "no" if name is None else "by MeshLab" if name == MESHLAB else "yes"
            for name in (row.read, row.write)
        ]
        lines.append(
            f"| {' '.join(row.endings)} | {how[0]} | {how[1]} | {row.keeps} | {row.lost} |"
        )
    return "\n".join(lines) + "\n"


def with_table(text: str) -> str:
    """Return the README's text with the present tables between their markers."""
    for begin, table, end in (
        (BEGIN, parameter_table(), END),
        (FORMATS_BEGIN, format_table(), FORMATS_END),
    ):
        before, rest = text.split(begin)
        text = before + begin + table + end + rest.split(end)[1]
    return text


if __name__ == "__main__":
    README.write_text(with_table(README.read_text(encoding="utf-8")), encoding="utf-8")
