# SPDX-License-Identifier: GPL-3.0-or-later
"""One row of the table of parameters, and how it checks a value."""

from __future__ import annotations

import math
import numbers
import reprlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from .errors import ParameterError


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One row of the table.

    Attributes
    ----------
    name, label : str
        The Python name, and the words a user interface shows.
    type : type
        `bool`, `int`, `float` or `str`; a `str` parameter has `choices`.
    default, paper : bool, int, float or str
        Values in the presets "default" and "paper".
    minimum, maximum : float
        Inclusive bounds of a number.
    choices : tuple of str
        Allowed values of a `str` parameter.
    unit : str
        Unit of a number; empty for counts, shares and choices.
    symbol : str
        The paper's symbol or equation number; empty for our extensions.
    group : str
        The stage the parameter belongs to, in the paper's order.
    sentence : str
        What the value does, for tooltips and help.
    """

    name: str
    label: str
    type: type
    default: Any
    paper: Any
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()
    unit: str = ""
    symbol: str = ""
    group: str = ""
    sentence: str = ""

    def check(self, value: Any) -> Any:
        """Return `value` as this parameter's type, or raise `ParameterError`."""
        if self.type is str:
            if not isinstance(value, str) or value not in self.choices:
                raise self._error(value, f"choose one of {', '.join(self.choices)}")
            return str(value)
        if self.type is bool:
            if not isinstance(value, numbers.Real | np.bool_) or value not in (True, False):
                raise self._error(value, "give True or False")
            return bool(value)
        kind = "a whole number" if self.type is int else "a number"
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise self._error(value, f"give {kind}")
        try:
            number = float(value)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if self.type is int and math.isfinite(number) and not number.is_integer():
            raise self._error(value, "give a whole number")
        if not self.minimum <= number <= self.maximum:
            raise self._error(value, f"give {kind} from {self.minimum:g} to {self.maximum:g}")
        return self.type(value)

    def _error(self, value: Any, remedy: str) -> ParameterError:
        return ParameterError(f"{self.name}={shown(value)}: {remedy}")


def shown(value: Any) -> str:
    """Return a value as a message shows it: short, whatever it is."""
    try:
        return reprlib.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return f"<{type(value).__name__}>"
