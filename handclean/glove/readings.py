"""What glove readings should be, and what may be wrong with them.

Readings of a glove are (T, S) in the order of its sensors; a sensor that a file lacks
and nothing needs is NaN.
"""

from collections.abc import Sequence

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import FileError
from handclean.glove.gloves import Glove

_STILL = 30
"""Frames in which a sensor that works changes at least once."""


def columns(where: object, glove: Glove, sensors: Sequence[str], count: int) -> Ints:
    """(S,) column of each of the glove's sensors in a file, -1 for those not needed.

    Parameters
    ----------
    sensors : names of the file's columns; empty when it has no header.
    count : columns of readings.

    Raises
    ------
    FileError
        If a sensor that tells a rotation is missing, or there are not as many columns
        as sensors in a file without names.
    """
    if not sensors:
        if count != len(glove.sensors):
            raise FileError(
                str(where),
                f"has {count} columns of readings",
                f"{glove.name} has {len(glove.sensors)} sensors",
            )
        return np.arange(count)
    missing = [sensor for sensor in glove.used if sensor not in sensors]
    if missing:
        few = ", ".join(missing[:4]) + (", ..." if len(missing) > 4 else "")
        raise FileError(
            str(where),
            f"has no sensor {few}" if len(missing) < 5 else f"lacks sensors {few}",
            f"{glove.name} needs {len(glove.used)}; the file has "
            + ", ".join(list(sensors)[:4])
            + (", ..." if len(sensors) > 4 else ""),
        )
    place = {name: k for k, name in enumerate(sensors)}
    return np.array([place.get(name, -1) for name in glove.sensors], dtype=np.int64)


def arranged(values: Floats, places: Ints) -> Floats:
    """(T, S) readings in the glove's order; NaN where a sensor is not in the file."""
    out = np.full((len(values), len(places)), np.nan)
    there = places >= 0
    out[:, there] = values[:, places[there]]
    return out


def saturated(glove: Glove, readings: Floats) -> Bools:
    """(T, S) whether a reading is at an end of the converter."""
    if glove.limits is None:
        return np.zeros(readings.shape, dtype=bool)
    low, high = glove.limits
    return np.asarray((readings <= low) | (readings >= high))


def usable(glove: Glove, readings: Floats) -> Bools:
    """(T,) frames whose sensors all read something, none of them saturated."""
    own = [glove.sensors.index(sensor) for sensor in glove.used]
    good = np.isfinite(readings[:, own]) & ~saturated(glove, readings[:, own])
    return np.asarray(good.all(axis=1))


def remarks(glove: Glove, readings: Floats, moving: bool = True) -> tuple[str, ...]:
    """Say what is odd about readings, one line each.

    Parameters
    ----------
    moving : whether the hand moved, so that sensors should have.
    """
    told = []
    own = [glove.sensors.index(sensor) for sensor in glove.used]
    used = readings[:, own]
    blank = ~np.isfinite(used)
    if blank.any():
        names = _names(glove, np.asarray(blank.any(axis=0)))
        told.append(f"{blank.any(axis=1).sum()} frames have no reading of {names}")
    stuck = saturated(glove, used)
    if stuck.any():
        share = 100.0 * stuck.any(axis=1).mean()
        names = _names(glove, np.asarray(stuck.any(axis=0)))
        told.append(f"{names} saturated in {share:.3g} % of frames")
    if moving and len(used) >= _STILL:
        still = np.nanmax(used, axis=0, initial=-np.inf) <= np.nanmin(
            used, axis=0, initial=np.inf
        )
        still &= ~blank.all(axis=0)
        if still.any():
            told.append(f"{_names(glove, still)} never changed: is it connected?")
    return tuple(told)


def _names(glove: Glove, which: Bools) -> str:
    names = [name for name, yes in zip(glove.used, which, strict=True) if yes]
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def rescaled(glove: Glove, readings: Floats) -> Floats:
    """(T, R') [rad] measured rotations by linear rescaling to the active range.

    What the paper calls raw: the reading at one end of the range is one end's angle.

    Raises
    ------
    FileError
        If the glove does not say which readings those are.
    """
    out = np.zeros((len(readings), len(glove.measured)))
    missing = [
        row.measured_by
        for row in glove.measured
        if row.measured_by not in glove.reading
    ]
    if missing:
        raise FileError(
            f"glove {glove.name}",
            f"does not say what {', '.join(missing[:3])} read at the ends of the range",
            "'calibrate-glove examine' finds out",
        )
    for k, row in enumerate(glove.measured):
        low, high = glove.hand.ranges[glove.hand.index(row.rotation)]
        first, last = glove.reading[row.measured_by]
        values = readings[:, glove.sensors.index(row.measured_by)]
        out[:, k] = low + (high - low) * (values - first) / (last - first)
    return out
