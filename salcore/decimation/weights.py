# SPDX-License-Identifier: GPL-3.0-or-later
"""What a removal costs beside its quadric error, from saliency, constraints and parameters."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Floats, Mask
from ..input.constraints import Constraints
from ..input.geometry import Geometry
from ..method.frames import Frames
from ..parameters import Parameters
from .costs import FLAT_EVENNESS, Weights
from .surface import GUESSED_BORDER


def weigh_removals(
    geometry: Geometry,
    frames: Frames,
    saliency: Floats,
    constraints: Constraints,
    parameters: Parameters,
    *,
    extremities: Mask | None = None,
    interest: Floats | None = None,
) -> Weights:
    """Return what the removal of each vertex costs.

    Parameters
    ----------
    geometry : Geometry
    frames : Frames
    saliency : (n,) float64
    constraints : Constraints
    parameters : Parameters
    extremities : (n,) bool, optional
        Interest points on the regions' boundaries, where `Parameters.interest_weight` asks for
        them.
    interest : (n,) float64, optional
        Factor on the costs of removals in regions of interest.
    """
    faces = geometry.faces
    loose = np.ones(len(geometry.points), dtype=bool)
    loose[faces] = False
    factor = 1.0 + parameters.detail * saliency
    factor *= 1.0 + constraints.importance
    if extremities is not None:
        factor *= 1.0 + parameters.interest_weight * extremities
    if interest is not None:
        factor *= interest
    values = constraints.values
    if values is not None:
        values = parameters.attribute_weight * float(frames.radius.mean()) * values
    return Weights(
        factor,
        evenness=np.maximum(parameters.evenness * loose, FLAT_EVENNESS),
        guessed_surface=loose,
        protected=constraints.staying,
        border=parameters.border_weight * (1.0 if len(faces) else GUESSED_BORDER),
        values=values if parameters.attribute_weight else None,
    )


def weigh_cloud(saliency: Floats, parameters: Parameters) -> Weights:
    """Return what the removal of each vertex (n,) of a cloud without constraints costs."""
    count = len(saliency)
    return Weights(
        1.0 + parameters.detail * saliency,
        evenness=np.full(count, max(parameters.evenness, FLAT_EVENNESS)),
        guessed_surface=np.ones(count, dtype=bool),
        protected=np.zeros(count, dtype=bool),
        border=parameters.border_weight * GUESSED_BORDER,
    )
