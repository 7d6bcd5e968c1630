# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans as files, and runs over them by small tiles."""

import laspy
import numpy as np

import salcore
from meshlab_filter.large.job import Job, look_at

RATIO = 0.1


def write_scan(path, points, scale=0.01, offset=None, intensity=0):
    """Write points with colours and intensity that tell them apart."""
    header = laspy.LasHeader(version="1.2", point_format=2)
    header.scales = [scale] * 3
    header.offsets = np.floor(points.min(axis=0)) if offset is None else offset
    scan = laspy.LasData(header)
    scan.x, scan.y, scan.z = points.T
    scan.intensity = (np.arange(len(points)) + intensity) % 65536
    scan.red = np.arange(len(points)) // 65536
    scan.write(str(path))
    return path


def make_job(folder, paths, target="ratio", value=RATIO, most=10_000, errors=False):
    """Return a job of small tiles."""
    return Job(
        str(folder),
        look_at(paths),
        salcore.Parameters().as_dict(),
        target,
        float(value),
        most,
        errors,
    )
