# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplification of point clouds and meshes that keeps what is salient.

Geometry goes in, indices come out: nothing is moved, rounded or lost, and hosts gather their own
attributes. See `analyze`, `simplify` and `Parameters`.
"""

from .analysis import Analysis
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
    "compare",
    "estimated_memory",
    "find_seams",
    "make_surface",
    "region_colors",
    "saliency_colors",
    "simplify",
]

__version__ = "0.1.0"
