# SPDX-License-Identifier: GPL-3.0-or-later
"""Models and shapes to measure on, and the peak of memory."""
