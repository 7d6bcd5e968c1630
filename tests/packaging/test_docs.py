# SPDX-License-Identifier: GPL-3.0-or-later
"""What the documentation shows runs, and its pages say what the code has."""

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import numpy as np
import pymeshlab
import pytest
from shapes import bumpy, hull_mesh

import meshlab_filter
import salcore

DOCS = Path(__file__).parents[2] / "docs"
ROOT = DOCS.parent
PAGES = [ROOT / "README.md", ROOT / "docs" / "package.md", *sorted(DOCS.glob("tasks/*.md"))]
MODULES = [module.name for module in pkgutil.walk_packages(salcore.__path__, "salcore.")]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings(name):
    failed, _ = doctest.testmod(importlib.import_module(name))
    assert failed == 0


def blocks():
    for page in PAGES:
        for number, code in enumerate(
            re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
        ):
            yield pytest.param(code, id=f"{page.stem}-{number}")


@pytest.mark.parametrize("code", list(blocks()))
def test_code_in_pages_runs(code, tmp_path, monkeypatch):
    if "bpy" in code:
        compile(code, "page", "exec")  # tests/blender runs these operators
        return
    monkeypatch.chdir(tmp_path)
    points = bumpy(1500)
    points, faces = hull_mesh(points)
    ms = pymeshlab.MeshSet(verbose=False)
    ms.add_mesh(pymeshlab.Mesh(points, faces))
    ms.save_current_mesh("statue.ply")
    analysis = salcore.analyze(points, faces)
    names = {
        "np": np, "salcore": salcore, "pymeshlab": pymeshlab, "meshlab_filter": meshlab_filter,
        "points": points, "faces": faces, "colors": points, "uv": points[faces][:, :, :2],
        "ms": ms, "analysis": analysis, "light": analysis.simplify(ratio=0.5),
    }  # fmt: skip
    exec(code, names)


def test_the_page_of_parameters_is_the_tables():
    page = importlib.import_module("docs.parameter_pictures")
    assert (DOCS / "parameters.md").read_text(encoding="utf-8") == page.page()
    rows = {row.name for row in (*salcore.TARGETS, *salcore.TABLE)}
    assert set(page.VALUES) <= rows
    for name in page.VALUES:
        assert (DOCS / "pictures" / "parameters" / f"{name}.png").exists()
