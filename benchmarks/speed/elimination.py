# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and course of an elimination, against MeshLab's quadric decimation in the same run.

    python -m benchmarks.speed.elimination MODEL [--cloud] [--ratio 0.1] [--every N]

Prints time, rounds with the cost curve, the time of a further cut, and the peak of memory.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import pymeshlab

import salcore
from benchmarks.common.memory import peak, reset_peak
from benchmarks.common.models import load
from benchmarks.speed.floor import floor


def main() -> None:
    """Measure one model."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("--cloud", action="store_true", help="ignore the faces")
    parser.add_argument("--ratio", type=float, default=0.1)
    parser.add_argument("--every", type=int, default=20, help="print every so many rounds")
    options = parser.parse_args()
    points, faces = load(options.model, options.cloud)
    salcore.simplify(points[:1000], ratio=0.5)
    begun = time.perf_counter()
    floor(points)
    least = time.perf_counter() - begun
    reset_peak()
    before = peak()
    begun = time.perf_counter()
    analysis = salcore.analyze(points, faces)
    analysed = time.perf_counter()
    result = analysis.simplify(ratio=options.ratio)
    done = time.perf_counter()
    ours = done - begun
    analysis.simplify(ratio=options.ratio / 2)
    cut = time.perf_counter() - done
    memory = peak() - before
    print(f"{len(points)} points, floor {least:.2f} s")
    print(
        f"analysis {analysed - begun:.2f} s, order and first cut {done - analysed:.2f} s: "
        f"together {ours / least:.1f} times the floor"
    )
    print(f"a further cut {cut:.3f} s: {cut / least:.3f} times the floor")
    print(f"peak of memory {memory / len(points):.0f} bytes a point")
    if faces is not None:
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(points, faces))
        begun = time.perf_counter()
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=len(result.faces), optimalplacement=False
        )
        theirs = time.perf_counter() - begun
        print(f"MeshLab's quadric decimation {theirs:.2f} s: ours takes {ours / theirs:.2f} of it")
    rounds = np.array(analysis.rounds)
    print(f"{len(rounds)} rounds; living, collapses, largest cost:")
    for living, gone, cost in rounds[:: options.every]:
        print(f"  {int(living):9} {int(gone):7} {cost:.3e}")


if __name__ == "__main__":
    main()
