"""What is in a file of a glove's readings, and whether one is such a file."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from handclean.errors import HandcleanError
from handclean.io.glove.readings import head_of, open_readings, rate_said
from handclean.io.glove.readings_file import FORMAT, MARK
from handclean.io.hdf5 import file as h5
from handclean.io.shared.reading import reported
from handclean.remarks import Remark, remark

_AXIS = re.compile(r"[-_ .:][XYZxyz]$")
_LEAST_COLUMNS = 3
"""Columns that a glove has at least (chosen)."""


def is_readings(path: Path) -> bool:
    """Whether a file says that it holds readings, or (HDF5) nothing else can be meant.

    A CSV says so in its first line.

    Raises
    ------
    FileError
        If the file ends in ``.h5`` and is no HDF5, or damaged.
    """
    if path.suffix.lower() == ".h5":
        attrs, names = h5.head_of(path)
        said = attrs.get("format")
        return said == FORMAT or (said is None and "readings" in names)
    try:
        with path.open("rb") as file:
            head = file.read(len(MARK) + 3)
    except OSError:
        return False
    return head.lstrip(b"\xef\xbb\xbf").startswith(MARK.encode())


def may_be_readings(path: Path) -> bool:
    """Whether a CSV that does not say so may hold readings: numbers, no markers."""
    try:
        found = head_of(path, 0)
        next(replace(found, rate=1.0).chunks(1))
    except (HandcleanError, OSError):
        return False
    axes = any(_AXIS.search(name) for name in found.sensors)
    return found.columns >= _LEAST_COLUMNS and not axes


def inspect_readings(path: Path, rate_hz: float | None) -> dict[str, Any]:
    """Return what is in a file of readings, as plain JSON values.

    Raises
    ------
    FileError, UsageError
        If it cannot be read, or the rate contradicts it.
    """
    remarks: list[Remark] = []
    begun = head_of(path, 0)
    unknown = not (rate_hz or begun.has_times or rate_said(begun.facts))
    if unknown:
        remarks.append(remark("time", "has no times; give --rate"))
    found = open_readings(path, rate_hz=1.0 if unknown else rate_hz)
    frames, blank, first, last = 0, 0, math.nan, math.nan
    low, high = np.full(found.columns, np.inf), np.full(found.columns, -np.inf)
    for times, values in found.chunks(50_000):
        first = float(times[0]) if frames == 0 else first
        last = float(times[-1])
        frames += len(times)
        blank += int(np.isnan(values).sum())
        low, high = np.fmin(low, values.min(axis=0)), np.fmax(high, values.max(axis=0))
    rate = (frames - 1) / (last - first) if frames > 1 and not unknown else None
    still = [s for s, a, b in zip(found.sensors, low, high, strict=False) if a == b]
    remarks += [
        remark("sensor", f"{name} never changes", sensor=name) for name in still
    ]
    if blank:
        remarks.append(
            remark("missing", f"{blank} readings are missing", readings=blank)
        )
    return {
        "format": "glove readings",
        "frames": frames,
        "rate": rate,
        "duration_s": frames / rate if rate else None,
        "sensors": list(found.sensors),
        "facts": dict(found.facts),
        **reported(remarks),
    }
