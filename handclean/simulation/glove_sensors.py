"""Sensors of a simulated glove: what they read when joints turn.

A sensor answers to its own rotation through a curve of its own, with a kink and
saturation, f(u) = (1 - w) tanh-part + w max(u - k, 0) of u, the share of the active
range; other rotations stretch it (cross-coupling), through kinked curves g and a
product where two meet. None of these is in the class of linear and squared-exponential
kernels. The strengths are those of Wang & Neff (2013), table 1, in shares of the active
range. On top come the converter's steps, noise (Kessler et al. 1995: 1.1 degrees in the
mean, 3 at most), the hand's size, and at every donning a little offset and gain.

Hinges are those of the pose vector; a sensor's rotation is a sum of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.errors import UnknownNameError

NOISE_SD_RAD, MOST_NOISE_RAD = np.radians(1.42), np.radians(3.0)
"""[rad] normal, cut off: 1.1 degrees in the mean, 3 at most (Kessler et al. 1995)."""

LARGEST_READING = 255.0
"""Readings are whole numbers from 0 to this: a converter of 8 bits."""


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What a sensor answers to.

    Attributes
    ----------
    name : of the sensor.
    measures : hinge to factor; empty for one that only others stretch.
    low, high : [rad] active range of the sum.
    stretched : (other sensor, strength) pairs, in shares of the active range.
    together : strength of the product of the first two.
    """

    name: str
    measures: Mapping[str, float]
    low: float
    high: float
    stretched: tuple[tuple[str, float], ...] = ()
    together: float = 0.0


_RANGES_DEG = {  # [degrees]
    "T_TMC": ("thumb_cmc_flexion", -20, 50),
    "TI_ABD": ("thumb_cmc_abduction", -10, 60),
    "T_MCP": ("thumb_mcp_flexion", -10, 60),
    "T_IP": ("thumb_ip_flexion", -15, 80),
    "W_FLEX": ("wrist_flexion", -65, 70),
    "W_ABD": ("wrist_deviation", -35, 25),
}
_ABDUCTION_SENSORS = {
    "IM_ABD": ("index", "middle", 35),
    "MR_ABD": ("middle", "ring", 25),
    "RP_ABD": ("ring", "little", 35),
}
"""Fingers that sensors of abduction lie between, and how far these spread [degrees]
(chosen)."""

_FINGERS = {"I": "index", "M": "middle", "R": "ring", "P": "little"}
_STRETCH: dict[str, tuple[tuple[tuple[str, float], ...], float]] = {
    "TI_ABD": ((("T_TMC", 0.5),), 0.0),
    "IM_ABD": ((("I_MCP", 0.5), ("M_MCP", 0.75)), 0.8),
    "MR_ABD": ((("M_MCP", 1.2), ("R_MCP", 1.25)), -1.3),
    "RP_ABD": ((("R_MCP", 0.5), ("P_MCP", 0.6)), -0.6),
    "W_FLEX": ((("W_ABD", 0.45),), 0.0),
    "W_ABD": ((("W_FLEX", 0.36),), 0.0),
    "PALM_ARCH": (
        (
            ("T_TMC", 0.40), ("TI_ABD", 0.75), ("I_MCP", 0.18), ("IM_ABD", 0.18),
            ("M_MCP", 0.45), ("R_MCP", 0.62), ("MR_ABD", 0.3), ("P_MCP", 0.9),
            ("RP_ABD", 0.2),
        ),
        -0.4,
    ),
}  # fmt: skip
_MOST_SIDE_STRETCH_SHARE = 0.06
"""[-] share of the range by which a neighbour of no account stretches a sensor, at most
(chosen)."""


def _sensor(name: str) -> Sensor:
    stretched, together = _STRETCH.get(name, ((), 0.0))
    if name in _RANGES_DEG:
        hinge, low, high = _RANGES_DEG[name]
        measures = {hinge: 1.0}
    elif name in _ABDUCTION_SENSORS:
        one, other, high = _ABDUCTION_SENSORS[name]
        measures, low = (
            {f"{one}_mcp_abduction": 1.0, f"{other}_mcp_abduction": -1.0},
            -5,
        )
    elif name == "PALM_ARCH":
        measures, low, high = {}, 0, 40
    else:
        finger, part = _FINGERS[name[0]], name[2:].lower()
        measures = {f"{finger}_{part}_flexion": 1.0}
        low, high = {"mcp": (-25, 90), "pip": (-5, 105), "dip": (-5, 70)}[part]
    return Sensor(
        name=name,
        measures=measures,
        low=float(np.radians(low)),
        high=float(np.radians(high)),
        stretched=stretched,
        together=together,
    )


def _bend(name: str, finger: str) -> Sensor:
    parts = ("mcp", "ip") if finger == "thumb" else ("mcp", "pip")
    measures = {f"{finger}_{part}_flexion": 0.5 for part in parts}
    return Sensor(
        name=name, measures=measures, low=np.radians(-13.0), high=np.radians(98.0)
    )


_OF_18 = (
    "T_TMC TI_ABD T_MCP T_IP I_MCP I_PIP IM_ABD M_MCP M_PIP R_MCP R_PIP MR_ABD "
    "P_MCP P_PIP RP_ABD PALM_ARCH W_FLEX W_ABD"
)
_OF_22 = _OF_18
for _letter in "IMRP":
    _OF_22 = _OF_22.replace(f"{_letter}_PIP", f"{_letter}_PIP {_letter}_DIP")
_OF_14 = (
    "T_MCP T_IP TI_ABD I_MCP I_PIP IM_ABD M_MCP M_PIP MR_ABD R_MCP R_PIP RP_ABD "
    "P_MCP P_PIP"
)

GLOVES: dict[str, tuple[Sensor, ...]] = {
    "cyberglove18": tuple(map(_sensor, _OF_18.split())),
    "cyberglove22": tuple(map(_sensor, _OF_22.split())),
    "generic14": tuple(map(_sensor, _OF_14.split())),
    "generic5": tuple(
        _bend(name, finger)
        for name, finger in (
            ("THUMB", "thumb"), ("INDEX", "index"), ("MIDDLE", "middle"),
            ("RING", "ring"), ("PINKY", "little"),
        )
    ),
}  # fmt: skip
"""Sensors of the gloves that can be simulated, in their order."""


def sensors_of(glove: str) -> tuple[Sensor, ...]:
    """Return the sensors of a glove.

    Raises
    ------
    UnknownNameError
        If it cannot be simulated.
    """
    if glove not in GLOVES:
        raise UnknownNameError("simulate", "glove", glove, tuple(GLOVES))
    return GLOVES[glove]


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
