# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds in tiles against the same clouds in memory."""
