# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds as text: columns are recognized or named, and every number comes back the same."""

from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData
from shapes import bumpy

import salcore
from meshlab_filter.io import text

RNG = np.random.default_rng(4)
POINTS = bumpy(400) * 10.0 + [637100.25, 851327.5, 424.0]
NORMALS = RNG.normal(size=POINTS.shape)
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
BYTES = RNG.integers(0, 256, POINTS.shape)
WORDS = RNG.integers(0, 65536, POINTS.shape)
SHARES = np.round(BYTES / 255.0, 6)
INTENSITY = np.round(RNG.random(len(POINTS)) * 4000 - 2000, 2)
XYZ, RGB, NORMAL = ["x", "y", "z"], ["red", "green", "blue"], ["nx", "ny", "nz"]

FILES = {
    "plain.xyz": ("", " ", [POINTS], XYZ),
    "normals.xyz": ("", " ", [POINTS, NORMALS], XYZ + NORMAL),
    "bytes.xyz": ("", " ", [POINTS, BYTES], XYZ + RGB),
    "shares.txt": ("", " ", [POINTS, SHARES], XYZ + RGB),
    "both.txt": ("", "\t", [POINTS, BYTES, NORMALS], XYZ + RGB + NORMAL),
    "turned.txt": ("", " ", [POINTS, NORMALS, BYTES], XYZ + NORMAL + RGB),
    "intensity.asc": ("", " ", [POINTS, INTENSITY], [*XYZ, "intensity"]),
    "first.xyz": ("", " ", [POINTS, INTENSITY, BYTES], [*XYZ, "intensity", *RGB]),
    "last.xyz": ("", " ", [POINTS, BYTES, INTENSITY], [*XYZ, *RGB, "intensity"]),
    "leica.pts": (f"{len(POINTS)}\n", " ", [POINTS, np.round(INTENSITY / 8), BYTES],
                  [*XYZ, "intensity", *RGB]),
    "doubtful.pts": (f"{len(POINTS)}\n", " ", [POINTS, BYTES[:, :1], BYTES],
                     [*XYZ, "intensity", *RGB]),
    "comma.csv": ("X,Y,Z,Intensity\n", ",", [POINTS, INTENSITY], [*XYZ, "intensity"]),
    "words.csv": ('"Easting","Northing","Height","R","G","B"\n', ",", [POINTS, WORDS], XYZ + RGB),
    "semicolon.csv": ("R;G;B;x;y;z\n", ";", [BYTES, POINTS], RGB + XYZ),
    "own.csv": ("x,y,z,GPS time,my value\n", ",", [POINTS, RNG.random((len(POINTS), 2))],
                [*XYZ, "GPS_time", "my_value"]),
    "cloudcompare.asc": ("//X Y Z Rf Gf Bf Nx Ny Nz\n", " ", [POINTS, SHARES, NORMALS],
                         XYZ + RGB + NORMAL),
    "comments.txt": ("# made by a test\n# second line\n", " ", [POINTS, BYTES], XYZ + RGB),
    "foreign.csv": ("a;b;c;d\n", ";", [POINTS, INTENSITY], [*XYZ, "d"]),
    "scalars.txt": ("", " ", [POINTS, INTENSITY, 2 * INTENSITY, 3 * INTENSITY],
                    [*XYZ, "scalar_4", "scalar_5", "scalar_6"]),
    "prose.txt": ("A scan of the hall\n\n", ", ", [POINTS], XYZ),
}  # fmt: skip


def lines(parts, separator):
    table = [[repr(v) for v in np.atleast_2d(part.T)[k].tolist()] for part in parts
             for k in range(1 if part.ndim == 1 else part.shape[1])]  # fmt: skip
    return "\n".join(map(separator.join, zip(*table, strict=True)))


def write(folder, name):
    head, separator, parts, _ = FILES[name]
    path = folder / name
    path.write_text(head + lines(parts, separator) + "\n")
    return path


@pytest.mark.parametrize("name", FILES)
def test_columns_are_recognized_and_every_number_comes_back(tmp_path, name):
    path = write(tmp_path, name)
    said = []
    (layer,) = text.read(path, said.append)
    *_, parts, names = FILES[name]
    values = np.column_stack([part.astype(float) for part in parts])
    assert sorted(layer.columns) == sorted(names)
    for column, expected in zip(values.T, names, strict=True):
        assert np.array_equal(layer.columns[expected], column), expected
    assert len(said) == 1
    assert "columns read as" in said[0]
    assert "--columns" in said[0]
    assert (layer.normals is not None) == ("nx" in names)


@pytest.mark.parametrize("ending", ["csv", "txt", "asc", "xyz", "pts", "ply"])
@pytest.mark.parametrize("name", ["first.xyz", "own.csv", "cloudcompare.asc", "leica.pts"])
def test_what_is_kept_is_the_originals_bit_for_bit_or_named(run, tmp_path, name, ending):
    path = write(tmp_path, name)
    (before,) = text.read(path)
    output = tmp_path / f"o.{ending}"
    said = run("simplify", path, output, "--ratio", "0.2")
    kept = salcore.simplify(POINTS, normals=before.normals, ratio=0.2).indices
    if ending == "ply":
        table = PlyData.read(output)["vertex"].data
        after = {column: table[column] for column in table.dtype.names}
    else:
        names = ",".join(before.columns) if ending == "xyz" else None
        after = text.read(output, columns=names)[0].columns
    for column, values in before.columns.items():
        if column not in after:
            assert column in said.split("do not keep")[-1], column
        elif ending == "ply" and name == "cloudcompare.asc" and column in RGB:
            assert np.array_equal(after[column], BYTES[kept, RGB.index(column)])
        else:
            assert np.array_equal(after[column], values[kept]), column


def test_columns_can_be_named(run, tmp_path):
    path = tmp_path / "in.txt"
    path.write_text(lines([INTENSITY, POINTS, BYTES[:, :1]], " "))
    run("simplify", path, tmp_path / "o.ply", "--ratio", "0.5", "--columns", "depth,x,y,z,_")
    table = PlyData.read(tmp_path / "o.ply")["vertex"].data
    assert table.dtype.names == ("depth", "x", "y", "z")
    kept = salcore.simplify(POINTS, ratio=0.5).indices
    assert np.array_equal(table["depth"], INTENSITY[kept])
    for columns, why in (
        ("x,y,z", "has 5 columns, and --columns names 3"),
        ("x,y,z,x,_", "x is named twice"),
        ("a,b,c,d,e", "no numbers are called x y z"),
    ):
        arguments = ("--ratio", "0.5", "--force", "--columns", columns)
        assert why in run("simplify", path, tmp_path / "o.ply", *arguments, status=2)
    said = run("simplify", tmp_path / "o.ply", tmp_path / "p.ply", "--ratio", "0.5",
               "--columns", "x,y,z", status=2)  # fmt: skip
    assert "--columns: is for text" in said


def test_decimal_commas(tmp_path):
    path = tmp_path / "german.csv"
    rows = [";".join(repr(v).replace(".", ",") for v in row) for row in POINTS.tolist()]
    path.write_text("x;y;z\n" + "\n".join(rows))
    assert np.array_equal(text.read(path)[0].points, POINTS)
    path.write_text("\n".join(row.replace(";", " ") for row in rows))
    assert np.array_equal(text.read(path)[0].points, POINTS)


def test_several_clouds_in_one_pts_file(tmp_path):
    path = tmp_path / "in.pts"
    path.write_text(f"50\n{lines([POINTS[:50]], ' ')}\n70\n{lines([POINTS[50:120]], ' ')}\n")
    assert np.array_equal(text.read(path)[0].points, POINTS[:120])


def test_encodings(tmp_path):
    path = tmp_path / "in.csv"
    for encoding in ("utf-8-sig", "utf-16", "latin-1"):
        path.write_bytes(("x,y,z,Höhe\n" + lines([POINTS, INTENSITY], ",")).encode(encoding))
        assert np.array_equal(text.read(path)[0].points, POINTS)


HOSTILE = {
    "header.csv": b"x,y,z\n",
    "words.txt": b"This is a letter,\nand no cloud.\n",
    "globe.csv": b"lat,lon,alt\n" + b"1,2,3\n" * 9,
    "two.xyz": b"1 2\n3 4\n",
    "short.pts": b"1000000000\n1 2 3\n4 5 6\n",
    "more.pts": b"1\n1 2 3\n4 5 6\n",
    "ragged.xyz": b"1 2 3\n4 5\n6 7 8\n",
    "cut.csv": b"x,y,z\n1,2,3\n4,5,\n",
    "binary.xyz": bytes(500),
    "grid.asc": b"ncols 3\nnrows 3\n1 2 3\n",
    "word.csv": b"x,y,z\n1,2,3\n" * 400,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_damaged_text_ends_in_one_sentence(run, tmp_path, name):
    (tmp_path / name).write_bytes(HOSTILE[name])
    said = run("simplify", tmp_path / name, tmp_path / "o.ply", "--ratio", "0.5", status=2)
    assert name in said
    assert [path.name for path in Path(tmp_path).iterdir()] == [name]
