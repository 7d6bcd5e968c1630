# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans larger than memory: tiles in a work folder, by a pool of processes or a Dask cluster.

job      what a run is about: its files, its target, its work folder
bins     LAS files in chunks: points counted in cells, then spilled by tiles
stages   what is worked out for one tile, each from files to one file
run      the stages in order
workers  who does the work: processes of this machine, or workers of a cluster
errors   how far all points are from those kept, and the fewest within an error
split    the kept points as a file a tile, with an index
write    the kept points, with all they carry, chunk by chunk into one file

Meshes, in a PLY file:

mesh_job      what a run on a mesh is about, and its passes
ply_blocks   binary PLY files in blocks
mesh_stages   what is worked out for one tile of a mesh
mesh_refine  the light mesh, refined by tiles of its own
mesh_run      the passes in order
mesh_write    the light mesh, block by block into one file
"""
