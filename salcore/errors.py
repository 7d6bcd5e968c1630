# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors a caller can act on; each message names the argument, the value and the remedy."""


class SalcoreError(ValueError):
    """Base of every error that bad input to salcore raises."""


class GeometryError(SalcoreError):
    """Points, faces or normals that cannot be understood."""


class ParameterError(SalcoreError):
    """A parameter or target that is unknown, of the wrong type or out of bounds."""


class MemoryLimitError(SalcoreError):
    """The input would need more memory than the machine has free."""


class Cancelled(Exception):
    """A progress callback returned False. Not a mistake, hence not a `SalcoreError`."""
