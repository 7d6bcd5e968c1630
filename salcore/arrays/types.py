# SPDX-License-Identifier: GPL-3.0-or-later
"""Names for the types of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Ints = NDArray[np.int32]
"""Vertex numbers where there are many of them."""
Integers = NDArray[np.integer]
"""Of any width."""
Keys = NDArray[np.int64]
"""One number for several, such as the two ends of an edge."""
Mask = NDArray[np.bool_]
