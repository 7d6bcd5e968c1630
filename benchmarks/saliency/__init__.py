# SPDX-License-Identifier: GPL-3.0-or-later
"""How well maps of saliency find known features, and how steady maps and regions are."""
