# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and memory of our own code."""
