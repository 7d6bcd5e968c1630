# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m meshlab_filter`` is the command ``salient-simplify``."""

from .command import main

if __name__ == "__main__":
    raise SystemExit(main())
