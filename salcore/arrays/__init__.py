# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools on arrays that know nothing of the method.

types    names for the array types
check    what callers give, made numpy arrays of or refused
vectors  unit vectors, face normals, sums by label, hashes
rows     reductions over the rows of a compressed sparse structure
edges    the undirected edges of triangles, and keys for them
blocks   work in blocks on threads
"""
