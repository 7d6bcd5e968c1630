# SPDX-License-Identifier: GPL-3.0-or-later
"""``salient-simplify``, or ``python -m meshlab_filter``."""

import io
import sys

from .watch import FAILURE, watch


def main() -> int:
    """Run the command in a process that is looked after, and return its exit status."""
    return watch(_work)


def _work() -> int:
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may lack letters of a file's name
            stream.reconfigure(errors="backslashreplace")
    try:
        from .command import main as command  # numpy and pymeshlab take their time
    except ImportError as error:
        print(
            f"salient-simplify: error: {error}; the command needs what is installed by "
            "pip install 'salient-simplify[meshlab]'",
            file=sys.stderr,
        )
        return FAILURE
    return command()


if __name__ == "__main__":
    raise SystemExit(main())
