# SPDX-License-Identifier: GPL-3.0-or-later
"""What users see: the sidebar and the menu."""
