# SPDX-License-Identifier: GPL-3.0-or-later
"""Command-line options that follow from the table of parameters, for the commands of the hosts."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

from .parameters import TARGETS, Parameter


def add_option(parser: argparse._ActionsContainer, row: Parameter) -> None:
    """Add the option of one parameter or target, such as ``--deviation-threshold``.

    Its value is None if it is not given, so that the preset's holds; see `given_options`. Bounds
    are left to `Parameters`, whose errors name the remedy.

    Parameters
    ----------
    parser : argparse.ArgumentParser or one of its groups
    row : Parameter
        Row of `TABLE` or `TARGETS`.
    """
    sentences = [row.sentence]
    if row.symbol:
        sentences.append(f"Paper: {row.symbol}.")
    if row not in TARGETS:
        sentences.append(f"Default: {row.default}.")
    option: dict[str, Any] = {
        "dest": row.name,
        "default": None,
        "help": " ".join(sentences).replace("%", "%%"),
    }
    if row.type is bool:
        option["action"] = argparse.BooleanOptionalAction
    elif row.type is str:
        option["choices"] = row.choices
    else:
        option |= {"type": row.type, "metavar": row.unit.upper() or "N"}
    parser.add_argument("--" + row.name.replace("_", "-"), **option)


def given_options(options: argparse.Namespace, rows: Iterable[Parameter]) -> dict[str, Any]:
    """Return the values that were given on the command line, by the names of their rows.

    Parameters
    ----------
    options : argparse.Namespace
        As parsed by a parser that has an option for each row.
    rows : iterable of Parameter

    Returns
    -------
    dict
        Without the options that were not given.
    """
    values = {row.name: getattr(options, row.name) for row in rows}
    return {name: value for name, value in values.items() if value is not None}
