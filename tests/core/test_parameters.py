# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of parameters, and the progress of an analysis."""

import dataclasses
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shapes import bumpy

import salcore

NUMBERS = [row for row in salcore.TABLE + salcore.TARGETS if row.type in (int, float)]


@pytest.mark.parametrize("row", salcore.TABLE + salcore.TARGETS, ids=lambda row: row.name)
def test_rows_are_complete(row):
    assert row.label
    assert row.group
    assert row.sentence.endswith(".")
    assert row.check(row.default) == row.default
    assert row.check(row.paper) == row.paper
    assert bool(row.choices) == (row.type is str)


@pytest.mark.parametrize("row", NUMBERS, ids=lambda row: row.name)
def test_bounds(row):
    for bad in (row.minimum - 1, 2 * row.maximum + 1, math.nan, "3", None, True):
        with pytest.raises(salcore.ParameterError, match=f"{row.name}="):
            row.check(bad)
    assert row.check(np.float64(row.minimum)) == row.minimum


def test_whole_numbers_and_choices():
    with pytest.raises(salcore.ParameterError, match=r"cells=2\.5: give a whole number"):
        salcore.Parameters(cells=2.5)
    with pytest.raises(salcore.ParameterError, match=r"graph='mesh': choose one of surface"):
        salcore.Parameters(graph="mesh")
    with pytest.raises(salcore.ParameterError, match="whole_percent=7: give True or False"):
        salcore.Parameters(whole_percent=7)
    with pytest.raises(salcore.ParameterError, match="preset='papr': choose one of default, paper"):
        salcore.Parameters.preset("papr")


def test_variants_and_json():
    paper = dataclasses.replace(salcore.Parameters.preset("paper"), cells=4)
    assert (paper.cells, paper.graph, paper.collinear_angle) == (4, "delaunay", 0.0)
    assert json.loads(json.dumps(paper.as_dict()))["cells"] == 4
    assert salcore.Parameters() == salcore.Parameters.preset("default")


@pytest.mark.parametrize(
    ("target", "message"),
    [({}, "no target"), ({"alpha": -1}, "alpha=-1"), ({"alpha": "x"}, "alpha='x'")],
)
def test_targets(target, message):
    with pytest.raises(salcore.ParameterError, match=message):
        salcore.simplify(bumpy(30), **target)


def test_progress_never_falls_and_names_its_stages():
    seen = []
    salcore.analyze(bumpy(40000), progress=lambda stage, fraction: seen.append((stage, fraction)))
    fractions = [fraction for _, fraction in seen]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0
    assert fractions[-1] == 1
    assert list(dict.fromkeys(s for s, _ in seen)) == [
        "Input", "Graph", "Normals", "Saliency",
    ]  # fmt: skip


def test_cancel_at_every_step_leaves_nothing_behind():
    points = bumpy(20000)
    seen = []
    expected = salcore.analyze(points, progress=lambda *at: seen.append(at))
    for stop in range(len(seen)):
        calls = iter(range(len(seen) + 1))
        with pytest.raises(salcore.Cancelled):
            salcore.analyze(points, progress=lambda *_, c=calls, s=stop: next(c) < s)
    again = salcore.analyze(points)
    assert (again.saliency == expected.saliency).all()
    with pytest.raises(salcore.Cancelled):
        expected.simplify(alpha=3, progress=lambda *_: False)


def test_report_is_json():
    report = salcore.simplify(bumpy(), alpha=20).report
    data = json.loads(json.dumps(report.as_dict()))
    assert data["points_before"] == 1500
    assert data["rate"] == pytest.approx(1 - data["points_after"] / 1500)
    assert data["errors"]["point_back"]["max"] == 0


CORE = Path(salcore.__file__).parent


def test_the_core_knows_no_host():
    hosts = ("bpy", "pymeshlab", "matplotlib")
    code = f"import salcore, sys; print([m for m in {hosts} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
