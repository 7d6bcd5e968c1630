# SPDX-License-Identifier: GPL-3.0-or-later
"""Any count, ratio or error, beyond the paper: half-edge collapses in order, and cuts through it.

surface             the triangles that are simplified: a mesh's faces, a cloud's stars
quadrics            sums of squared distances to planes
weights             what a removal costs beside: saliency, importance, values
attribute_costs     differences of colours and other values of points
costs               what a collapse costs
half_edges          the edges that are left, both ways, with their costs
one_rings           the faces and edges round the vertices that a round removes
legality            which collapses a surface can bear
parts               when a part of a mesh goes whole
rounds              the rounds of collapses, and the surface that is left
order               all rounds: rank, parent and error of every vertex
cut                 what a count keeps, and what stands for the rest
targets             what a caller asks for, as a count
wedge_collapses     where the values of corners go
samples             of the original surface, by which a cut is refined
nearest_faces       the face of a cut that each sample lies nearest to
flips               edge flips: which are legal, what they gain, which can be done together
refine              flips after the cut
fitting             positions and flips that bring a cut nearest to its original
kept_points         the kept vertices in the input's own numbers
normal_transfer     the original's normals for a light mesh
put_backs           the backs of faces that were given on both sides
attribute_transfer  where corners and edges of the result take their values from
"""
