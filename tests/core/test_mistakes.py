# SPDX-License-Identifier: GPL-3.0-or-later
"""Mistakes in calls: each is one `SalcoreError` that names the argument and the remedy."""

import datetime

import numpy as np
import pytest
from shapes import bumpy, torus

import salcore

P = salcore.Parameters
CLOUD = bumpy(30)
TORUS = torus(8, 6)


def simplify(**wishes):
    return salcore.simplify(CLOUD, **{"ratio": 0.5, **wishes})


def mesh_result():
    return salcore.simplify(*TORUS, ratio=0.5)


ARRAYS = {
    "ragged points": (lambda: salcore.analyze([[1, 2, 3], [1, 2]]), "points: give an array"),
    "ragged faces": (lambda: salcore.analyze(np.eye(3), [[0, 1, 2], [0, 1]]), "faces: give tri"),
    "ragged normals": (lambda: salcore.analyze(np.eye(3), None, [[0, 1], [0]]), "normals: give"),
    "no array": (lambda: salcore.analyze("points.ply"), "points of type <U10: give real"),
    "None": (lambda: salcore.analyze(None), "points of type object: give real"),
    "None inside": (lambda: salcore.analyze([[0, 0, None]]), "points of type object"),
    "dict": (lambda: salcore.analyze({"x": 1}), "points of type object"),
    "bytes": (lambda: salcore.analyze([[b"a", b"b", b"c"]]), "points of type"),
    "complex": (lambda: salcore.analyze(np.eye(3) * 1j), "points of type complex128: give real"),
    "dates": (lambda: salcore.analyze([[datetime.datetime(2020, 1, 1)] * 3]), "points of type"),
    "numpy dates": (lambda: salcore.analyze(np.zeros((2, 3), "M8[s]")), "points of type datetime"),
    "records": (lambda: salcore.analyze(np.zeros(3, [("x", float)])), "points of type"),
    "huge numbers": (lambda: salcore.analyze([[10**400, 0, 0]]), "points of type object"),
    "a mask": (lambda: salcore.analyze(np.ma.masked_less(np.eye(3), 1)), "points: .* masked; fill"),
    "a number": (lambda: salcore.analyze(3.0), r"points of shape \(\)"),
    "no columns": (lambda: salcore.analyze(np.zeros((5, 0))), r"points of shape \(5, 0\)"),
    "three dimensions": (lambda: salcore.analyze(np.zeros((2, 3, 3))), r"shape \(2, 3, 3\)"),
    "faces of no points": (
        lambda: salcore.analyze(np.zeros((0, 3)), [[0, 1, 2]]),
        "faces: index 2 is out of range for 0 points; leave faces out",
    ),
    "faces of floats": (lambda: salcore.analyze(np.eye(3), [[0.0, 1.0, 2.0]]), "float64: give int"),
    "faces of bools": (lambda: salcore.analyze(np.eye(3), [[True] * 3]), "faces of type bool"),
    "faces of words": (lambda: salcore.analyze(np.eye(3), [["a", "b", "c"]]), "faces of type <U1"),
    "far faces": (
        lambda: salcore.analyze(np.eye(3), np.array([[0, 1, 2**63]], "u8")),
        "faces: index 9223372036",
    ),
    "importance of words": (lambda: simplify(importance=["a"] * 30), "importance of type <U1"),
    "importance too large": (
        lambda: simplify(importance=[1e308] * 30),
        r"importance: 1e\+308 is the value of point 0; give numbers from 0 to 1e\+100",
    ),
    "negative importance": (lambda: simplify(importance=[0.0] * 29 + [-1]), "-1 .* point 29; give"),
    "importance nan": (lambda: simplify(importance=[np.nan] * 30), "importance: nan is the value"),
    "importance of one": (lambda: simplify(importance=2.0), r"importance of shape \(\): give one"),
    "protect words": (lambda: simplify(protect=["yes"] * 30), "protect of type <U3"),
    "protect numbers": (
        lambda: simplify(protect=list(range(30))),
        "protect: 2 is the value of point 2; give True or False",
    ),
    "protect ragged": (lambda: simplify(protect=[[1], [1, 2]]), "protect: give one value"),
    "seams of words": (lambda: simplify(seams=[["a", "b"]]), "seams of type <U1: give integers"),
    "seams far off": (lambda: simplify(seams=[[0, 30]]), "seams: index 30 .* from 0 to 29"),
    "seams of three": (lambda: simplify(seams=[[0, 1, 2]]), r"seams of shape \(1, 3\): give pairs"),
    "find seams": (lambda: salcore.find_seams([[0, 1, 2]], [["a"] * 3]), "values of type <U1"),
    "find seams of one": (
        lambda: salcore.find_seams([[0, 1, 2]], [1.0]),
        r"values of shape \(1,\)",
    ),
    "seams below 0": (lambda: salcore.find_seams([[0, 1, -2]], [[[1]] * 3]), "faces: index -2"),
    "corners of others": (lambda: mesh_result().corner_source([[0, 1, 2]]), "faces: 1 of them"),
    "corners far off": (lambda: mesh_result().corner_source([[0, 1, 99]]), "faces: index 99"),
    "charts of others": (
        lambda: mesh_result().corner_source(TORUS[1], np.zeros((2, 3, 2))),
        r"charts of shape \(2, 3, 2\): give values of corners of shape \(96, 3, d\)",
    ),
    "edges far off": (lambda: mesh_result().edge_source([[0, 99]], [[0, 1]]), "edges: index 99"),
    "new edges far off": (lambda: mesh_result().edge_source([[0, 1]], [[0, 47]]), "new_edges: ind"),
    "no surface": (lambda: salcore.compare(CLOUD, CLOUD), "original of type ndarray: give a Surf"),
    "an empty surface": (
        lambda: salcore.compare(salcore.make_surface(CLOUD), salcore.make_surface([])),
        "simplified: it has no valid points",
    ),
    "a surface of nan": (
        lambda: salcore.compare(
            salcore.make_surface(CLOUD), salcore.Surface(np.full((2, 3), np.nan), np.empty((0, 3)))
        ),
        "simplified: points are NaN or infinite, .*make_surface",
    ),
    "a surface of words": (
        lambda: salcore.compare(salcore.Surface("x", []), salcore.make_surface(CLOUD)),
        "original.points of type <U1",
    ),
    "a surface of a line": (
        lambda: salcore.compare(salcore.Surface(np.ones(3), []), salcore.make_surface(CLOUD)),
        r"original: points or normals of shape \(3,\)",
    ),
    "a surface of too few normals": (
        lambda: salcore.compare(salcore.Surface(CLOUD, [], CLOUD[:3]), salcore.make_surface(CLOUD)),
        r"original: points or normals of shape \(3, 3\)",
    ),
    "a surface of far faces": (
        lambda: salcore.compare(salcore.make_surface(CLOUD), salcore.Surface(CLOUD, [[0, 1, 30]])),
        "simplified.faces: index 30",
    ),
    "other faces": (
        lambda: mesh_result().corner_source(TORUS[1][::-1]),
        "faces: .* not those that were analy",
    ),
    "the largest doubles": (
        lambda: salcore.analyze(np.array([[-1.7e308] * 3, [1.7e308] * 3])),
        "points: the diagonal .* beyond the largest double.*scale them down",
    ),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_arrays(name):
    call, message = ARRAYS[name]
    with pytest.raises(salcore.GeometryError, match=message):
        call()


PARAMETERS = {
    "a dict": (lambda: salcore.analyze(CLOUD, parameters={"cells": 3}), r"Parameters\(\*\*values"),
    "a name": (lambda: salcore.analyze(CLOUD, parameters="paper"), r"Parameters\.preset\(name"),
    "a class": (lambda: salcore.analyze(CLOUD, parameters=P), "parameters=<class"),
    "hundreds of digits": (lambda: P(cells=10**400), r"cells=1000.*give a whole number from 1"),
    "thousands of digits": (lambda: P(cells=10**5000), "cells=<.*int.*>: give a whole number from"),
    "infinite": (lambda: P(cells=float("inf")), "cells=inf: give a whole number from 1 to 32"),
    "an array for a bool": (lambda: P(whole_percent=np.array([1, 0])), "whole_percent=array"),
    "an array for a choice": (lambda: P(graph=np.array(["surface", "x"])), "graph=array.*choose"),
    "a list for a number": (lambda: P(tolerance=[0.1]), r"tolerance=\[0\.1\]: give a number"),
    "complex": (lambda: P(tolerance=0.1j), "tolerance=0.1j: give a number"),
    "nan": (lambda: P(tolerance=float("nan")), "tolerance=nan: give a number from 0 to 1"),
    "a word for a bool": (lambda: P(whole_percent="yes"), "whole_percent='yes': give True"),
    "an array for a preset": (lambda: P.preset(np.array(["paper", "x"])), "preset=array"),
    "target True": (lambda: simplify(ratio=True), "ratio=True: give a number"),
    "target a word": (lambda: simplify(ratio="0.5"), "ratio='0.5': give a number"),
    "target nan": (lambda: simplify(ratio=float("nan")), "ratio=nan: give a number above 0 to 1"),
    "target zero": (lambda: simplify(ratio=0.0), "ratio=0.0: give a number above 0 to 1"),
    "target a list": (lambda: simplify(ratio=[0.5]), r"ratio=\[0.5\]: give a number"),
    "target an array": (lambda: simplify(ratio=np.ones(9)), "ratio=array.*: give a number"),
    "target broken": (lambda: simplify(ratio=None, count=2.5), "count=2.5: give a whole"),
    "target too large": (lambda: simplify(ratio=None, count=31), "count=31: there are 30 valid"),
    "two targets": (lambda: simplify(alpha=1), "2 targets given"),
    "unknown target": (lambda: simplify(ratio=None, rate=0.5), "no target 'rate': give one of"),
    "workers": (
        lambda: salcore.compare(
            salcore.make_surface(CLOUD), salcore.make_surface(CLOUD), workers=np.ones(2)
        ),
        "workers=array.*: give a whole number",
    ),
    "progress a number": (lambda: simplify(progress=3), "progress of type int: give a function"),
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_wrong_parameters_and_targets(name):
    call, message = PARAMETERS[name]
    with pytest.raises(salcore.ParameterError, match=message):
        call()


@pytest.mark.parametrize("values", [np.float32(3), np.int8(3), np.uint64(3), 3.0])
def test_numbers_of_numpy_are_numbers(values):
    assert P(cells=values).cells == 3
    assert P(whole_percent=np.bool_(True)).whole_percent is True
    assert type(P(graph=np.str_("delaunay")).graph) is str


def test_wide_floats_beyond_float64_count_as_infinite():
    points = bumpy(30).astype(np.longdouble)
    points[3, 0] = np.longdouble("1e400") if np.finfo(np.longdouble).max > 1e308 else np.inf
    assert salcore.simplify(points, ratio=0.5).report.dropped == 1


def test_charts_that_are_not_finite_count_as_zero():
    points, faces = TORUS
    charts = np.zeros((len(faces), 3, 2))
    charts[:40] = 1.0
    spoilt = np.where(charts == 0.0, np.nan, charts)
    expected = salcore.find_seams(faces, charts)
    assert len(expected)
    assert (salcore.find_seams(faces, spoilt) == expected).all()
    result = salcore.simplify(points, faces, ratio=0.5)
    assert (result.corner_source(faces, spoilt) == result.corner_source(faces, charts)).all()
    huge = np.where(charts == 0.0, -1.7e308, 1.7e308)
    assert (salcore.find_seams(faces, huge) == expected).all()


def test_a_callback_that_fails_is_heard_and_the_work_is_closed():
    def fail(stage, fraction):
        raise KeyError(stage)

    with pytest.raises(KeyError, match="Input"):
        salcore.analyze(CLOUD, progress=fail)
