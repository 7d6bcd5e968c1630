# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``salient-simplify``.

command
    Run a subcommand and return the exit status.
options
    Define the options.
indices
    Write which points are kept, and what stands for the others.
figures
    Format reports as text.
picture
    Draw meshes and clouds.
demo
    Analyse and simplify two scans that come with pymeshlab.
"""
