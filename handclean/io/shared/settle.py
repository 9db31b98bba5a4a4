"""Which unit and which rate a file's numbers have, by itself and by the options."""

import math
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UnsaidError, UsageError
from handclean.remarks import Remark, remark

METRES = {
    "m": 1.0,
    "meter": 1.0,
    "meters": 1.0,
    "metre": 1.0,
    "metres": 1.0,
    "dm": 0.1,
    "decimeter": 0.1,
    "decimeters": 0.1,
    "decimetre": 0.1,
    "decimetres": 0.1,
    "cm": 1e-2,
    "centimeter": 1e-2,
    "centimetre": 1e-2,
    "centimeters": 1e-2,
    "centimetres": 1e-2,
    "mm": 1e-3,
    "millimeter": 1e-3,
    "millimeters": 1e-3,
    "millimetre": 1e-3,
    "millimetres": 1e-3,
    "um": 1e-6,
    "micrometer": 1e-6,
    "micrometers": 1e-6,
    "micrometre": 1e-6,
    "micrometres": 1e-6,
}
"""Metres per unit of length, by the names that files use."""

_SHORT = {METRES[name]: name for name in ("m", "dm", "cm", "mm", "um")}

_LEAST_CUT_LETTERS = 3
"""Letters that a name which was cut off must have (chosen)."""

AGREEMENT_SHARE = 1e-3
"""[-] options and files agree when they differ by no more than this share: `--rate`
contradicts a file by more than 0.1 %."""


def positive(path: Path, name: str, value: str) -> float:
    """Return a rate or the like that a file states.

    Raises
    ------
    FileError
        If it is not a number above zero.
    """
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not 1e-9 < number < 1e9:
        right = "it should be a number above 0"
        raise FileError(path, f"{name} is '{value[:20]}'", right)
    return number


def settle_rate(path: Path, stated: float | None, option: float | None) -> float:
    """[Hz] the rate of a file, from itself or else from ``--rate``.

    Raises
    ------
    UsageError
        If neither says, or they differ by more than 0.1 %.
    """
    if option is not None and not (math.isfinite(option) and option > 0):
        raise UsageError(f"--rate should be a number of Hz above 0, not {option}")
    if stated is None:
        if option is None:
            wrong = "does not say its rate; give --rate HZ"
            raise UnsaidError(path, wrong, "--rate")
        return float(option)
    if option is not None and abs(option - stated) > AGREEMENT_SHARE * stated:
        raise UsageError(f"--rate {option:g} contradicts its {stated:g} Hz", where=path)
    return float(stated)


def ask_for(path: Path, *, rate: bool, unit: bool) -> None:
    """Ask for the rate, the unit, or both at once, where a file does not say.

    Raises
    ------
    UnsaidError
        If one of them is wanted.
    """
    what = " nor ".join(w for w, it in (("rate", rate), ("unit", unit)) if it)
    wanted = (("--rate", " HZ", rate), ("--unit", " mm|cm|m", unit))
    options = [option for option, _, it in wanted if it]
    if give := " and ".join(f"give {o}{value}" for o, value, it in wanted if it):
        raise UnsaidError(path, f"does not say its {what}; {give}", *options)


def named_unit(name: str) -> str | None:
    """Return the unit that a name stands for, None where it stands for none.

    A name that was cut off, as fields of fixed width cut it (``mete``, ``mill``), is
    read as what it begins, if that is one unit.
    """
    name = name.strip()
    if name.lower() in METRES:
        return name
    begun = {
        metres
        for whole, metres in METRES.items()
        if len(name) >= _LEAST_CUT_LETTERS and whole.startswith(name.lower())
    }
    return _SHORT[begun.pop()] if len(begun) == 1 else None


def settle_unit(
    path: Path, stated: str | None, option: str | None, remarks: list[Remark]
) -> str:
    """Return the unit of length of a file, from ``--unit`` or else from itself.

    Parameters
    ----------
    remarks : where the option contradicts the file, that is appended.

    Raises
    ------
    UsageError
        If neither says.
    FileError
        If the file's unit is not known, and there is no option.
    """
    if option is not None and option.lower() not in METRES:
        raise UsageError(f"--unit should be mm, cm or m, not '{option}'")
    if stated is None:
        if option is None:
            wrong = "does not say its unit; give --unit mm|cm|m"
            raise UnsaidError(path, wrong, "--unit")
        return option
    known = named_unit(stated)
    if known is None and option is None:
        right = "it should be one of mm, cm, dm, m (--unit says which)"
        raise FileError(path, f"the unit of length is '{stated}'", right)
    if known is None or (
        option is not None and METRES[option.lower()] != METRES[known.lower()]
    ):
        assert option is not None
        remarks.append(overruled(option, stated))
        return option
    return known


def overruled(option: str, stated: str) -> Remark:
    """Say that ``--unit`` is taken and not what a file says."""
    text = f"--unit {option} is taken, though the file says {stated[:40]}"
    return remark("unit", text, taken=option, overruled=stated[:40])


def in_metres(values: Floats, unit: str, out: Floats | None = None) -> Floats:
    """Convert lengths; dividing by a whole number keeps decimal digits exact.

    Parameters
    ----------
    out : where to, which may be the values themselves; default: a new array.
    """
    scale = METRES[unit.lower()]
    if scale < 1:
        return np.divide(values, round(1 / scale), out=out)
    return np.multiply(values, scale, out=out)
