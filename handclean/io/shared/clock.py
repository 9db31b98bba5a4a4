"""Columns of times: the rate they run at, the time of the first row, their unit."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError
from handclean.io.shared.settle import AGREEMENT_SHARE
from handclean.remarks import Remark, remark

SECONDS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds", "millis"), 1e-3),
    **dict.fromkeys(("us", "usec", "µs", "μs", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), 1e-9),
}
"""Seconds per unit of time, by the names that columns give it."""

SLOWEST_HZ, FASTEST_HZ = 2.0, 20_000.0
"""[Hz] cameras are no slower and no faster (chosen)."""

_WHOLE_RATE_SHARE = 1e-4
"""A rate found from times counts as whole when within this share of a whole number
(chosen)."""

_TIME = re.compile(
    r"(?:time|times|time[ _]?stamps?|t|elapsed[ _]?time|frame[ _]?time)"
    r"(?:[\s_]*[\[(](?P<in>[^\])]*)[\])]|[\s_]+(?P<of>\w+)|(?P<as>sec|seconds|ms))?"
)


class Column(NamedTuple):
    """What the name of a column of times says.

    Attributes
    ----------
    seconds : per unit; 1 where it does not say.
    says : whether it names its unit.
    """

    seconds: float
    says: bool


SECONDS_SAID = Column(1.0, True)
"""Times in seconds, beyond doubt."""


def time_column(name: str) -> Column | None:
    """Return what a column's name says of its times; None if it holds none."""
    found = _TIME.fullmatch(name.strip().lower()[:40])
    if not found:
        return None
    unit = next((part for part in found.groups() if part is not None), None)
    if unit is None:
        return Column(1.0, False)
    seconds = SECONDS.get(unit.strip())
    return None if seconds is None else Column(seconds, True)


def clock_of(path: Path, name: str, below: str) -> Column | None:
    """Return what a column's name, and the unit below it, say of its times.

    Parameters
    ----------
    below : the unit in a line of them, "" where there is none.

    Raises
    ------
    FileError
        If the two contradict each other.
    """
    said = time_column(name)
    if said is None or not below:
        return said
    seconds = SECONDS.get(below.lower())
    if seconds is not None and said.says and seconds != said.seconds:
        wrong = f"the unit below its column '{name[:40]}' is '{below[:40]}'"
        raise FileError(path, wrong, "the two should agree")
    return None if seconds is None else Column(seconds, True)


def rate_of(
    numbers: Floats, times: Floats, option: float | None, remarks: list[Remark]
) -> float | None:
    """[Hz] the rate that frame numbers and times [s] agree on, if they do."""
    with np.errstate(all="ignore"):
        rate = float((numbers[-1] - numbers[0]) / (times[-1] - times[0]))
        late = np.abs(times - times[0] - (numbers - numbers[0]) / rate)
    if not (0 < rate < 1e12 and np.all(late < 0.5 / rate)):
        remarks.append(remark("time", "its times run irregularly and say no rate"))
        return None
    if option is not None and abs(rate - option) <= AGREEMENT_SHARE * rate:
        return option
    whole = round(rate)
    if abs(rate - whole) <= _WHOLE_RATE_SHARE * rate:
        return whole
    return _round_rate(numbers - numbers[0], times - times[0], rate)


def _round_rate(numbers: Floats, times: Floats, rate: float) -> float:
    """[Hz] a rounder rate that times which are rounded themselves may run at."""
    grid = next((10.0**-d for d in range(1, 7) if _on(times, 10.0**-d)), 0.0)
    later = numbers > 0
    if not later.any():
        return rate
    with np.errstate(over="ignore", divide="ignore"):
        least = np.max((times[later] - grid) / numbers[later])
        most = np.min((times[later] + grid) / numbers[later])
    for step in (10.0, 5.0, 1.0):
        round_one = step * round(rate / step)
        if round_one > 0 and least <= 1.0 / round_one <= most:
            return round_one
    return rate


def _on(times: Floats, grid: float) -> bool:
    """Whether all times are whole multiples of a step."""
    with np.errstate(over="ignore", invalid="ignore"):
        steps = times / grid
        return bool(np.all(np.abs(steps - np.round(steps)) < 1e-3))


def in_seconds(
    path: Path,
    numbers: Floats,
    times: Floats,
    column: Column,
    option: float | None,
    remarks: list[Remark],
) -> Floats:
    """(N,) [s] times of a column whose name may not say its unit.

    Where it does not, times that as seconds would run slower than any camera are
    milliseconds, and so on; unless ``--rate`` says that they are seconds.

    Parameters
    ----------
    numbers, times : (N,) frame numbers, and times as the file has them.
    option : [Hz] ``--rate``.

    Raises
    ------
    FileError
        If they may be seconds, milliseconds or frame numbers.
    """
    if column.says or len(times) < 2:
        return times * column.seconds
    with np.errstate(all="ignore"):
        rate = float((numbers[-1] - numbers[0]) / (times[-1] - times[0]))
    if not 0 < rate < SLOWEST_HZ or (
        option and abs(rate - option) <= AGREEMENT_SHARE * rate
    ):
        return times
    if option is None and np.all(np.diff(times) == 1.0):
        wrong = "its times rise by 1 a row: seconds, milliseconds or frames?"
        raise FileError(path, wrong, "call them time_s, time_ms or frame")
    for name, seconds in (("milli", 1e-3), ("micro", 1e-6), ("nano", 1e-9)):
        if SLOWEST_HZ <= rate / seconds <= FASTEST_HZ:
            remarks.append(
                remark(
                    "time",
                    f"its times are read as {name}seconds: as seconds they would run "
                    f"at {rate:.3g} Hz",
                    seconds=seconds,
                )
            )
            return times * seconds
    return times


def expect_possible(
    path: Path, rate: float | None, option: float | None, column: str
) -> None:
    """Expect a rate found from times to be one that cameras have.

    Raises
    ------
    FileError
        If it is not, and ``--rate`` does not say the same.
    """
    if rate is None or SLOWEST_HZ <= rate <= FASTEST_HZ:
        return
    if option is not None and abs(rate - option) <= AGREEMENT_SHARE * rate:
        return
    wrong = f"by its column '{column[:40]}' it runs at {rate:.3g} Hz, which is no rate"
    right = "is that its unit? time_ms are milliseconds; --rate HZ says it is right"
    raise FileError(path, wrong, right)


def start_of(
    times: Floats, numbers: Floats, rate: float, said: str, remarks: list[Remark]
) -> float:
    """[s] the time of the first row, as the file gives it; 0 if its times are wrong.

    Parameters
    ----------
    times, numbers : (N,) [s] and frame numbers.
    rate : [Hz] of the file.
    said : what says the rate, for the remark: "DataRate, 120 Hz".
    """
    with np.errstate(over="ignore", invalid="ignore"):
        expected = (numbers - numbers[0]) / rate
        late = np.abs(times - times[0] - expected)
    if not np.all(late <= 0.5 / rate):
        remarks.append(
            remark("time", f"the Time column does not run at {said}; it is not kept")
        )
        return 0.0
    return float(times[0])
