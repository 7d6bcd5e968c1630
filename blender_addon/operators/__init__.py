# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators: each reads arrays, has the worker compute, and commits what comes back."""
