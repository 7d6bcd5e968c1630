# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplification of point clouds and meshes that keeps what is salient.

Geometry goes in, indices come out: nothing is moved, rounded or lost, and hosts gather their own
attributes. See `analyze`, `simplify` and `Parameters`.
"""

from .analysis import Analysis
from .colors import region_colors, saliency_colors
from .distances import Surface
from .errors import Cancelled, GeometryError, MemoryLimitError, ParameterError, SalcoreError
from .memory import estimated_memory
from .metrics import Deviation, Errors, compare, compare_steps, make_surface
from .parameter import Parameter
from .parameters import PRESETS, TABLE, TARGETS, Parameters
from .pipeline import analysis_steps, analyze, simplify
from .progress import Progress, run
from .ranking import Ranking
from .result import Report, Simplification
from .wishes import find_seams

__all__ = [
    "PRESETS",
    "TABLE",
    "TARGETS",
    "Analysis",
    "Cancelled",
    "Deviation",
    "Errors",
    "GeometryError",
    "MemoryLimitError",
    "Parameter",
    "ParameterError",
    "Parameters",
    "Progress",
    "Ranking",
    "Report",
    "SalcoreError",
    "Simplification",
    "Surface",
    "analysis_steps",
    "analyze",
    "compare",
    "compare_steps",
    "estimated_memory",
    "find_seams",
    "make_surface",
    "region_colors",
    "run",
    "saliency_colors",
    "simplify",
]

__version__ = "0.1.0"
