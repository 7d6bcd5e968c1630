# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of the file side."""

import salcore


class FileError(salcore.SalcoreError):
    """A file that cannot be read or written."""
