# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of parameters: everything that reads, checks or shows a parameter reads it here.

The fields of `Parameters` *are* the table. Each carries a `Parameter` row with its bounds, unit,
paper symbol, value in the preset "paper" and a sentence for people; command-line options, MeshLab
parameters, Blender properties and the README's table are generated from the rows.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
import reprlib
from dataclasses import dataclass, field
from typing import Any

from .errors import ParameterError

ABOVE_ZERO = 1e-9
"""Minimum of what must not be zero."""
UNBOUNDED = 2**31 - 1
"""Maximum of what has none but a number's own; messages leave it out."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One row of the table.

    Attributes
    ----------
    name, label : str
        The Python name, and the words a user interface shows.
    type : type
        `bool`, `int`, `float` or `str`; a `str` parameter has `choices`.
    default, paper : bool, int, float or str
        Values in the presets "default" and "paper".
    minimum, maximum : float
        Inclusive bounds of a number.
    choices : tuple of str
        Allowed values of a `str` parameter.
    unit : str
        Unit of a number; empty for counts, shares and choices.
    symbol : str
        The paper's symbol or equation number; empty for our extensions.
    group : str
        The stage the parameter belongs to, in the paper's order.
    sentence : str
        What the value does, for tooltips and help.
    """

    name: str
    label: str
    type: type
    default: Any
    paper: Any
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()
    unit: str = ""
    symbol: str = ""
    group: str = ""
    sentence: str = ""

    def check(self, value: Any) -> Any:
        """Return `value` as this parameter's type, or raise `ParameterError`."""
        if self.type is str:
            if not isinstance(value, str) or value not in self.choices:
                raise self._error(value, f"choose one of {', '.join(self.choices)}")
            return str(value)
        if self.type is bool:
            scalar = isinstance(value, numbers.Real) or getattr(value, "shape", None) == ()
            if not scalar or value not in (True, False):
                raise self._error(value, "give True or False")
            return bool(value)
        kind = "a whole number" if self.type is int else "a number"
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise self._error(value, f"give {kind}")
        try:
            number = float(value)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if self.type is int and math.isfinite(number) and not number.is_integer():
            raise self._error(value, "give a whole number")
        if not self.minimum <= number <= self.maximum:
            raise self._error(value, f"give {kind} {self._range(number)}")
        return self.type(value)

    def _range(self, number: float) -> str:
        low = "above 0" if self.minimum == ABOVE_ZERO else f"from {self.minimum:g}"
        if self.maximum < UNBOUNDED or number > self.maximum:
            return f"{low} to {self.maximum:.10g}"
        return f"{low} upwards"

    def _error(self, value: Any, remedy: str) -> ParameterError:
        return ParameterError(f"{self.name}={shown(value)}: {remedy}")


def shown(value: Any) -> str:
    """Return a value as a message shows it: short, whatever it is."""
    try:
        return reprlib.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return f"<{type(value).__name__}>"


_ROW = "row"


def _row(
    group: str, default: Any, label: str, *, sentence: str, paper: Any = None, **row: Any
) -> Any:
    """Make a dataclass field that carries its row of the table; the name follows later."""
    row |= {
        "group": group,
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

    # fmt: off
    invalid: str = _row("Input", "drop", "Invalid points", choices=("drop", "refuse"),
        sentence="Drop points with NaN or infinite coordinates, or refuse the whole input.")
    graph: str = _row("Graph", "surface", "Graph", paper="delaunay",
        choices=("surface", "delaunay"), symbol="§2.1",
        sentence="Neighbours: edges of the mesh, or of tangent-plane Delaunay stars on a cloud "
        "(surface); or edges of the 3D Delaunay triangulation, which ignores faces (delaunay).")
    neighbors: int = _row("Graph", 16, "Nearest neighbours", minimum=4, maximum=64,
        sentence="Nearest points among which the star of a cloud's point is sought; more bridges "
        "wider gaps, and takes longer.")
    level: int = _row("Graph", 1, "Level", minimum=1, maximum=8, unit="rings", symbol="k",
        sentence="Rings of neighbours that make a neighbourhood; more smooths noise and small "
        "features.")
    normals: str = _row("Normals", "best", "Normals", paper="pca", choices=("best", "pca"),
        symbol="(2.1) (2.2)",
        sentence="Take the given normals, else those of the faces, else fit planes (best); or "
        "always fit planes (pca).")
    cells: int = _row("Saliency", 8, "Patch cells", minimum=1, maximum=32, symbol="n",
        sentence="Cells along each side of the square patch round a point, at the neighbours' "
        "distance alone; more tells finer detail apart.")
    angle: str = _row("Saliency", "auto", "Angle", paper="squared",
        choices=("auto", "oriented", "unoriented", "squared"), symbol="(3.2)",
        sentence="Angle between normals: of vectors (oriented), of lines (unoriented), of vectors "
        "where neighbours rarely disagree (auto), or with the squared product as printed "
        "(squared). Fitted normals have no sign and always count as lines.")
    whole_percent: bool = _row("Saliency", False, "Whole per cent", paper=True, symbol="(3.3)",
        sentence="Cut the deviation factor down to whole per cent.")
    deviation_threshold: float = _row("Saliency", 9.0, "Deviation threshold", minimum=0.0,
        maximum=50.0, unit="%", symbol="x",
        sentence="Deviation factor from which a neighbour counts as deviating; 1 % is 3.6 "
        "degrees. More leaves gentle bends out.")
    counting: str = _row("Saliency", "ramp", "Counting", paper="step", choices=("ramp", "step"),
        symbol="C_x (3.6)",
        sentence="A neighbour counts by its share of the threshold, up to one (ramp), or only "
        "above it (step).")
    dissimilarity: str = _row("Saliency", "share", "Dissimilarity", paper="entropy",
        choices=("share", "entropy"), symbol="(3.7)",
        sentence="Measure of a patch: the share of deviating neighbours, or that share's entropy.")
    contrast: str = _row("Saliency", "level", "Contrast", paper="difference",
        choices=("level", "difference"), symbol="(3.8)",
        sentence="A patch is salient by how dissimilar the patches round it are (level), or by "
        "how much they differ from it, times their height over its plane (difference).")
    averaging: str = _row("Saliency", "weighted", "Averaging", paper="plain",
        choices=("weighted", "plain"), symbol="(3.9)",
        sentence="Divide the sum of weighted patch saliencies by the weights (weighted), or by "
        "the number of neighbours (plain).")
    scaling: str = _row("Saliency", "percentile", "Scaling", paper="range",
        choices=("percentile", "range"), symbol="(3.9)",
        sentence="Bring saliency to [0, 1] by its 1st and 99th percentile, or by its least and "
        "largest value (range).")
    coarsest: float = _row("Saliency", 1.0, "Coarsest scale", paper=0.0, minimum=0.0,
        maximum=1e300,
        sentence="Largest scale that saliency is measured at, in per cent of the diagonal or as a "
        "length (unit of scales): more finds larger features; 0 measures at the neighbours' "
        "distance alone.")
    finest: float = _row("Saliency", 0.125, "Finest scale", minimum=0.0, maximum=1e300,
        sentence="Smallest scale that saliency is measured at, however dense the points are; "
        "more leaves small features out.")
    scale_unit: str = _row("Saliency", "diagonal", "Unit of scales",
        choices=("diagonal", "length"),
        sentence="Scales in per cent of the bounding box's diagonal, or as a length in the input's "
        "unit.")
    segmentation: str = _row("Regions", "islands", "Regions", paper="components",
        choices=("islands", "basins", "components"), symbol="§4.1",
        sentence="Regions of like saliency that a border is worth (islands: eyes, mouth, hair), "
        "regions that ridges of saliency enclose (basins: the faces of a part), or connected "
        "points of like saliency (components, as published).")
    region_contrast: float = _row("Regions", 0.25, "Contrast of islands", minimum=0.0, maximum=1.0,
        sentence="Difference in saliency from which an island of their size stands apart; more "
        "gives fewer islands.")
    region_size: float = _row("Regions", 1.0, "Size of islands", minimum=0.0, maximum=100.0,
        unit="%",
        sentence="Size, in per cent of the diagonal, from which an island of their contrast stands "
        "apart; more gives fewer islands.")
    persistence: float = _row("Regions", 0.17, "Depth of basins", minimum=0.0, maximum=1.0,
        sentence="Depth in saliency from which a basin stays apart; more gives fewer basins.")
    tolerance: float = _row("Regions", 0.08, "Tolerance", paper=0.00874, minimum=0.0, maximum=1.0,
        symbol="σ (4.1)",
        sentence="Largest difference in saliency between neighbours of one component, which the "
        "threshold α uses; more gives larger components.")
    collinear_angle: float = _row("Interest points", 60.0, "Collinear angle", paper=0.0,
        minimum=0.0, maximum=180.0, unit="degrees", symbol="(4.4)",
        sentence="Turn along a region's boundary up to which its points count as collinear; "
        "more keeps fewer points of it.")
    alpha_rule: str = _row("Interest points", "add", "Rule of α", paper="multiply",
        choices=("add", "multiply"), symbol="(4.7)",
        sentence="Raise the mean saliency by α hundredths (add) or by α per cent of itself "
        "(multiply).")
    max_gap: int = _row("Interest points", 1, "Largest gap", paper=0, minimum=0, maximum=64,
        unit="rings",
        sentence="No removed point is more rings away from a kept one than this: more lets wider "
        "gaps be; 0 turns the guard off.")
    detail: float = _row("Elimination", 3.0, "Detail", minimum=0.0, maximum=100.0,
        sentence="Weight of saliency in the order of elimination: more lowers the error on "
        "features and raises it elsewhere; 0 looks at the shape alone.")
    interest_weight: float = _row("Elimination", 0.0, "Interest weight", minimum=0.0,
        maximum=100.0,
        sentence="Further weight of the points on the regions' boundaries in the order of "
        "elimination; more keeps more of them.")
    regions_of_interest: int = _row("Elimination", 0, "Regions of interest", minimum=0,
        maximum=UNBOUNDED,
        sentence="How many regions, the most salient first, keep more points than the rest: more "
        "regions share these points, and 0 treats all alike.")
    interest_density: float = _row("Elimination", 4.0, "Interest density", minimum=1.0,
        maximum=100.0, unit="times",
        sentence="About how many times as dense the regions of interest are kept as they would be "
        "else; more takes more points from everywhere else.")
    keep_regions: bool = _row("Elimination", False, "Keep regions' borders",
        sentence="Borders between regions stay as lines, as seams do.")
    evenness: float = _row("Elimination", 0.1, "Evenness", minimum=0.0, maximum=100.0,
        sentence="Weight of even spacing in the order of elimination, for points that no face "
        "uses; more spreads them evenly, and follows features less.")
    border_weight: float = _row("Elimination", 1.0, "Border weight", minimum=0.0, maximum=1000.0,
        sentence="Weight of open borders and rims against the faces beside them; more keeps more "
        "of their points.")
    attribute_weight: float = _row("Elimination", 0.01, "Attribute weight", minimum=0.0,
        maximum=100.0, unit="spacings",
        sentence="How far from the surface a point of the most different colour seems to lie, in "
        "mean spacings: more keeps the borders of colours and costs shape; the default costs none.")
    placement: str = _row("Elimination", "original", "Placement", choices=("original", "optimal"),
        sentence="Kept vertices of a mesh stay original points, or move to where the error is "
        "least (optimal).")
    refine: bool = _row("Elimination", True, "Refine",
        sentence="Bring a simplified mesh nearer to its original: edges are flipped, and optimal "
        "placement is fitted; off hands the cut over as it is.")
    error_unit: str = _row("Elimination", "diagonal", "Unit of error",
        choices=("diagonal", "length"),
        sentence="Largest error as a share of the bounding box's diagonal, or as a length in the "
        "input's unit.")
    workers: int = _row("Run", 0, "Workers", minimum=0, maximum=256,
        sentence="Threads for the heavy steps: more are faster, up to the number of processors; 0 "
        "takes one for each. Results do not depend on it.")
    memory_check: bool = _row("Run", True, "Check memory",
        sentence="Refuse an input that would need more memory than the machine has free.")
    # fmt: on

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


def _target(name: str, default: Any, label: str, *, sentence: str, **row: Any) -> Parameter:
    """Make the row of a target, which every preset shares."""
    kind, group = type(default), "Target"
    return Parameter(
        name=name, label=label, type=kind, default=default, paper=default, group=group,
        sentence=sentence, **row,
    )  # fmt: skip


# fmt: off
TARGETS: tuple[Parameter, ...] = (
    _target("ratio", 0.1, "Ratio", minimum=ABOVE_ZERO, maximum=1.0,
        sentence="Share of the points to keep, exact to the point; of a mesh in parts less by "
        "points of a part that goes whole."),
    _target("count", 10000, "Count", minimum=1, maximum=UNBOUNDED,
        sentence="Number of points to keep, exact to the point; of a mesh in parts less by points "
        "of a part that goes whole."),
    _target("faces", 10000, "Faces", minimum=1, maximum=UNBOUNDED,
        sentence="Number of triangles of a mesh to keep, or the nearest below that a whole number "
        "of points makes."),
    _target("max_error", 0.001, "Largest error", minimum=0.0, maximum=1e300,
        sentence="About the fewest points whose surface is nowhere further than this from an input "
        "point; a share of the diagonal, or a length (unit of error)."),
    _target("alpha", 0.0, "Threshold α", minimum=0.0, maximum=1000.0, unit="%", symbol="α (4.7)",
        sentence="Points whose saliency exceeds the mean by this much are kept; more keeps fewer "
        "points."),
)
# fmt: on
"""What a simplification can be asked for; exactly one target is given at a time."""
