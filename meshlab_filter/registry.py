# SPDX-License-Identifier: GPL-3.0-or-later
"""Filters by name, with their parameters, as `MeshSet.apply_filter` knows MeshLab's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import salcore

from .parameters import closest, meshlab_name

Filter = Callable[..., dict[str, Any]]

_FILTERS: dict[str, Filter] = {}
_DEFAULTS: dict[str, dict[str, Any]] = {}
"""The parameters of every filter."""


def registered(**defaults: Any) -> Callable[[Filter], Filter]:
    """Register a filter with the defaults of its parameters."""

    def register(function: Filter) -> Filter:
        _FILTERS[function.__name__] = function
        _DEFAULTS[function.__name__] = defaults
        return function

    return register


def filter_list() -> list[str]:
    """Return the names of all filters."""
    return sorted(_FILTERS)


def filter_parameter_values(name: str) -> dict[str, Any]:
    """Return the parameters of a filter with their defaults; None stands for no default."""
    _check_filter(name)
    return dict(_DEFAULTS[name])


def apply(mesh_set: Any, name: str, **parameters: Any) -> dict[str, Any]:
    """Apply a filter by name, as `MeshSet.apply_filter` does.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    name : str
        One of `filter_list`.
    **parameters
        Those of `filter_parameter_values`, and `progress`.

    Returns
    -------
    dict
        What the filter returns.

    Raises
    ------
    salcore.ParameterError
        If there is no such filter or parameter.
    """
    _check_filter(name)
    names = _DEFAULTS[name]
    for given in parameters:
        if meshlab_name(given) not in names and given != "progress":
            raise salcore.ParameterError(
                f"no parameter {given!r}; {closest(meshlab_name(given), names)}"
            )
    return _FILTERS[name](mesh_set, **parameters)


def _check_filter(name: str) -> None:
    """Refuse a name that no filter has."""
    if name not in _FILTERS:
        raise salcore.ParameterError(f"no filter {name!r}; {closest(name, _FILTERS)}")
