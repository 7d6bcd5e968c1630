# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors and warnings of the file side."""

from collections.abc import Callable

import salcore

Warn = Callable[[str], None]
"""Called with one sentence."""


class FileError(salcore.SalcoreError):
    """A file that cannot be read or written."""


def ignore(message: str) -> None:
    """Ignore a warning."""
