# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker: a child process that analyses and simplifies, so that Blender's window stays free.

host
    Blender's end: starts the child, sends requests, reads messages. Knows neither bpy nor salcore.
child
    The child's end: a script that answers requests. Knows salcore and no bpy.
requests
    What can be asked: plain functions, arrays in, arrays out. Both processes can run them.
wire
    How messages travel: JSON and the arrays' bytes.
"""
