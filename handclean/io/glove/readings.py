"""Glove readings: CSV and HDF5, of any length, read a piece at a time.

A CSV of ours begins with ``# handclean readings`` and a JSON object of facts
(``glove``, ``subject``, ``moved``), then a header: ``time_s`` and the sensors. Other
people's files have a header of sensor names, with or without a column of times, or no
header: then columns are the glove's sensors in their order, perhaps after a time [s].
HDF5 files have ``readings`` (T, S) and, if known, ``time`` (T,) [s], ``sensors``, and
the facts as attributes; other people's need not say that they are readings. Blank cells
and nan are missing.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from handclean.errors import FileError, UsageError
from handclean.io.glove.csv_readings import open_csv
from handclean.io.glove.h5_readings import open_h5
from handclean.io.glove.readings_file import ReadingsFile
from handclean.io.shared.clock import SLOWEST_HZ

_RATE_AGREEMENT_SHARE = 1e-3
"""[-] share by which a rate may differ from the times' (as `--rate`)."""

_RATE_FRAMES = 2000
"""Frames whose times tell a rate (chosen)."""

_ROUNDED_S = 1e-3
"""[s] to which times may be rounded (chosen)."""


def open_readings(
    path: Path, *, rate_hz: float | None = None, sensors: int = 0
) -> ReadingsFile:
    """Look at the head of a file of readings.

    Parameters
    ----------
    rate_hz : [Hz] for files without times.
    sensors : of the glove; tells a column of times in files without a header.

    Raises
    ------
    FileError
        If there is no such file or it is not one of readings.
    UsageError
        If the rate is needed and not given, or contradicts the file.
    """
    found = head_of(path, sensors)
    if found.has_times:
        if rate_hz:
            _expect_rate(found, rate_hz)
        elif not found.says_time_unit:
            _expect_possible(found)
        return found
    said = rate_said(found.facts)
    if rate_hz and said and abs(rate_hz / said - 1.0) > _RATE_AGREEMENT_SHARE:
        raise UsageError(
            f"--rate {rate_hz:g} Hz, but the file says {said:g} Hz", where=path
        )
    if not (rate_hz or said):
        raise UsageError("has no times; give --rate", where=path)
    return replace(found, rate=float(rate_hz or said or 1.0))


def rate_said(facts: Mapping[str, Any]) -> float | None:
    """[Hz] the rate that a file says of itself, if it says one."""
    said = facts.get("rate_hz")
    if not isinstance(said, int | float) or not 0.0 < said < math.inf:
        return None
    return float(said)


def facts_of(path: Path) -> Mapping[str, Any]:
    """Return what a file of readings says of itself; its rate need not be known.

    Raises
    ------
    FileError
        If there is no such file or it is not one of readings.
    """
    return head_of(path, 0).facts


def head_of(path: Path, sensors: int) -> ReadingsFile:
    """Look at the head of a file whose rate need not be known.

    Parameters
    ----------
    sensors : of the glove; tells a column of times in files without a header.

    Raises
    ------
    FileError
        If there is no such file or it is not one of readings.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".h5"):
        right = "readings are .csv or .h5"
        raise FileError(path, f"no format is called '{path.suffix}'", right)
    if not path.exists():
        raise FileError(path, "no such file")
    return open_h5(path) if suffix == ".h5" else open_csv(path, sensors)


def _expect_rate(found: ReadingsFile, rate_hz: float) -> None:
    """Expect times to run at a rate, in the mean or (with frames lost) the median."""
    times, _ = next(found.chunks(_RATE_FRAMES))
    if len(times) < 2:
        return
    span = float(times[-1] - times[0])
    steps = np.array([span / (len(times) - 1), np.median(np.diff(times))])
    with np.errstate(over="ignore"):
        off = np.abs(steps * rate_hz - 1.0)
    if np.all(off > _RATE_AGREEMENT_SHARE + _ROUNDED_S / span):
        rate = 1.0 / steps[1] if abs(steps[1] - steps[0]) > 0.1 * steps[0] else 0.0
        raise UsageError(
            f"--rate {rate_hz:g} Hz, but its times run at "
            f"{rate or 1.0 / steps[0]:.4g} Hz",
            where=found.path,
        )


def _expect_possible(found: ReadingsFile) -> None:
    """Expect times without a unit to be seconds: not to run slower than gloves do."""
    times, _ = next(found.chunks(_RATE_FRAMES))
    if len(times) > 1 and (step := float(np.median(np.diff(times)))) > 1 / SLOWEST_HZ:
        wrong = f"by its times it runs at {1 / step:.3g} Hz, which is no rate"
        right = "call them time_ms if they are milliseconds; --rate says it is right"
        raise FileError(found.path, wrong, right)
