# SPDX-License-Identifier: GPL-3.0-or-later
"""Format reports and errors as text."""

from __future__ import annotations

from typing import Any


def format_report(report: dict[str, Any]) -> str:
    """Return a report (`salcore.Report.as_dict`) as lines of text."""
    lines = [
        f"  points   {report['points_before']:,} -> {report['points_after']:,} "
        f"({report['rate']:.1%} less)",
        *[f"  faces    {report['faces_before']:,} -> {report['faces_after']:,}"]
        * bool(report["faces_after"]),
        *([format_errors(report["errors"])] if report["errors"] is not None else []),
        f"  seconds  {report['seconds_analysis']:.2f} analysis, "
        f"{report['seconds_selection']:.2f} selection",
    ]
    if report["dropped"]:
        lines.insert(1, f"  dropped  {report['dropped']:,} points that are not finite")
    return "\n".join(lines)


def format_errors(errors: dict[str, Any]) -> str:
    """Return errors as lines of text, in the file's unit and in per cent of the diagonal."""
    share = 100.0 / errors["diagonal"] if errors["diagonal"] else 0.0
    names = {
        "point": "to the nearest point",
        "surface": "to the surface",
        "point_back": "back to the nearest point",
        "surface_back": "back to the surface",
    }
    return "\n".join(
        f"  error    {errors[key]['max']:.4g} max ({errors[key]['max'] * share:.3f} %), "
        f"{errors[key]['mean']:.4g} mean ({errors[key]['mean'] * share:.3f} %) {name}"
        for key, name in names.items()
        if "back" not in key or errors[key]["max"] > 0.0
    )
