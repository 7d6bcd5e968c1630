# SPDX-License-Identifier: GPL-3.0-or-later
"""What callers give, checked and cleaned once; what comes after trusts it.

geometry     points, faces and normals: distinct, finite, centred, with index maps to the input
constraints  protected and important points, seams
layers       values of corners: textures, normals, colours, materials
wedges       corners at one vertex with the same values, and seams between them
seams        edges where values of corners differ
memory       how much memory an input takes
"""
