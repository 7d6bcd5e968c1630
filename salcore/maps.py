# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of a geometry: normals, saliency at every scale, regions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays.blocks import set_workers
from .arrays.check import as_array
from .arrays.types import Floats, Integers, Ints, Mask
from .errors import ParameterError
from .input.geometry import Geometry
from .method.frames import Frames
from .method.graph import Graph
from .method.interest import boundary_extremities
from .method.regions import Regions, build_regions
from .method.saliency import Saliency
from .method.scales import ScaleSpace, build_scales
from .method.segmentation import RegionTable, border_lines, describe_regions, segment
from .parameters import Parameters, shown
from .progress import Callback, Progress

MAPS_BEGIN = 0.6
"""Share of the time that the analysis takes, of it and `Maps.prepare`."""


@dataclass(frozen=True, eq=False)
class Maps:
    """What is known of a geometry. What takes time is worked out when first asked for.

    Attributes
    ----------
    geometry : Geometry
        The cleaned input. The attributes below speak of its n vertices.
    graph : Graph
    frames : Frames
    saliency_map : Saliency
        The paper's saliency, at the neighbours' distance alone: a weight of the elimination.
    scales : ScaleSpace
        Saliency at every scale, with the noise and each scale's own: the saliency that is shown.
    segmentation : Regions
        Of the kind that `Parameters.segmentation` names.
    components : Regions
        Components of like saliency at the neighbours' distance, which a threshold α looks at.
    extremities : (n,) bool
        Interest points on the components' boundaries; they do not depend on α.
    parameters : Parameters
    seconds : float
        Time the analysis took.
    """

    geometry: Geometry
    graph: Graph
    frames: Frames
    saliency_map: Saliency
    parameters: Parameters
    seconds: float

    def prepare(self, *, regions: bool = False, progress: Callback | None = None) -> None:
        """Work out the saliency at every scale, which otherwise waits until it is asked for.

        Parameters
        ----------
        regions : bool
            The regions as well.
        progress : callable, optional
            Called with stage and fraction; returning False cancels.

        Raises
        ------
        Cancelled
            If `progress` returned False.

        Notes
        -----
        O(n log n) time: half of what the analysis took, and as much again for regions.

        Examples
        --------
        >>> import numpy as np, salcore
        >>> analysis = salcore.analyze(np.random.default_rng(0).random((500, 3)))
        >>> analysis.prepare(regions=True, progress=lambda stage, share: True)
        >>> len(analysis.region_table) == analysis.segmentation.count
        True
        """
        work, share = Progress(progress), 0.5 if regions else 1.0
        # A cached property keeps its value here, whoever works it out.
        if "scales" not in self.__dict__:
            part = work.part(0.0, share, "Scales")
            self.__dict__["scales"] = self._build_scales(part)
        if regions and "segmentation" not in self.__dict__:
            part = work.part(share, 1.0, "Regions")
            self.__dict__["segmentation"] = self._build_segmentation(part)

    @cached_property
    def scales(self) -> ScaleSpace:
        return self._build_scales(Progress())

    def _build_scales(self, work: Progress) -> ScaleSpace:
        with set_workers(self.parameters.workers):
            return build_scales(
                self.geometry, self.graph, self.frames, self.saliency_map, self.parameters, work
            )

    @cached_property
    def segmentation(self) -> Regions:
        return self._build_segmentation(Progress())

    def _build_segmentation(self, work: Progress) -> Regions:
        with set_workers(self.parameters.workers):
            return segment(self.geometry, self.graph, self.scales, self.parameters, work)

    @cached_property
    def components(self) -> Regions:
        with set_workers(self.parameters.workers):
            return build_regions(
                self.geometry, self.graph, self.saliency_map.scaled, self.parameters.tolerance
            )

    @cached_property
    def extremities(self) -> Mask:
        angle = self.parameters.collinear_angle
        return boundary_extremities(self.geometry.points, self.components, angle)

    @property
    def saliency(self) -> Floats:
        """(N,) float64 in [0, 1] over all input points, high = salient; 0 for dropped points."""
        return self._of_input(self.scales.scaled, 0.0)

    @property
    def regions(self) -> NDArray[np.int64]:
        """(N,) int64 region of every input point; -1 for dropped points.

        Region 0 has the highest mean saliency, and so on down.
        """
        return self._of_input(self.segmentation.labels, -1).astype(np.int64)

    @cached_property
    def region_table(self) -> RegionTable:
        """The regions, the most salient first: area, saliency, centre and bounding box of each."""
        return describe_regions(self.geometry, self.graph, self.segmentation, self.scales.scaled)

    def in_regions(self, numbers: ArrayLike) -> Mask:
        """Return which input points (N,) lie in some regions: a selection, or ``protect=``.

        Parameters
        ----------
        numbers : int or sequence of int
            Rows of `region_table`.

        Raises
        ------
        ParameterError
            If a number is none of a region.

        Examples
        --------
        >>> import numpy as np, salcore
        >>> analysis = salcore.analyze(np.random.default_rng(0).random((500, 3)))
        >>> light = analysis.simplify(ratio=0.5, protect=analysis.in_regions(0))
        >>> bool(np.isin(np.flatnonzero(analysis.regions == 0), light.indices).all())
        True
        """
        wanted, count = as_array(numbers, "numbers", "numbers of regions"), self.segmentation.count
        if wanted.size and (wanted.dtype.kind not in "iu" or not self._are_regions(wanted)):
            raise ParameterError(
                f"numbers={shown(numbers)}: give whole numbers of regions, from 0 to {count - 1}"
            )
        return np.isin(self.regions, wanted.astype(np.int64))

    def _are_regions(self, numbers: Integers) -> bool:
        return bool(((numbers >= 0) & (numbers < self.segmentation.count)).all())

    @property
    def normals(self) -> Floats:
        """(N, 3) float64 unit normals of all input points; zero where there is none."""
        return self._of_input(self.frames.normals, 0.0)

    def _interest_cost(self, work: Progress) -> Floats | None:
        """Return by what removals (n,) in the regions of interest cost more; None without any.

        The error of a triangle grows with the fourth power of its side, so that at equal cost the
        density grows with the root of the factor.
        """
        wanted, density = self.parameters.regions_of_interest, self.parameters.interest_density
        if not wanted or density == 1.0:
            return None
        self.prepare(regions=True, progress=work.portion(0.0, 1.0))
        return np.where(self.segmentation.labels < wanted, density**2, 1.0)

    def _region_lines(self, triangles: Ints, work: Progress) -> Ints:
        """Return the edges (s, 2) along the regions' borders, if they are to stay."""
        if not self.parameters.keep_regions:
            return np.empty((0, 2), dtype=np.int32)
        self.prepare(regions=True, progress=work.portion(0.0, 1.0))
        return border_lines(triangles, self.segmentation.labels)

    def _of_input(self, values: NDArray[Any], missing: float) -> NDArray[Any]:
        """Spread values of vertices over the input points."""
        vertex = self.geometry.vertex_of
        if not len(values):
            return np.full((len(vertex), *values.shape[1:]), missing, dtype=values.dtype)
        result = values[vertex]
        result[vertex < 0] = missing
        return result
