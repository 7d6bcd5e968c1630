# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a simplified geometry is from its original (paper §5).

distances  exact distances of points to a mesh, and to the tangent planes of a cloud
errors     largest, mean and root of the mean square, both ways: (5.1) and (5.2)
"""
