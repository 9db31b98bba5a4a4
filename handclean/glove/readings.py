"""What glove readings should be, and what may be wrong with them.

Readings of a glove are (T, S) in the order of its sensors; a sensor that a file lacks
and nothing needs is NaN.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import FileError, Where
from handclean.glove.gloves import Glove
from handclean.glove.smooth import smoothed
from handclean.remarks import Remark, first_of, remark

_LEAST_FRAMES = 30
"""Frames in which a sensor that works changes at least once (chosen)."""


def columns(where: Where, glove: Glove, sensors: Sequence[str], count: int) -> Ints:
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
                where,
                f"has {count} columns of readings",
                f"{glove.name} has {len(glove.sensors)} sensors",
            )
        return np.arange(count)
    missing = [sensor for sensor in glove.used if sensor not in sensors]
    if missing:
        few = first_of(missing)
        raise FileError(
            where,
            f"has no sensor {few}" if len(missing) < 5 else f"lacks sensors {few}",
            f"{glove.name} needs {len(glove.used)}; the file has "
            + first_of(list(sensors)),
        )
    place = {name: k for k, name in enumerate(sensors)}
    return np.array([place.get(name, -1) for name in glove.sensors], dtype=np.int64)


def arranged(values: Floats, places: Ints) -> Floats:
    """Put a file's columns into the order of a glove's sensors.

    Parameters
    ----------
    values : (T, C) the file's columns.
    places : (S,) the column of each sensor, -1 for none.

    Returns
    -------
    (T, S) NaN where a sensor is not in the file
    """
    out = np.full((len(values), len(places)), np.nan)
    there = places >= 0
    out[:, there] = values[:, places[there]]
    return out


def saturated(glove: Glove, readings: Floats) -> Bools:
    """Find readings at an end of the converter.

    Parameters
    ----------
    readings : (T, S) in the order of the glove's sensors.

    Returns
    -------
    (T, S); no reading is, if the glove does not say the ends
    """
    if glove.limits is None:
        return np.zeros(readings.shape, dtype=bool)
    low, high = glove.limits
    return np.asarray((readings <= low) | (readings >= high))


def usable(glove: Glove, readings: Floats) -> Bools:
    """Find the frames whose sensors all read something, none of them saturated.

    Parameters
    ----------
    readings : (T, S) in the order of the glove's sensors.

    Returns
    -------
    (T,)
    """
    own = [glove.sensors.index(sensor) for sensor in glove.used]
    good = np.isfinite(readings[:, own]) & ~saturated(glove, readings[:, own])
    return np.asarray(good.all(axis=1))


def smooth(glove: Glove, times: Floats, readings: Floats, cutoff_hz: float) -> Floats:
    """Smooth readings; saturated ones stay as they are and tell nothing of others.

    Parameters
    ----------
    times : (T,) [s]
    readings : (T, S) in the order of the glove's sensors.
    cutoff_hz : [Hz] what is faster goes; 0 for readings as they are.

    Returns
    -------
    (T, S)
    """
    return smoothed(times, readings, cutoff_hz, partial(saturated, glove))


class Watch:
    """What is counted of readings while they go by, a chunk at a time.

    Attributes
    ----------
    frames : that were seen.
    blank, stuck : how many of them lack a reading that is needed, or have a saturated
        one.
    """

    def __init__(self, glove: Glove) -> None:
        self._glove = glove
        self._own = [glove.sensors.index(sensor) for sensor in glove.used]
        self.frames = self.blank = self.stuck = 0
        count = len(self._own)
        self._blank, self._stuck = (np.zeros(count, dtype=np.int64) for _ in range(2))
        self._low, self._high = np.full(count, np.inf), np.full(count, -np.inf)

    def see(self, readings: Floats) -> None:
        """Count (t, S) readings."""
        used = readings[:, self._own]
        blank = ~np.isfinite(used)
        stuck = saturated(self._glove, used)
        self.frames += len(used)
        self.blank += int(blank.any(axis=1).sum())
        self.stuck += int(stuck.any(axis=1).sum())
        self._blank += blank.sum(axis=0)
        self._stuck += stuck.sum(axis=0)
        self._low = np.fmin(self._low, np.fmin.reduce(used, axis=0, initial=np.inf))
        self._high = np.fmax(self._high, np.fmax.reduce(used, axis=0, initial=-np.inf))

    def remarks(self, moving: bool = True) -> tuple[Remark, ...]:
        """Remark on what is odd about the readings.

        Parameters
        ----------
        moving : whether the hand moved, so that sensors should have.
        """
        remarks: list[Remark] = []
        empty = self._blank == self.frames
        if empty.any():
            remarks.append(
                remark("sensor", f"{_names(self._glove, empty)} reads nothing at all")
            )
        elif self.blank:
            names = _names(self._glove, self._blank > 0)
            remarks.append(
                remark(
                    "missing",
                    f"{self.blank} frames have no reading of {names}",
                    count=self.blank,
                )
            )
        if self.stuck:
            share = 100.0 * self.stuck / self.frames
            names = _names(self._glove, self._stuck > 0)
            remarks.append(
                remark(
                    "sensor",
                    f"{names} saturated in {share:.3g} % of frames",
                    percent=share,
                )
            )
        still = (self._low == self._high) & ~empty
        if moving and self.frames >= _LEAST_FRAMES and still.any():
            names = _names(self._glove, still)
            remarks.append(remark("sensor", f"{names} never changed: is it connected?"))
        return tuple(remarks)


def remarks(glove: Glove, readings: Floats, moving: bool = True) -> tuple[Remark, ...]:
    """Remark on what is odd about readings, see `Watch.remarks`.

    Parameters
    ----------
    readings : (T, S) in the order of the glove's sensors.
    moving : whether the hand moves in them.
    """
    watch = Watch(glove)
    watch.see(readings)
    return watch.remarks(moving)


def _names(glove: Glove, which: Bools) -> str:
    names = [name for name, yes in zip(glove.used, which, strict=True) if yes]
    return first_of(names, 5)


def rescaled(glove: Glove, readings: Floats) -> Floats:
    """Rescale readings linearly to the active range: what the paper calls raw.

    The reading at one end of a rotation's range is taken for the angle of that end.

    Parameters
    ----------
    readings : (T, S) in the order of the glove's sensors.

    Returns
    -------
    (T, R') [rad] in the order of ``glove.measured``

    Raises
    ------
    FileError
        If the glove does not say which readings those are.

    References
    ----------
    Wang & Neff (2013).
    """
    out = np.zeros((len(readings), len(glove.measured)))
    sensors = dict.fromkeys(row.measured_by for row in glove.measured)
    missing = [sensor for sensor in sensors if sensor not in glove.reading]
    if missing:
        raise FileError(
            f"glove {glove.name}",
            f"does not say what {', '.join(missing)} read at the ends of the range",
            "'calibrate-glove examine' finds out",
        )
    for k, row in enumerate(glove.measured):
        low, high = glove.hand.ranges[glove.hand.index(row.rotation)]
        first, last = glove.reading[row.measured_by]
        values = readings[:, glove.sensors.index(row.measured_by)]
        out[:, k] = low + (high - low) * (values - first) / (last - first)
    return out
