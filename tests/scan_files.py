# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans that several tests write."""

from __future__ import annotations

import laspy
import numpy as np
from shapes import bumpy

MAP = np.array([637100.25, 851327.5, 424.0])
"""Where a scan in map coordinates lies."""
RNG = np.random.default_rng(6)
POINTS = bumpy() * 100.0 + MAP


def make_las(path, point_format=7, version="1.4", shift=(0.0, 0.0, 0.0)):
    """Write a LAS file with values in every dimension and in extra bytes."""
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.offsets, header.scales = np.floor(MAP) + shift, [0.01, 0.01, 0.001]
    header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "a map", b"PROJCS[...]\0"))
    header.add_extra_dim(laspy.ExtraBytesParams("roughness", np.float32))
    header.add_extra_dim(laspy.ExtraBytesParams("direction", "3f8"))
    file = laspy.LasData(header)
    file.x, file.y, file.z = (POINTS + shift).T
    for dimension in file.point_format.dimensions:
        name, bits = dimension.name, dimension.num_bits
        if name in ("X", "Y", "Z", "direction"):
            continue
        if name in ("roughness", "gps_time"):
            file[name] = RNG.random(len(POINTS)) * 1e9
        else:
            file[name] = RNG.integers(0, 2 ** (bits - 1), len(POINTS))
    file["direction"] = RNG.normal(size=POINTS.shape)
    file.write(str(path))
    return path
