"""What stands in cells: numbers, words for none, and places that are none."""

import math
import re

import numpy as np

from handclean.arrays import Floats
from handclean.io.shared.reading import text
from handclean.remarks import Remark, remark

_WORDS = frozenset(("null", "none", "nil", "na", "n/a", "n.a.", "<na>", "missing"))
_WORDS |= frozenset(("#n/a", "#na", "#value!", "#num!", "#div/0!", "-", "--", ".", "?"))
_NOT_A_NUMBER = re.compile(r"[+-]?(nan(\(\w*\))?|\d[.,]#(q?nan|snan|ind)\d*)")

_INFINITE = re.compile(r"[+-]?(\d[.,]#inf\d*|∞)")

BEYOND_SIGHT_M = 1000.0
"""[m] no camera sees so far (chosen)."""

_WHOLE_NUMBER_LIMITS = (32767, 32768, 65535, 2147483647, 2147483648, 4294967295)
"""The greatest whole numbers of two and of four bytes."""

_NEGATIVE_STANDINS = (-1.0, -1000.0)
"""Negative numbers that programs write for "none" (chosen)."""

_LEAST_STANDIN = 999.0
"""No smaller positive number is looked at as standing for "none" (chosen)."""

_SHOWN_NUMBERS = 3
"""Numbers that a remark shows (chosen)."""


def is_missing(cell: str) -> bool:
    """Whether what stands in a cell means that there is no number."""
    plain = cell.strip().lower()
    return not plain or plain in _WORDS or bool(_NOT_A_NUMBER.fullmatch(plain))


def number_in(cell: bytes) -> float:
    """Return the number in a cell; NaN where it is blank or says that there is none.

    Blanks of any kind and quotes around it do not count.

    Raises
    ------
    ValueError
        If it holds something else.
    """
    plain = text(cell).strip().strip('"\ufeff').strip()
    if is_missing(plain):
        return math.nan
    if _INFINITE.fullmatch(plain.lower()):
        return math.inf
    if "_" in plain or not plain.isascii():
        raise ValueError
    return float(plain)


def blank_out(places: Floats, metres: float, remarks: list[Remark]) -> None:
    """Make places that stand for none NaN, in place, and report them.

    Programs write (0, 0, 0) for a sample that they do not have, or the same number on
    all three axes: 9999999, -9999, 999.99, -1, the limit of a whole number, a power of
    ten, or one as far away as -3.697e28. No marker sits there to the last digit. A
    number that stands on one or two axes only is a place, if a strange one.

    Parameters
    ----------
    places : (..., 3), as the file has them.
    metres : the file's unit of length.
    """
    x = places[..., 0]
    same = (x == places[..., 1]) & (x == places[..., 2])
    zero = same & (x == 0.0)
    if zero.any():
        places[zero] = np.nan
        remarks.append(
            remark(
                "missing",
                f"{zero.sum()} samples at (0, 0, 0) count as missing",
                samples=int(zero.sum()),
            )
        )
    least, value = min(_LEAST_STANDIN, BEYOND_SIGHT_M / metres), x[same]
    same[same] = (np.abs(value) >= least) | np.isin(value, _NEGATIVE_STANDINS)
    if not same.any():
        return
    numbers, counts = np.unique(x[same], return_counts=True)
    which = np.array([_stands_for_none(v, metres) for v in numbers.tolist()])
    if not which.any():
        return
    same[same] = np.isin(x[same], numbers[which])
    places[same] = np.nan
    shown = ", ".join(f"{v:.10g}" for v in numbers[which][:_SHOWN_NUMBERS])
    more = " and the like" if which.sum() > _SHOWN_NUMBERS else ""
    remarks.append(
        remark(
            "missing",
            f"{counts[which].sum()} samples with {shown}{more} on all three axes count "
            "as missing",
            samples=int(counts[which].sum()),
        )
    )


def _stands_for_none(number: float, metres: float) -> bool:
    """Whether a number on all three axes is one that programs write for nothing."""
    size = abs(number)
    digits = f"{size:.10g}"
    return (
        size * metres >= BEYOND_SIGHT_M
        or re.fullmatch(r"9{3,}(\.9+)?", digits) is not None
        or size in _WHOLE_NUMBER_LIMITS
        or (size >= 1e4 and re.fullmatch(r"10+", digits) is not None)
        or number in _NEGATIVE_STANDINS
    )
