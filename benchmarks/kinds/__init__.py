# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are not single scanned surfaces: many parts, flat sides, colours, textures."""
