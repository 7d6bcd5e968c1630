# SPDX-License-Identifier: GPL-3.0-or-later
"""``salient-simplify``, or ``python -m meshlab_filter``."""

import io
import sys

from .io.supervise import FAILURE, supervise


def main() -> int:
    """Run the command in a supervised process and return its exit status."""
    return supervise(_run_command)


def _run_command() -> int:
    """Read the options, then import the command, which takes a second, and run it."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may lack characters of a file name
            stream.reconfigure(errors="backslashreplace")
    try:
        from .cli.options import make_parser

        options = make_parser().parse_args()
        from .cli.command import run
    except ImportError as error:
        print(
            f"salient-simplify: error: {error}; the command needs what is installed by "
            "pip install 'salient-simplify[meshlab]'",
            file=sys.stderr,
        )
        return FAILURE
    return run(options)


if __name__ == "__main__":
    raise SystemExit(main())
