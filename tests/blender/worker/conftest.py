# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests about the active object."""

from types import SimpleNamespace

import bpy
import pytest


@pytest.fixture
def request_of(module):
    """Return a function that makes a request about the active object."""

    def make(task="simplify", ratio=0.2, number=0, **settings):
        sources = module("geometry.sources")
        parameters = module("salcore").Parameters(error_unit="length", **settings)
        source = sources.originals(bpy.context)[0]
        words = {"task": task, "parameters": parameters.as_dict()}
        if task not in ("simplify", "rank"):
            return words | sources.geometry(source)
        if task == "simplify":
            words |= {"targets": [{"ratio": ratio}], "number": number}
        return words | sources.geometry_with_mesh(
            source, SimpleNamespace(**module("command").NO_WEIGHTS, **module("command").KEEP)
        )

    return make
