# SPDX-License-Identifier: GPL-3.0-or-later
"""Other methods at equal count: what they keep, how far that is from the input, what they cost."""
