# SPDX-License-Identifier: GPL-3.0-or-later
"""Our results beside the tables and figures of the paper, and what each of its parts adds."""
