# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the parameters' table into the README, from the table in the code.

python docs/tables.py
"""

from __future__ import annotations

from pathlib import Path

from salcore import TABLE, TARGETS, Parameter

README = Path(__file__).parent.parent / "README.md"
BEGIN, END = "<!-- parameters -->\n", "<!-- end of parameters -->"


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


def with_table(text: str) -> str:
    """Return the README's text with the present table between its markers."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + parameter_table() + END + rest.split(END)[1]


if __name__ == "__main__":
    README.write_text(with_table(README.read_text(encoding="utf-8")), encoding="utf-8")
