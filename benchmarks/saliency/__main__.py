# SPDX-License-Identifier: GPL-3.0-or-later
"""What the saliency and the regions find, how steady they are, and what they cost.

    python -m benchmarks.saliency [--models FOLDER] [--figures FOLDER]

Writes saliency.md.
"""

from __future__ import annotations

from benchmarks.common.models import present
from benchmarks.common.page import options, write
from benchmarks.common.shapes import read
from benchmarks.saliency import exact, models, regions, times
from benchmarks.saliency.maps import OURS, PEERS


def main() -> None:
    """Measure the models that are there, and the exact shapes."""
    chosen = options(__doc__)
    parts = [
        ABOUT_EXACT + "10,000 points:",
        exact.exact([10_000], OURS | PEERS),
        "The mean over 10,000 and 40,000 points:",
        exact.exact([10_000, 40_000], OURS),
        ABOUT_MODELS,
        models.models(present(chosen.models / name for name in models.NAMES)),
        ABOUT_REGIONS,
    ]
    for path in present([chosen.models / regions.PART]):
        parts += [f"{path.stem}:", regions.on_part(read(path))]
    parts.append(ABOUT_STEADINESS)
    for path in present(chosen.models / name for name in regions.MODELS):
        parts += [f"{path.stem}:", regions.steadiness(read(path))]
    parts += [ABOUT_TIMES, times.times(present(chosen.models / name for name in times.NAMES))]
    page = chosen.figures / "saliency.md"
    write(page, "Saliency and regions", "benchmarks.saliency", *parts)


ABOUT_EXACT = """## Exact shapes

A word engraved on a sphere, fillets of four radii, pockets of nine sizes, made by formulas
(`benchmarks/saliency/shapes.py`). How often a point on a feature has a larger value than one
clearly off (AUC): without noise, with Gaussian noise along the normals as a share of the diagonal,
and with 0.1 % on one half, which asks whether noise looks salient beside features.

"""
ABOUT_MODELS = """## Scans

Rank correlation of each map of a noisy, thinner or reordered model with its own of the model
itself. Noise as above; thinner models are clouds of points drawn at random."""
ABOUT_REGIONS = """## Regions

On a machine part the faces are its triangles between edges of more than 20 degrees. Agreement is
the adjusted Rand index (1: the same regions, 0: by chance) of regions and faces over the vertices
on no sharp edge; recall the share of the sharp edges' vertices with a region's border within one
ring; precision the share of the borders' vertices with a sharp edge within one."""
ABOUT_STEADINESS = """Agreement of the regions of a noisy, thinner or reordered model with those of
the model itself, and the share of the vertices in the largest region:"""
ABOUT_TIMES = """## Times

Processor seconds, the least of three runs on one thread. Scales and regions are worked out only
when they are asked for."""


if __name__ == "__main__":
    main()
