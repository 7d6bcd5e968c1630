# SPDX-License-Identifier: GPL-3.0-or-later
"""Salient Simplify for MeshLab: filters on a `pymeshlab.MeshSet`, and a command for files."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .filters import (
        apply,
        compute_scalar_by_saliency_per_vertex,
        compute_scalar_by_saliency_region_per_vertex,
        compute_selection_by_interest_points_per_vertex,
        filter_list,
        filter_parameter_values,
        generate_simplified_point_cloud_by_saliency,
        get_simplification_error,
        meshing_decimation_by_saliency,
    )

__all__ = [
    "apply",
    "compute_scalar_by_saliency_per_vertex",
    "compute_scalar_by_saliency_region_per_vertex",
    "compute_selection_by_interest_points_per_vertex",
    "filter_list",
    "filter_parameter_values",
    "generate_simplified_point_cloud_by_saliency",
    "get_simplification_error",
    "meshing_decimation_by_saliency",
]


def __getattr__(name: str) -> Any:
    """Import the filters on first use: the command must start without a delay."""
    if name in __all__:
        from . import filters

        return getattr(filters, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
