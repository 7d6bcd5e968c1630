# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files and MeshLab projects: read, write, and survive what goes wrong on the way.

files
    Check the paths that a user names, and load them.
formats
    The table of formats: who reads and writes which.
documents, mesh_document
    One face for what the command works on, read here or by MeshLab.
layer, wedges
    A cloud or mesh with all its values, and what tells its charts apart.
ply, ply_write, obj, obj_write, mtl, gltf, polygons
    Meshes, scenes and their materials.
text, columns, las, pcd, ptx, e57, scans
    Clouds and scans, and several of them as one.
write
    Write a layer with its textures.
headers
    Read what MeshLab's readers ignore: whether a file is complete, and what they will drop.
pymeshlab_io
    Call pymeshlab's readers and writers, silently and with errors of one kind.
save, projects
    Write a layer, or a project with all its layers, by MeshLab.
verify
    Read a file back and report what its format lost.
staging
    Make outputs appear whole or not at all.
supervise
    Run the work in a child process and clean up after it.
"""
