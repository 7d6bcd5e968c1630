# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender properties made from salcore's table, and the rows that draw them."""
