"""Which sensors are cross-coupled (Wang & Neff 2013, section 3.1 and table 1).

In each recording some joints move as far as they go while all others are held still. A
sensor whose own joint is still should not change; if its readings' standard deviation
is 5 % of its active range or more, or one deviates 12 % or more, what moved affects it.

Active range: from the 1st to the 99th percentile of the recording in which the sensor's
joint moves alone. Noise is no coupling: its variance, a half of that of differences of
successive readings, is taken off, and the largest deviation is that of readings
smoothed by a median of nine, less three times what noise leaves of itself there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from handclean.arrays import Floats
from handclean.errors import HandcleanError, UnknownNameError, Where
from handclean.glove.gloves import Glove

_MEDIAN_NOISE_SD = 0.418
"""[-] standard deviation that a median of nine leaves of normal noise of one (a
property of the normal distribution)."""

_LEAST_READINGS = 30
"""Readings of a sensor in a recording, at least (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Moved:
    """A recording in which the joints of some sensors moved.

    Attributes
    ----------
    where : its file, for messages.
    sensors : whose joints moved.
    readings : (T, S) in the glove's order.
    """

    where: Where
    sensors: tuple[str, ...]
    readings: Floats


@dataclass(frozen=True, kw_only=True)
class Effect:
    """What moving some joints does to a sensor whose own joint is still.

    Attributes
    ----------
    sensor : that measures; by : whose joints moved.
    sd, most : standard deviation and largest deviation, shares of the active range.
    coupled : whether that is coupling.
    """

    sensor: str
    by: tuple[str, ...]
    sd: float
    most: float
    coupled: bool


@dataclass(frozen=True, kw_only=True)
class Examination:
    """What a free-movement session says of a glove.

    Attributes
    ----------
    effects : of every recording on every sensor that was still.
    affected : measuring sensor to those that affect it, the strongest first.
    reading : sensor to its readings at the ends of its active range.
    unknown : sensors that never moved alone, so that nothing can be said of them.
    """

    effects: tuple[Effect, ...]
    affected: Mapping[str, tuple[str, ...]]
    reading: Mapping[str, tuple[float, float]]
    unknown: tuple[str, ...]


def examine(
    glove: Glove, recordings: Sequence[Moved], sd: float = 0.05, most: float = 0.12
) -> Examination:
    """Find out which sensors are affected by which joints.

    Parameters
    ----------
    sd, most : shares of the active range from which a sensor is coupled.

    Raises
    ------
    HandcleanError
        If no recording shows a joint moving alone, or a sensor did not answer.
    UnknownNameError
        If a recording names a sensor the glove does not have.
    """
    for recording in recordings:
        for name in recording.sensors:
            if name not in glove.sensors:
                raise UnknownNameError(recording.where, "sensor", name, glove.sensors)
    ranges = {
        recording.sensors[0]: _range(glove, recording)
        for recording in recordings
        if len(recording.sensors) == 1
    }
    if not ranges:
        raise HandcleanError(
            "recordings: in none does one joint move alone, so that no sensor's active "
            "range is known; record each joint moving alone"
        )
    effects = [
        _effect(glove, recording, name, ends, sd, most)
        for recording in recordings
        for name, ends in ranges.items()
        if name not in recording.sensors
    ]
    affected = {}
    for name in ranges:
        single = [
            e for e in effects if e.sensor == name and len(e.by) == 1 and e.coupled
        ]
        single.sort(key=lambda e: -e.sd)
        affected[name] = tuple(effect.by[0] for effect in single)
    unknown = tuple(name for name in glove.used if name not in ranges)
    return Examination(
        effects=tuple(effects), affected=affected, reading=ranges, unknown=unknown
    )


def _range(glove: Glove, recording: Moved) -> tuple[float, float]:
    """Readings at the low and the high end of a sensor that moved alone."""
    values = _column(glove, recording, recording.sensors[0])
    low, high = np.percentile(values, [1.0, 99.0])
    if not high > low:
        raise HandcleanError(
            f"{recording.sensors[0]} never changed although "
            "its joint moved; is it connected?",
            where=recording.where,
        )
    return float(low), float(high)


def _column(glove: Glove, recording: Moved, sensor: str) -> Floats:
    values = recording.readings[:, glove.sensors.index(sensor)]
    values = values[np.isfinite(values)]
    if len(values) < _LEAST_READINGS:
        raise HandcleanError(
            f"has {len(values)} readings of {sensor}; {_LEAST_READINGS} are needed",
            where=recording.where,
        )
    return values


def _effect(
    glove: Glove,
    recording: Moved,
    sensor: str,
    ends: tuple[float, float],
    sd: float,
    most: float,
) -> Effect:
    values = _column(glove, recording, sensor)
    size = ends[1] - ends[0]
    noise = 0.5 * float(np.mean(np.diff(values) ** 2))
    spread = np.sqrt(max(float(values.var()) - noise, 0.0)) / size
    smooth = median_filter(values, 9, mode="nearest")
    calm = 3.0 * _MEDIAN_NOISE_SD * np.sqrt(noise) / size
    farthest = float(np.abs(smooth - values.mean()).max()) / size
    return Effect(
        sensor=sensor,
        by=recording.sensors,
        sd=float(spread),
        most=farthest,
        coupled=bool(spread >= sd or farthest - calm >= most),
    )
