# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplification of point clouds and meshes that keeps what is salient.

Geometry goes in, indices come out: nothing is moved, rounded or lost, and hosts gather their own
attributes. See `analyze`, `simplify` and `Parameters`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .analysis import Analysis
    from .carrying import carry_corners, carry_points
    from .colors import region_colors, saliency_colors
    from .decimation.cut import Ranking
    from .errors import Cancelled, GeometryError, MemoryLimitError, ParameterError, SalcoreError
    from .input.memory import estimated_memory
    from .input.seams import find_seams
    from .maps import Maps
    from .measure.distances import Surface
    from .measure.errors import Deviation, Errors, compare, make_surface
    from .method.segmentation import RegionTable
    from .parameters import PRESETS, TABLE, TARGETS, Parameter, Parameters
    from .pipeline import analyze, simplify
    from .report import Report
    from .simplification import Simplification

__all__ = [
    "PRESETS",
    "TABLE",
    "TARGETS",
    "Analysis",
    "Cancelled",
    "Deviation",
    "Errors",
    "GeometryError",
    "Maps",
    "MemoryLimitError",
    "Parameter",
    "ParameterError",
    "Parameters",
    "Ranking",
    "RegionTable",
    "Report",
    "SalcoreError",
    "Simplification",
    "Surface",
    "analyze",
    "carry_corners",
    "carry_points",
    "compare",
    "estimated_memory",
    "find_seams",
    "make_surface",
    "region_colors",
    "saliency_colors",
    "simplify",
]

__version__ = "0.2.0"

_HOMES = {
    "analysis": "Analysis",
    "carrying": "carry_corners carry_points",
    "colors": "region_colors saliency_colors",
    "decimation.cut": "Ranking",
    "errors": "Cancelled GeometryError MemoryLimitError ParameterError SalcoreError",
    "input.memory": "estimated_memory",
    "input.seams": "find_seams",
    "maps": "Maps",
    "measure.distances": "Surface",
    "measure.errors": "Deviation Errors compare make_surface",
    "method.segmentation": "RegionTable",
    "parameters": "PRESETS TABLE TARGETS Parameter Parameters",
    "pipeline": "analyze simplify",
    "report": "Report",
    "simplification": "Simplification",
}
"""Modules and their public names. They are imported when asked for: a command's help, and Blender's
start, need the table of parameters, but not scipy."""


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names.split():
            value = globals()[name] = getattr(import_module(f".{home}", __name__), name)
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
