# SPDX-License-Identifier: GPL-3.0-or-later
"""Format reports and errors as text."""

from __future__ import annotations

from typing import Any

DISTANCES = {
    "surface": "to the light surface",
    "point": "to the nearest kept point",
    "surface_back": "from there back to the original surface",
    "point_back": "from there back to the nearest original point",
}
"""From where to where an error is, in the order in which they are told."""


def format_report(report: dict[str, Any]) -> str:
    """Return a report (`salcore.Report.as_dict`) as lines of text."""
    lines = [
        f"  points   {report['points_before']:,} -> {report['points_after']:,} "
        f"({report['rate']:.1%} less)",
        *[f"  faces    {report['faces_before']:,} -> {report['faces_after']:,}"]
        * bool(report["faces_after"]),
        *([format_errors(report["errors"])] if report["errors"] is not None else []),
        f"  seconds  {report['seconds_analysis']:.2f} analysis, "
        f"{report['seconds_selection']:.2f} simplification",
    ]
    if report["dropped"]:
        lines.insert(
            1, f"  dropped  {report['dropped']:,} points whose coordinates are NaN or infinite"
        )
    return "\n".join(lines)


def format_errors(errors: dict[str, Any]) -> str:
    """Return errors as lines of text, in the file's unit and in per cent of the diagonal."""
    share = 100.0 / errors["diagonal"] if errors["diagonal"] else 0.0
    lines = []
    for key, name in DISTANCES.items():
        mean, largest = errors[key]["mean"], errors[key]["max"]
        if "back" not in key or largest > 0.0:
            lines.append(
                f"  error    {mean:.4g} mean, {largest:.4g} max {name} "
                f"({mean * share:.3f} % and {largest * share:.3f} % of the diagonal)"
            )
    return "\n".join(lines)
