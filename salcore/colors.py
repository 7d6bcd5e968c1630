# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours for maps, as arrays: all hosts show saliency and regions alike."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays.types import Floats


def saliency_colors(saliency: Floats) -> Floats:
    """Return (n, 3) colours from blue over green and yellow to red, as in figure 6."""
    stops = np.array(
        [[0.13, 0.2, 0.62], [0.12, 0.6, 0.85], [0.35, 0.8, 0.4], [0.98, 0.85, 0.2], [0.8, 0.1, 0.1]]
    )
    at = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(saliency, at, stops[:, k]) for k in range(3)], axis=1)


def region_colors(labels: NDArray[np.int64]) -> Floats:
    """Return (n, 3) colours in [0, 1]: grey for the largest region, bright ones for the others."""
    # Steps of the golden ratio spread hues evenly however many there are.
    hue = (np.maximum(labels, 0) * 0.6180339887498949) % 1.0
    wheel = np.abs((hue[:, None] * 6.0 + [0.0, 4.0, 2.0]) % 6.0 - 3.0) - 1.0
    colors: Floats = 0.25 + 0.7 * np.clip(wheel, 0.0, 1.0)
    size = np.bincount(labels[labels >= 0], minlength=1)
    plain = (labels < 0) | (labels == size.argmax())
    return np.where(plain[:, None], 0.72, colors)
