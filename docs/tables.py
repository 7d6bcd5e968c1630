# SPDX-License-Identifier: GPL-3.0-or-later
"""Write into README and docs the tables that code and figures hold.

    python -m docs.tables

Parameters and formats are those of the code, figures those of docs/figures/peers.json.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.peers import shares, summary
from meshlab_filter.io.formats import FORMATS, MESHLAB
from salcore import TABLE, TARGETS, Parameter

ROOT = Path(__file__).parent.parent
FIGURES = ROOT / "docs" / "figures"
SIDES = {"kept": summary.KEPT, "moved": summary.MOVED, "clouds": summary.CLOUD}


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


def blocks() -> dict[str, dict[str, str]]:
    """Return, for each page, its tables by the names in their markers."""
    peers = shares.blocks_of(shares.read(FIGURES)["rows"])
    return {
        "README.md": {
            "parameters": parameter_table(),
            "formats": format_table(),
            "peers": summary.in_short(peers) + "\n",
        },
        "docs/evidence.md": {
            f"{name}{kind}": make(peers, side) + "\n"
            for name, side in SIDES.items()
            for kind, make in (("", summary.of_best), (", each", summary.of_each))
        }
        | {"more time": summary.efforts(peers) + "\n"},
    }


def with_tables(text: str, tables: dict[str, str]) -> str:
    """Return a page with the present tables between their markers."""
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, rest = text.split(begin)
        text = before + begin + table + end + rest.split(end)[1]
    return text


if __name__ == "__main__":
    for name, tables in blocks().items():
        page = ROOT / name
        page.write_text(with_tables(page.read_text(encoding="utf-8"), tables), encoding="utf-8")
