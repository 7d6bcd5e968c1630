# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of one simplification."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from .measure.errors import Errors


@dataclass(frozen=True)
class Report:
    """Figures of one simplification.

    Attributes
    ----------
    points_before, points_after, faces_before, faces_after : int
        Input points and valid faces, and kept ones.
    parts_before, parts_after : int or None
        Connected parts of the faces; none after for a cloud or a threshold α.
    rate : float
        Share of the input points that went.
    dropped, welded : int
        Input points that were not finite, and that equalled another.
    regions : int or None
        Regions of like saliency, where they took part: for a threshold α.
    extremities, salient, fillers, guards : int or None
        For a threshold α, kept points by reason: on a boundary, salient, by the gap rule, by the
        coverage guard. A point may have several.
    errors : Errors or None
        Between the input's points and the kept ones, in the input's unit. The surfaces are those
        of the faces; without faces, of the tangent planes at the nearest points. None where they
        were not measured.
    notes : tuple of str
        What had to be given up, or is not as asked for.
    seconds_analysis, seconds_selection : float
    seconds_errors : float or None
        Time that measuring the errors took.
    """

    points_before: int
    points_after: int
    faces_before: int
    faces_after: int
    parts_before: int
    parts_after: int | None
    rate: float
    dropped: int
    welded: int
    regions: int | None
    extremities: int | None
    salient: int | None
    fillers: int | None
    guards: int | None
    errors: Errors | None
    notes: tuple[str, ...]
    seconds_analysis: float
    seconds_selection: float
    seconds_errors: float | None

    def as_dict(self) -> dict[str, Any]:
        """Return nested dicts, ready for JSON."""
        return dataclasses.asdict(self)
