# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of parameters: everything that reads, checks or shows a parameter reads it here.

The fields of `Parameters` *are* the table. Each carries a `Parameter` row with its bounds, unit,
paper symbol, value in the preset "paper" and a sentence for people; command-line options, MeshLab
parameters, Blender properties and the README's table are generated from the rows.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from .errors import ParameterError
from .parameter import Parameter, shown

_ROW = "row"


def _row(default: Any, label: str, sentence: str, *, paper: Any = None, **row: Any) -> Any:
    """Make a dataclass field that carries its row of the table; the name follows later."""
    row |= {
        "label": label,
        "type": type(default),
        "default": default,
        "paper": default if paper is None else paper,
        "sentence": sentence,
    }
    return field(default=default, metadata={_ROW: row})


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """All parameters of an analysis, checked when made; `dataclasses.replace` makes variants.

    Raises
    ------
    ParameterError
        If a value has the wrong type, is out of bounds or is not among the choices.
    """

    invalid: str = _row(
        "drop",
        "Invalid points",
        "Drop points with NaN or infinite coordinates, or refuse the whole input.",
        choices=("drop", "refuse"),
        group="Input",
    )
    graph: str = _row(
        "surface",
        "Graph",
        "Neighbours: edges of the mesh, or of tangent-plane Delaunay stars on a cloud (surface); "
        "or edges of the 3D Delaunay triangulation, which ignores faces (delaunay).",
        paper="delaunay",
        choices=("surface", "delaunay"),
        symbol="§2.1",
        group="Graph",
    )
    neighbors: int = _row(
        16,
        "Nearest neighbours",
        "Nearest points among which the star of a cloud's point is sought.",
        minimum=4,
        maximum=64,
        group="Graph",
    )
    level: int = _row(
        1,
        "Level",
        "Rings of neighbours that make a neighbourhood; more smooths noise and small features.",
        minimum=1,
        maximum=8,
        unit="rings",
        symbol="k",
        group="Graph",
    )
    normals: str = _row(
        "best",
        "Normals",
        "Take the given normals, else those of the faces, else fit planes (best); "
        "or always fit planes (pca).",
        paper="pca",
        choices=("best", "pca"),
        symbol="(2.1) (2.2)",
        group="Normals",
    )
    cells: int = _row(
        8,
        "Patch cells",
        "Cells along each side of the square patch round a point.",
        minimum=1,
        maximum=32,
        symbol="n",
        group="Saliency",
    )
    angle: str = _row(
        "auto",
        "Angle",
        "Angle between normals: of vectors (oriented), of lines (unoriented), of vectors where "
        "neighbours rarely disagree (auto), or with the squared product as printed (squared). "
        "Fitted normals have no sign and always count as lines.",
        paper="squared",
        choices=("auto", "oriented", "unoriented", "squared"),
        symbol="(3.2)",
        group="Saliency",
    )
    whole_percent: bool = _row(
        False,
        "Whole per cent",
        "Cut the deviation factor down to whole per cent.",
        paper=True,
        symbol="(3.3)",
        group="Saliency",
    )
    deviation_threshold: float = _row(
        9.0,
        "Deviation threshold",
        "Deviation factor from which a neighbour counts as deviating; 1 % is 3.6 degrees.",
        minimum=0.0,
        maximum=50.0,
        unit="%",
        symbol="x",
        group="Saliency",
    )
    counting: str = _row(
        "ramp",
        "Counting",
        "A neighbour counts by its share of the threshold, up to one (ramp), or only above it "
        "(step).",
        paper="step",
        choices=("ramp", "step"),
        symbol="C_x (3.6)",
        group="Saliency",
    )
    dissimilarity: str = _row(
        "share",
        "Dissimilarity",
        "Measure of a patch: the share of deviating neighbours, or that share's entropy.",
        paper="entropy",
        choices=("share", "entropy"),
        symbol="(3.7)",
        group="Saliency",
    )
    contrast: str = _row(
        "level",
        "Contrast",
        "A patch is salient by how dissimilar the patches round it are (level), or by how much "
        "they differ from it, times their height over its plane (difference).",
        paper="difference",
        choices=("level", "difference"),
        symbol="(3.8)",
        group="Saliency",
    )
    averaging: str = _row(
        "weighted",
        "Averaging",
        "Divide the sum of weighted patch saliencies by the weights (weighted), or by the number "
        "of neighbours (plain).",
        paper="plain",
        choices=("weighted", "plain"),
        symbol="(3.9)",
        group="Saliency",
    )
    scaling: str = _row(
        "percentile",
        "Scaling",
        "Bring saliency to [0, 1] by its 1st and 99th percentile, or by its least and largest "
        "value (range).",
        paper="range",
        choices=("percentile", "range"),
        symbol="(3.9)",
        group="Saliency",
    )
    tolerance: float = _row(
        0.08,
        "Tolerance",
        "Largest difference in saliency between neighbours of one region.",
        paper=0.00874,
        minimum=0.0,
        maximum=1.0,
        symbol="σ (4.1)",
        group="Regions",
    )
    collinear_angle: float = _row(
        60.0,
        "Collinear angle",
        "Turn along a region's boundary up to which its points count as collinear.",
        paper=0.0,
        minimum=0.0,
        maximum=180.0,
        unit="degrees",
        symbol="(4.4)",
        group="Interest points",
    )
    alpha_rule: str = _row(
        "add",
        "Rule of α",
        "Raise the mean saliency by α hundredths (add) or by α per cent of itself (multiply).",
        paper="multiply",
        choices=("add", "multiply"),
        symbol="(4.7)",
        group="Interest points",
    )
    max_gap: int = _row(
        1,
        "Largest gap",
        "No removed point is more rings away from a kept one than this; 0 turns the guard off.",
        paper=0,
        minimum=0,
        maximum=64,
        unit="rings",
        group="Interest points",
    )
    detail: float = _row(
        3.0,
        "Detail",
        "Weight of saliency in the order of elimination: more lowers the error on features and "
        "raises it elsewhere; 0 looks at the shape alone.",
        minimum=0.0,
        maximum=100.0,
        group="Elimination",
    )
    interest_weight: float = _row(
        0.0,
        "Interest weight",
        "Further weight of the points on the regions' boundaries in the order of elimination.",
        minimum=0.0,
        maximum=100.0,
        group="Elimination",
    )
    evenness: float = _row(
        0.1,
        "Evenness",
        "Weight of even spacing in the order of elimination, for points that no face uses.",
        minimum=0.0,
        maximum=100.0,
        group="Elimination",
    )
    border_weight: float = _row(
        1.0,
        "Border weight",
        "Weight of open borders and rims against the faces beside them.",
        minimum=0.0,
        maximum=1000.0,
        group="Elimination",
    )
    placement: str = _row(
        "original",
        "Placement",
        "Kept vertices of a mesh stay original points, or move to where the error is least "
        "(optimal).",
        choices=("original", "optimal"),
        group="Elimination",
    )
    error_unit: str = _row(
        "diagonal",
        "Unit of error",
        "Largest error as a share of the bounding box's diagonal, or as a length in the input's "
        "unit.",
        choices=("diagonal", "length"),
        group="Elimination",
    )
    workers: int = _row(
        0,
        "Workers",
        "Threads for the heavy steps; 0 takes one per processor. Results do not depend on it.",
        minimum=0,
        maximum=256,
        group="Run",
    )
    memory_check: bool = _row(
        True,
        "Check memory",
        "Refuse an input that would need more memory than the machine has free.",
        group="Run",
    )

    def __post_init__(self) -> None:
        for row in TABLE:
            object.__setattr__(self, row.name, row.check(getattr(self, row.name)))

    @classmethod
    def preset(cls, name: str) -> Parameters:
        """Return the preset "default" or "paper" (the formulas as printed; see docs/method.md).

        Examples
        --------
        >>> import dataclasses, salcore
        >>> paper = salcore.Parameters.preset("paper")
        >>> paper.tolerance, salcore.Parameters().tolerance
        (0.00874, 0.08)
        >>> dataclasses.replace(paper, cells=4).cells
        4
        """
        if not isinstance(name, str) or name not in PRESETS:
            raise ParameterError(f"preset={shown(name)}: choose one of {', '.join(PRESETS)}")
        return cls(**{row.name: getattr(row, name) for row in TABLE})

    def as_dict(self) -> dict[str, Any]:
        """Return names and values, ready for JSON."""
        return dataclasses.asdict(self)


PRESETS = ("default", "paper")


def checked(parameters: Parameters | None) -> Parameters:
    """Return parameters, the default ones for None, or raise `ParameterError`."""
    if parameters is None:
        return Parameters()
    if not isinstance(parameters, Parameters):
        raise ParameterError(
            f"parameters={shown(parameters)}: give Parameters(...), Parameters(**values) for a "
            "dict, or Parameters.preset(name)"
        )
    return parameters


TABLE: tuple[Parameter, ...] = tuple(
    Parameter(name=f.name, **f.metadata[_ROW]) for f in dataclasses.fields(Parameters)
)

TARGETS: tuple[Parameter, ...] = (
    Parameter(
        name="ratio",
        label="Ratio",
        type=float,
        default=0.1,
        paper=0.1,
        minimum=0.0,
        maximum=1.0,
        group="Target",
        sentence="Share of the points to keep, exact to the point.",
    ),
    Parameter(
        name="count",
        label="Count",
        type=int,
        default=10000,
        paper=10000,
        minimum=1,
        maximum=2**31 - 1,
        group="Target",
        sentence="Number of points to keep, exact to the point.",
    ),
    Parameter(
        name="max_error",
        label="Largest error",
        type=float,
        default=0.001,
        paper=0.001,
        minimum=0.0,
        maximum=1e300,
        group="Target",
        sentence="About the fewest points whose surface is nowhere further from an input point; "
        "a share of the diagonal, or a length (unit of error).",
    ),
    Parameter(
        name="alpha",
        label="Threshold α",
        type=float,
        default=0.0,
        paper=0.0,
        minimum=0.0,
        maximum=1000.0,
        unit="%",
        symbol="α (4.7)",
        group="Target",
        sentence="Points whose saliency exceeds the mean by this much are kept; "
        "more keeps fewer points.",
    ),
)
"""What a simplification can be asked for; exactly one target is given at a time."""
