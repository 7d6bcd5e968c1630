# SPDX-License-Identifier: GPL-3.0-or-later
"""Every property, of every type, in every format: it comes back the same, or one line names it."""

import functools

import numpy as np
import pytest
from mesh_files import rows, write_ply
from plyfile import PlyData
from shapes import bumpy

import salcore
from meshlab_filter.io import formats

RNG = np.random.default_rng(8)
COUNT = 400
POINTS = bumpy(COUNT) + np.array([637000.0, 851000.0, 0.0])
KEPT = functools.cache(lambda: salcore.simplify(POINTS, ratio=0.2).indices)
COLUMNS = {
    "intensity": RNG.integers(0, 65536, COUNT).astype(np.uint16),
    "confidence": RNG.random(COUNT).astype(np.float32),
    "classification": RNG.integers(0, 20, COUNT).astype(np.uint8),
    "gps_time": 3e8 + RNG.random(COUNT),
    "scan_angle": RNG.integers(-90, 90, COUNT).astype(np.int8),
    "temperature": RNG.integers(-30000, 30000, COUNT).astype(np.int16),
    "identity": RNG.integers(-(2**31), 2**31, COUNT).astype(np.int32),
    "stamp": RNG.integers(0, 2**32, COUNT).astype(np.uint32),
    "f_dc_0": RNG.normal(size=COUNT).astype(np.float32),
    "scalar_Roughness": RNG.normal(size=COUNT),
}
COLORS = {name: RNG.integers(0, 256, COUNT).astype(np.uint8) for name in ("red", "green", "blue")}
ENDINGS = ["ply", "obj", "xyz", "txt", "csv", "asc", "pts", "las", "laz", "pcd", "off", "e57"]


def found(path, names):
    """Return the columns of a file, those without names by their order."""
    module = formats.reader(path)
    if module is None or formats.writer(path) is None:  # MeshLab writes no others than it reads
        return {}
    options = {"columns": ",".join(names)} if path.suffix == ".xyz" else {}
    return module.read(path, **options)[0].columns


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("colored", [False, True])
def test_a_property_comes_back_or_is_named(run, tmp_path, ending, colored):
    columns = COLUMNS | (COLORS if colored else {})
    source = write_ply(tmp_path / "in.ply", rows(POINTS, columns))
    output = tmp_path / f"o.{ending}"
    said = run("simplify", source, output, "--ratio", "0.2")
    after = found(output, ["x", "y", "z", *(COLORS if colored else {})])
    for name, values in columns.items():
        if name not in after:
            if name in COLORS and ending in ("off", "e57"):
                continue  # which MeshLab keeps
            assert any(f" {name}{end}" in said for end in (",", ";")), (name, said)
            continue
        back = np.asarray(after[name])
        if f".{ending}" in formats.TEXT:  # digits, as many as tell the value from its neighbours
            back = back.astype(values.dtype)
        if name in COLORS and ending in ("las", "laz"):
            back = back // 257
        if name in COLORS and ending == "obj":
            back = np.round(255 * back)
        assert np.array_equal(back, values[KEPT()]), name
        if ending in ("ply", "pcd"):
            assert back.dtype == values.dtype, name
    if ending in ("ply", "txt", "csv", "asc", "las", "laz", "pcd"):
        assert set(columns) <= after.keys() | {f"{name}_value" for name in after}
        assert said == "" or "columns read as" in said


def test_saliency_is_a_column_of_every_format(run, tmp_path):
    source = write_ply(tmp_path / "in.ply", rows(bumpy(COUNT), COLUMNS))
    run("saliency", source, tmp_path / "o.ply")
    table = PlyData.read(tmp_path / "o.ply")["vertex"].data
    for ending in ("csv", "laz", "pcd"):
        run("saliency", source, tmp_path / f"o.{ending}")
        after = found(tmp_path / f"o.{ending}", [])
        assert np.array_equal(after["quality"], table["quality"])
        assert np.array_equal(after["stamp"], COLUMNS["stamp"])
