# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds and meshes in tiles: each is analysed and ordered by itself, and one count holds for all.

plan         boxes of about so many points, and the width of their halos
tile         what is worked out for a tile of a cloud: its maps and surface, how its core goes
merge        what all tiles together come to: the scale of saliency, mean areas, the cut of a count
mesh         what is worked out for a tile of a mesh, which goes in passes
pieces       what a pass leaves of a tile, cut up and joined for the next
mesh_refine  the light mesh, refined by tiles

Everything here takes and returns arrays; files, processes and clusters are the hosts' affair.
"""
