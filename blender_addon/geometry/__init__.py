# SPDX-License-Identifier: GPL-3.0-or-later
"""Between Blender's data and arrays. `topology` alone knows no bpy: the worker imports it."""
