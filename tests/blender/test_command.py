# SPDX-License-Identifier: GPL-3.0-or-later
"""The background command, on real files."""

import bpy
import numpy as np
import pytest
import scenes
from models import model_path


def points_of(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.ply_import(filepath=str(path))
    return bpy.context.active_object


def test_a_scan(module, tmp_path, capsys):
    source, target = model_path("bun_zipper.ply"), tmp_path / "out ünï.ply"
    assert module("command").main([str(source), str(target), "--ratio", "0.1"]) == 0
    assert "3595 of 35947 points, largest error" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == [target.name]
    obj = points_of(target)
    assert len(obj.data.vertices) == 3595
    assert len(obj.data.polygons) > 5000


def test_a_cloud_keeps_its_properties(module, tmp_path):
    scenes.points_mesh(scenes.relief())
    attribute = bpy.context.object.data.attributes.new("heat", "FLOAT", "POINT")
    attribute.data.foreach_set("value", [float(k) for k in range(600)])
    source, target = tmp_path / "in.ply", tmp_path / "out.ply"
    bpy.ops.wm.ply_export(filepath=str(source), export_attributes=True)
    assert module("command").main([str(source), str(target), "--count", "50"]) == 0
    obj = points_of(target)
    assert len(obj.data.vertices) == 50
    assert len({item.value for item in obj.data.attributes["heat"].data}) == 50


def test_what_is_done_first_and_symmetry(module, tmp_path, capsys):
    scenes.torus()
    source, target = tmp_path / "in.stl", tmp_path / "out.ply"
    bpy.ops.wm.stl_export(filepath=str(source), export_selected_objects=True)
    options = ["--faces", "400", "--weld", "--remove-loose", "--symmetry", "x"]
    assert module("command").main([str(source), str(target), *options]) == 0
    capsys.readouterr()
    at = scenes.positions(points_of(target))
    assert len(at) == 200  # of a ring with 400 triangles
    image = at * np.float32([-1, 1, 1])
    assert {*map(tuple, image + 0.0)} == {*map(tuple, at + 0.0)}


@pytest.mark.parametrize("ending", [".obj", ".stl", ".glb", ".usdc", ".abc"])
def test_other_formats(module, tmp_path, ending):
    target = tmp_path / f"out{ending}"
    arguments = [str(model_path("fandisk.obj")), str(target), "--ratio", "0.2"]
    assert module("command").main(arguments) == 0
    assert target.stat().st_size > 10_000


def test_mistakes_are_one_line_and_leave_nothing(module, tmp_path, capsys):
    command = module("command")
    bunny = str(model_path("bun_zipper.ply"))
    there = tmp_path / "there.ply"
    there.write_text("precious")
    for arguments, message in (
        ([bunny, str(tmp_path / "x.xyz"), "--ratio", "0.5"], "no format has the ending '.xyz'"),
        ([str(tmp_path / "no.ply"), str(tmp_path / "x.ply"), "--ratio", "0.5"], "is no file"),
        ([bunny, str(there), "--ratio", "0.5"], "exists; choose another name"),
        ([bunny, str(tmp_path / "a" / "x.ply"), "--ratio", "0.5"], "folder does not exist"),
        ([bunny, str(tmp_path / "x.ply"), "--ratio", "1.5"], "above 0 to 1"),
        ([bunny, str(tmp_path / "x.ply"), "--ratio", "0.5", "--cells", "99"], "cells=99"),
    ):
        assert command.main(arguments) == 2
        out = capsys.readouterr().out.strip().splitlines()
        assert message in out[-1]
        assert out[-1].startswith("error: ")
    assert [path.name for path in tmp_path.iterdir()] == ["there.ply"]
    assert there.read_text() == "precious"


def test_wrong_options_are_a_mistake(module, capsys):
    assert module("command").main(["a.ply", "b.ply"]) == 2
    assert "--ratio" in capsys.readouterr().err
    assert module("command").main(["--help"]) == 0
