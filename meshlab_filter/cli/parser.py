# SPDX-License-Identifier: GPL-3.0-or-later
"""A parser of options whose help fits on a screen, and whose mistakes are one line."""

from __future__ import annotations

import argparse
import re
from typing import Any, NoReturn

MISTAKE = 2
"""Exit status after a mistake of the user."""
COMMON = (
    "input", "output", "original", "simplified", "folder", "ratio", "ratios", "count", "faces",
    "max_error", "placement", "detail", "points", "keep_border", "picture",
    "memory", "report", "force", "help", "help_all",
)  # fmt: skip
"""What most people use: all that ``--help`` shows."""


class ShortHelp(argparse.HelpFormatter):
    """Help that fits on a screen: the common options, with their first sentences."""

    def add_argument(self, action: argparse.Action) -> None:
        """Leave the other options out."""
        if action.dest in COMMON or action.nargs == argparse.PARSER:
            super().add_argument(action)

    def _expand_help(self, action: argparse.Action) -> str:
        return re.split(r"[.;] |\.$", super()._expand_help(action))[0]


class HelpAll(argparse.Action):
    """Show all options."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        """Print the whole help and exit."""
        parser.formatter_class = argparse.HelpFormatter
        parser.print_help()
        parser.exit()


class Completion(argparse.Action):
    """Print what a shell needs to complete commands and options."""

    def __call__(self, parser: argparse.ArgumentParser, _: object, shell: Any, *__: object) -> None:
        """Print the script and exit."""
        try:
            import shtab
        except ImportError:
            parser.error("--completion needs shtab; install it: pip install shtab")
        print(shtab.complete(parser, shell))
        parser.exit()


class Parser(argparse.ArgumentParser):
    """A parser that reports a mistake in one line."""

    def error(self, message: str) -> NoReturn:
        """Exit with the message alone, without the usage."""
        text = " ".join(message.split())
        self.exit(MISTAKE, f"salient-simplify: error: {text}; see {self.prog} --help\n")
