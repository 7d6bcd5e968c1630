# SPDX-License-Identifier: GPL-3.0-or-later
"""The published method, and where to find each equation of the paper.

===========  =====================================  ============================================
equation     function                               what it is
===========  =====================================  ============================================
§2.1         `graph.build_graph`                    neighbours D(i); on clouds `stars`
(2.1)        `planes.mean_offset`                   mean of the neighbours
(2.2)        `planes.covariance`                    covariance C; its normal: `planes.fit_normals`
(3.1)        `patches.patch_side`                   side L of the square patch
(3.2)        `patches.normal_angle`                 angle between normals
(3.3)        `patches.deviation_factor`             deviation factor DF
(3.4)        `saliency.similarity`                  weight ω
(3.5)        `frames.neighborhood_radius`           radius σ
(3.6)        `saliency.deviating`                   what C_x counts; the share is its mean
(3.7)        `saliency.entropy`                     entropy of the share
(3.8)        `saliency.patch_saliency`              saliency of a patch
(3.9)        `saliency.vertex_saliency`             saliency SL of a vertex
(4.1)        `regions.similar`                      whether two vertices are of like saliency
(4.2)        `regions.grow_regions`                 regions, algorithm 1
(4.3) (4.4)  `interest.triangle_areas`              area of three boundary vertices
(4.5)        `interest.local_means`                 LMS
(4.6)        `interest.global_mean`                 GMS
(4.7)        `interest.salient_points`              ITP: interest points inside regions
===========  =====================================  ============================================

Beyond the paper: (3.9) at every scale, `scales`, on contracted graphs, `contraction`, with their
`noise`; regions of three kinds, `segmentation`: `islands` ((4.1) between regions), `basins`, and
the paper's `regions`.

(5.1) and (5.2) are `salcore.Deviation`. The coverage guard, `coverage.close_gaps`, is ours.
"""

from .frames import neighborhood_radius
from .interest import global_mean, local_means, salient_points, triangle_areas
from .patches import deviation_factor, normal_angle, patch_side
from .planes import covariance, mean_offset
from .regions import grow_regions, similar
from .saliency import deviating, entropy, patch_saliency, similarity, vertex_saliency

EQUATIONS = {
    "2.1": mean_offset,
    "2.2": covariance,
    "3.1": patch_side,
    "3.2": normal_angle,
    "3.3": deviation_factor,
    "3.4": similarity,
    "3.5": neighborhood_radius,
    "3.6": deviating,
    "3.7": entropy,
    "3.8": patch_saliency,
    "3.9": vertex_saliency,
    "4.1": similar,
    "4.2": grow_regions,
    "4.3": triangle_areas,
    "4.4": triangle_areas,
    "4.5": local_means,
    "4.6": global_mean,
    "4.7": salient_points,
}
"""Every equation of sections 2 to 4, by its number."""
