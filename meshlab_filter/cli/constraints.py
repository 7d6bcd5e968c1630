# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simplification has to keep, by the command's options, and which of them change nothing."""

from __future__ import annotations

import argparse
from typing import Any

from ..errors import Warn
from ..io.documents import Document


def constraints_of(document: Document, options: argparse.Namespace) -> dict[str, Any]:
    """Return the constraints on a simplification: selected points, and what makes seams."""
    layers = {} if options.points else document.corner_layers()
    return {
        "protect": document.selected if options.protect_selected else None,
        "keep_seams": not options.free_seams,
        "keep_border": options.keep_border,
        "keep_topology": options.keep_topology,
        "symmetry": options.symmetry,
        **layers,
    }


def say_unused(document: Document, options: argparse.Namespace, warn: Warn) -> None:
    """Say which options change nothing, because the input lacks what they are about."""
    if options.protect_selected and not document.selected.any():
        warn("--protect-selected: no point of the input is selected; it changes nothing")
    if document.arrays[1] is not None:
        return
    given = ["--placement"] * (getattr(options, "placement", None) == "optimal")
    for name in ("keep_border", "keep_topology", "transfer_normals"):
        given += [f"--{name.replace('_', '-')}"] * getattr(options, name)
    if given:
        warn(f"{', '.join(given)}: for faces, and there are none; changes nothing")
