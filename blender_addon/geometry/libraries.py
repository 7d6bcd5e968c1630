# SPDX-License-Identifier: GPL-3.0-or-later
"""Libraries that come with the extension and are wanted for some files only."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

from .read import HostError


def required(library: str, path: Path) -> Any:
    """Import a library that reads a file.

    Raises
    ------
    HostError
        If it is not there.
    """
    try:
        return importlib.import_module(library)
    except ImportError:
        version = "{}.{}".format(*sys.version_info)
        raise HostError(
            f"{path.name}: {path.suffix} files need the library {library}, which this build of "
            f"the extension does not bring for Python {version}; install the extension's own zip"
        ) from None
