"""One simulated glove: what it reads as it was made, and as it sits on a hand.

A sensor answers to its own rotation through a curve of its own, with a kink and
saturation, f(u) = (1 - w) tanh-part + w max(u - k, 0) of u, the share of the active
range; other rotations stretch it (cross-coupling), through kinked curves g and a
product where two meet. None of these is in the class of linear and squared-exponential
kernels. On top come the converter's steps, noise (Kessler et al. 1995: 1.1 degrees in
the mean, 3 at most), the hand's size, and at every donning a little offset and gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.simulation.glove_sensors import Sensor, sensors_of

NOISE_SD_RAD, MOST_NOISE_RAD = np.radians(1.42), np.radians(3.0)
"""[rad] normal, cut off: 1.1 degrees in the mean, 3 at most (Kessler et al. 1995)."""

LARGEST_READING = 255.0
"""Readings are whole numbers from 0 to this: a converter of 8 bits."""

_MOST_SIDE_STRETCH_SHARE = 0.06
"""[-] share of the range by which a neighbour of no account stretches a sensor, at most
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Hardware:
    """One glove as it was made, and as it sits on a hand.

    Attributes
    ----------
    sensors : S sensors.
    steep, middle, kink, weight : (S,) shape of each sensor's curve.
    zero, span : (S,) reading at the low end of the range, and over it.
    slight : (S, S) shares of the range by which others stretch each a little.
    cut : kink of the coupling's curves.
    """

    sensors: tuple[Sensor, ...]
    steep: Floats
    middle: Floats
    kink: Floats
    weight: Floats
    zero: Floats
    span: Floats
    slight: Floats
    cut: float

    def readings(
        self, hinges: Sequence[str], angles: Floats, rng: np.random.Generator | None
    ) -> Floats:
        """(T, S) readings of (T, D) [rad] hinge angles; without noise or steps if None.

        Hinges that are not listed are zero.
        """
        rotation = np.zeros((len(angles), len(self.sensors)))
        for s, sensor in enumerate(self.sensors):
            for hinge, factor in sensor.measures.items():
                if hinge in hinges:
                    rotation[:, s] += factor * angles[:, list(hinges).index(hinge)]
        size = np.array([sensor.high - sensor.low for sensor in self.sensors])
        low = np.array([sensor.low for sensor in self.sensors])
        measuring = np.array([bool(sensor.measures) for sensor in self.sensors])
        if rng is not None:
            noise = rng.normal(0.0, NOISE_SD_RAD, rotation.shape)
            again = np.abs(noise) > MOST_NOISE_RAD
            while again.any():
                noise[again] = rng.normal(0.0, NOISE_SD_RAD, int(again.sum()))
                again = np.abs(noise) > MOST_NOISE_RAD
        else:
            noise = np.zeros_like(rotation)
        share = (rotation - low) / size
        rest = -low / size
        stretch = self._stretch(share, rest)
        noisy = share + noise / size
        value = np.where(measuring, self._curve(noisy), noise / size) + stretch
        out: Floats = self.zero + self.span * value
        return out if rng is None else np.clip(np.rint(out), 0.0, LARGEST_READING)

    def _curve(self, share: Floats) -> Floats:
        ends = [np.tanh(self.steep * (u - self.middle)) for u in (0.0, 1.0)]
        soft = (np.tanh(self.steep * (share - self.middle)) - ends[0]) / (
            ends[1] - ends[0]
        )
        kinked = np.maximum(share - self.kink, 0.0) / (1.0 - self.kink)
        out: Floats = (1.0 - self.weight) * soft + self.weight * kinked
        return out

    def _stretch(self, share: Floats, rest: Floats) -> Floats:
        names = [sensor.name for sensor in self.sensors]
        pulled = self._pull(share) - self._pull(rest[None])
        out = pulled @ self.slight.T
        for s, sensor in enumerate(self.sensors):
            by = [names.index(name) for name, _ in sensor.stretched if name in names]
            for name, strength in sensor.stretched:
                if name in names:
                    out[:, s] += strength * pulled[:, names.index(name)]
            if len(by) > 1:
                out[:, s] += sensor.together * pulled[:, by[0]] * pulled[:, by[1]]
        return out

    def _pull(self, share: Floats) -> Floats:
        """Curve of the coupling: rises fast, then slower, with a kink."""
        soft = np.tanh(2.2 * share) / np.tanh(2.2)
        out: Floats = 0.7 * soft + 0.3 * np.maximum(share - self.cut, 0.0) / (
            1.0 - self.cut
        )
        return out


def make_hardware(glove: str, rng: np.random.Generator) -> Hardware:
    """Make one glove of a kind: every one has curves of its own.

    Raises
    ------
    UnknownNameError
        If it cannot be simulated.
    """
    sensors = sensors_of(glove)
    count = len(sensors)
    slight = np.zeros((count, count))
    for s, sensor in enumerate(sensors):
        known = {sensor.name} | {name for name, _ in sensor.stretched}
        for t in (s - 1, s + 1):
            if 0 <= t < count and sensors[t].name not in known and sensor.measures:
                slight[s, t] = rng.uniform(
                    -_MOST_SIDE_STRETCH_SHARE, _MOST_SIDE_STRETCH_SHARE
                )
    room = np.array([_room(sensor) for sensor in sensors])
    span = rng.uniform(150.0, 175.0, count) / (1.0 + room)
    return Hardware(
        sensors=sensors,
        steep=rng.uniform(0.9, 1.9, count),
        middle=rng.uniform(0.3, 0.7, count),
        kink=rng.uniform(0.35, 0.65, count),
        weight=rng.uniform(0.1, 0.3, count),
        zero=rng.uniform(25.0, 45.0, count) + 0.15 * room * span,
        span=span,
        slight=slight,
        cut=float(rng.uniform(0.35, 0.5)),
    )


def _room(sensor: Sensor) -> float:
    """Most that others stretch a sensor, in shares of its range."""
    most = sum(strength for _, strength in sensor.stretched)
    return max(0.9 * (most + min(sensor.together, 0.0)), 0.0)


def donned(
    hardware: Hardware, size: float, fits: Floats, rng: np.random.Generator
) -> Hardware:
    """Put the glove on a hand, once more.

    Parameters
    ----------
    size : of the hand against the mean; a larger one stretches the glove.
    fits : (2, S) how it fits this person: offset in shares of the range, gain.
    rng : of this donning, which differs from the last.
    """
    count = len(hardware.sensors)
    ranges = np.array([sensor.high - sensor.low for sensor in hardware.sensors])
    offset = fits[0] + rng.normal(0.0, np.radians(1.0), count) / ranges
    gain = (1.0 + 0.25 * (size - 1.0)) * fits[1] * (1.0 + rng.normal(0.0, 0.01, count))
    return Hardware(
        **{
            **{name: getattr(hardware, name) for name in hardware.__dataclass_fields__},
            "zero": hardware.zero + hardware.span * (offset + 0.2 * (size - 1.0)),
            "span": hardware.span * gain,
        }
    )


def draw_fit(hardware: Hardware, rng: np.random.Generator) -> Floats:
    """(2, S) how the glove fits one person."""
    count = len(hardware.sensors)
    ranges = np.array([sensor.high - sensor.low for sensor in hardware.sensors])
    return np.array(
        [
            rng.normal(0.0, np.radians(2.0), count) / ranges,
            1.0 + rng.normal(0.0, 0.03, count),
        ]
    )
