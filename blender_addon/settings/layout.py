# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows that the sidebar and the panel of the last operation share."""

from __future__ import annotations

from typing import Any

from ..geometry.findings import Found


def draw_target(layout: Any, settings: Any) -> None:
    """Draw the target and its value."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(settings, "target")
    layout.prop(settings, settings.target.lower())


def draw_output(layout: Any, settings: Any) -> None:
    """Draw what is taken and where the result goes."""
    layout.row().prop(settings, "placement", expand=True)
    layout.row().prop(settings, "symmetry", expand=True)
    layout.prop(settings, "source")
    layout.prop(settings, "output")
    if settings.output == "NEW":
        layout.prop(settings, "hide_source")
    layout.prop(settings, "measure")


def draw_clean(layout: Any, settings: Any, found: Found | None) -> None:
    """Draw what is done first, and what there is to do of the active object."""
    column = layout.column(heading="First", align=True)
    for name in ("weld", "remove_loose"):
        column.prop(settings, name)
    # Always a line: no button below moves.
    column.label(text="" if found is None else found.sentence)


def draw_kept(layout: Any, settings: Any) -> None:
    """Draw what has to stay, and how the result is shaded."""
    column = layout.column(heading="Keep", align=True)
    for name, text in (
        ("keep_seams", "Seams"),
        ("keep_sharp", "Sharp Edges"),
        ("keep_border", "Border"),
        ("keep_topology", "Topology"),
    ):
        column.prop(settings, name, text=text)
    layout.prop(settings, "original_normals")
