# SPDX-License-Identifier: GPL-3.0-or-later
"""A parser of options whose help fits on a screen, and whose mistakes are one line."""

from __future__ import annotations

import argparse
import difflib
import re
import sys
from itertools import takewhile
from typing import Any, NoReturn

MISTAKE = 2
"""Exit status after a mistake of the user."""
COMMON = (
    "input", "output", "original", "simplified", "folder", "ratio", "ratios", "count", "faces",
    "max_error", "placement", "detail", "points", "keep_border", "picture",
    "memory", "report", "force", "help", "help_all",
)  # fmt: skip
"""What most people use: all that ``--help`` shows."""


PLAIN = (
    (r"argument (.+): invalid int value: (.*)", r"\1: \2 is no whole number"),
    (r"argument (.+): invalid float value: (.*)", r"\1: \2 is no number"),
    (r"argument (.+): expected (one|at least one) argument", r"\1: give a value after it"),
    (r"argument (.+): not allowed with argument (.+)", r"\1: not together with \2; give one"),
    (r"argument COMMAND: invalid choice: (.+) \(choose from (.+)\)",
     r"\1 is no command; give one of \2"),
    (r"argument (.+): invalid choice: (.+) \(choose from (.+)\)", r"\1: \2 is none of \3"),
    (r"one of the arguments (.+) (\S+) is required",
     r"nothing says how much to keep: give one of \1 or \2"),
    (r"the following arguments are required: (.+)", r"missing: \1"),
    (r"unrecognized arguments: (.+)", r"\1: one argument too many"),
    (r"argument (.+?): (.+)", r"\1: \2"),
)  # fmt: skip
"""How the library's messages read in plain English; the first that fits."""


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

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse an unknown option before anything that may be missing because of it."""
        given = sys.argv[1:] if args is None else list(args)
        if self._subparsers is not None:  # what follows the command is the command's
            given = list(takewhile(lambda text: text.startswith("-"), given))
        for text in takewhile(lambda text: text != "--", given):
            self._check_known(text.partition("=")[0])
        return super().parse_known_args(args, namespace)

    def _check_known(self, name: str) -> None:
        """Refuse an option that no option begins with."""
        options = self._option_string_actions
        if not name.startswith("--") or any(known.startswith(name) for known in options):
            return
        close = difflib.get_close_matches(name, options, 1)
        self.error(f"{name}: no such option" + (f"; did you mean {close[0]}?" if close else ""))

    def error(self, message: str) -> NoReturn:
        """Exit with the message alone, in plain words, without the usage."""
        text = " ".join(message.split())
        for pattern, plain in PLAIN:
            if re.fullmatch(pattern, text):
                text = re.sub(pattern, plain, text)
                break
        self.exit(MISTAKE, f"salient-simplify: error: {text}; see {self.prog} --help\n")
