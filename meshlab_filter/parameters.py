# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters of salcore by MeshLab's names, for filters and command; knows no MeshLab."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from typing import Any

import salcore

Callback = Callable[[str, float], bool | None]


def meshlab_name(name: str) -> str:
    """Return a parameter's name as MeshLab spells it: without underscores."""
    return name.replace("_", "")


ROWS = {meshlab_name(row.name): row for row in salcore.TABLE}
TARGETS = {meshlab_name(row.name): row for row in salcore.TARGETS}


def make_parameters(preset: str = "default", **values: Any) -> salcore.Parameters:
    """Return the parameters of a preset with some values changed; names may have underscores."""
    rows = {name: row.name for name, row in ROWS.items()}
    changed = {}
    for name, value in values.items():
        key = meshlab_name(name)
        if key not in rows:
            raise salcore.ParameterError(f"no parameter {name!r}; {closest(key, rows)}")
        changed[rows[key]] = value
    return salcore.Parameters(**(salcore.Parameters.preset(preset).as_dict() | changed))


def closest(name: str, names: Any) -> str:
    """Return the remedy for a wrong name: the most similar one, or the list of all."""
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return f"did you mean {close[0]}?" if close else f"choose one of {', '.join(sorted(names))}"


def check_not_empty(result: salcore.Simplification) -> None:
    """Refuse a simplification that keeps no point, of which MeshLab makes no layer."""
    if not len(result.indices):
        raise salcore.ParameterError("no point would be kept: give a target that keeps more")
