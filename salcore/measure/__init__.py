# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a simplified geometry is from its original (paper §5).

distances       exact distances of points to a mesh, and to the tangent planes of a cloud
face_search     the nearest face: groups of queries, then single ones, down a tree of boxes
bounding_boxes  the tree: oriented boxes, and long triangles cut into pieces
triangles       distance of a point to a triangle
errors          largest, mean and root of the mean square, both ways: (5.1) and (5.2)
"""
