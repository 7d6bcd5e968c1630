# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans larger than memory: tiles in a work folder, by a pool of processes or a Dask cluster.

job     what a run is about: its files, its target, its work folder
bins    LAS files in chunks: points counted in cells, then spilled by tiles
stages  what is worked out for one tile, each from files to one file
run     the stages in order, by processes of this machine or by workers of a cluster
errors  how far all points are from those kept, and the fewest within an error
split   the kept points as a file a tile, with an index
write   the kept points, with all they carry, chunk by chunk into one file
"""
