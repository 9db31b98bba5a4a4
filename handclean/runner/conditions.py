"""Conditions on figures: ``--require "residual_mm<=1"``."""

import operator
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from handclean.errors import UnknownSettingError, UsageError

COMPARE = {
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
    "==": operator.eq,
}


@dataclass(frozen=True, kw_only=True)
class Condition:
    """``figure`` should compare so with ``value``."""

    figure: str
    sign: str
    value: float

    def unmet(self, figures: Mapping[str, Any]) -> str:
        """Say what is wrong with the figures, or nothing."""
        found = figures.get(self.figure)
        if isinstance(found, bool | int | float):
            if COMPARE[self.sign](found, self.value):
                return ""
            said = f"{found:g}"
        else:
            said = "not known" if found is None else repr(found)
        return f"{self.figure} is {said}, required {self.sign} {self.value:g}"


def is_known(name: str, known: Collection[str]) -> bool:
    """Whether a figure is one of those known, or fits one with a star."""
    return any(fnmatchcase(name, pattern) for pattern in known)


def parse(text: str, known: Collection[str]) -> Condition:
    """Read a condition on one of the figures that are known.

    Raises
    ------
    UsageError
        If it is not of the form NAME<=VALUE, or no figure has that name.
    """
    match = re.fullmatch(r"\s*([\w.-]+?)\s*(<=|>=|==|<|>)\s*([^\s=<>]\S*)\s*", text)
    if match is None:
        raise UsageError(f"--require should be NAME<=VALUE, not '{text}'")
    name, sign, number = match.groups()
    try:
        value = float(number)
    except ValueError:
        raise UsageError(
            f"--require {text}: the value should be a number, not '{number}'"
        ) from None
    if not is_known(name, known):
        raise UnknownSettingError("--require", "figure", name, known)
    return Condition(figure=name, sign=sign, value=value)
