# SPDX-License-Identifier: GPL-3.0-or-later
"""The peak of a process's resident set."""

from __future__ import annotations

import resource
import sys
from pathlib import Path


def reset_peak() -> None:
    """Set the peak of the resident set back to its present size, where the system can (Linux)."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        print("the peak cannot be reset here: memory includes loading", file=sys.stderr)


def peak() -> float:
    """Return the peak resident set since the last reset, in bytes."""
    try:
        status = Path("/proc/self/status").read_text()
        return 1024.0 * int(status.split("VmHWM:")[1].split()[0])
    except OSError:
        return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
