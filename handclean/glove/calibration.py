"""A calibration: what turns a glove's readings into rotations, with their variance.

It holds a model per measured rotation. What a model takes is the rotation's measuring
sensor and those that affect it. Rotations that follow others get their mean and
variance from them. `handclean.glove.calibrate` learns calibrations from samples;
`handclean.glove.donning` adapts one to another donning of the glove.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.glove.gloves import Glove
from handclean.glove.models import Fitted

_RULE_SD_SHARE = 0.1
"""[-] share of what follows (a DIP its PIP) by which people differ from the rule, one
standard deviation (chosen)."""

_FOREIGN_SHARE = 0.25
"""[-] readings this share of the samples' range outside of it are foreign (chosen)."""


@dataclass(frozen=True, kw_only=True)
class RotationFit:
    """The model of one rotation.

    Attributes
    ----------
    rotation, sensors : what of what.
    fitted : the model.
    fk, ik : samples it was learnt from.
    scale, floor : k and e [rad] of its variance.
    """

    rotation: str
    sensors: tuple[str, ...]
    fitted: Fitted
    fk: int
    ik: int
    scale: float = 1.0
    floor: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Donning:
    """How a donning differs from the one of the samples, see `handclean.glove.donning`.

    Attributes
    ----------
    middle, shift, gain : (S,) of x' = middle + gain (x - middle) + shift.
    doubt : [rad] what is not known of them, one standard deviation.
    """

    middle: Floats
    shift: Floats
    gain: Floats
    doubt: float

    def as_before(self, readings: Floats) -> Floats:
        """(T, S) readings x' of the samples' donning for readings x of this one."""
        out: Floats = self.middle + self.gain * (readings - self.middle) + self.shift
        return out


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What turns a glove's readings into rotations.

    Attributes
    ----------
    glove : which it is for.
    kind : of the models; use : of samples, "all", "fk" or "ik".
    subject : who wore it.
    fits : one per measured rotation, in the glove's order; some may be missing.
    low, high : (S,) readings of the samples' range, NaN for sensors not used.
    repeat : [rad] what another donning changes, one standard deviation.
    donning : how this donning differs from that of the samples; None if it is the same.
    """

    glove: Glove
    kind: str
    use: str
    subject: str
    fits: tuple[RotationFit, ...]
    low: Floats
    high: Floats
    repeat: float = 0.0
    donning: Donning | None = None

    def as_sampled(self, readings: Floats) -> Floats:
        """(T, S) what the sensors would have read in the samples' donning."""
        return readings if self.donning is None else self.donning.as_before(readings)


def predict_measured(
    calibration: Calibration, readings: Floats
) -> tuple[Floats, Floats]:
    """Predict the rotations that are measured, by a calibration.

    Parameters
    ----------
    readings : (T, S) in the order of the glove's sensors.

    Returns
    -------
    mean, variance : (T, R') [rad], [rad^2]
        In the order of ``glove.measured``. Rotations that are not calibrated stay at 0
        with a variance of NaN.
    """
    glove = calibration.glove
    donning = calibration.donning
    off = calibration.repeat if donning is None else donning.doubt
    readings = calibration.as_sampled(readings)
    order = [row.rotation for row in glove.measured]
    mean = np.zeros((len(readings), len(order)))
    variance = np.full(mean.shape, np.nan)
    for one in calibration.fits:
        columns = [glove.sensors.index(sensor) for sensor in one.sensors]
        k = order.index(one.rotation)
        inputs = np.ascontiguousarray(readings[:, columns])
        mean[:, k], own = one.fitted.predict(inputs)
        more = one.floor**2 + off**2
        variance[:, k] = one.scale * own + more
    return mean, variance


def to_hinges(
    glove: Glove, names: Sequence[str], mean: Floats, variance: Floats
) -> tuple[Floats, Floats]:
    """Turn measured rotations into hinge angles.

    Rotations count as independent. One that follows others is in doubt as they are,
    and as people differ in how it follows. A hinge that nothing measures stays where
    the glove says, or at zero, and its sigma is NaN.

    Parameters
    ----------
    names : of the D hinges that are wanted.
    mean, variance : (T, R') [rad], [rad^2] in the order of ``glove.measured``.

    Returns
    -------
    angles, sigma : (T, D) [rad]
    """
    factor, rest = glove.completion()
    follows = [r for r in glove.hand.rotations if glove.row(r).follows is not None]
    rule = [glove.hand.index(r) for r in follows]
    matrix = glove.hand.to_hinges(names)
    couple = matrix @ factor
    angles = np.tile(matrix @ rest, (len(mean), 1))
    sigma = np.full(angles.shape, np.nan)
    for d in np.flatnonzero(np.abs(couple).sum(axis=1) > 0.0):
        used = couple[d] != 0.0  # what is missing spoils only what needs it
        angles[:, d] += mean[:, used] @ couple[d, used]
        doubt = variance[:, used] @ couple[d, used] ** 2
        for r in rule:
            if matrix[d, r] != 0.0:
                followed = mean[:, used] @ factor[r, used]
                doubt += (_RULE_SD_SHARE * matrix[d, r] * followed) ** 2
        sigma[:, d] = np.sqrt(doubt)
    return angles, sigma


def sure(calibration: Calibration, variance: Floats, max_sigma: float) -> Bools:
    """Find the frames in which every calibrated rotation is sure enough.

    Parameters
    ----------
    variance : (T, R') [rad^2] in the order of ``glove.measured``.
    max_sigma : [rad]

    Returns
    -------
    (T,)
    """
    order = [row.rotation for row in calibration.glove.measured]
    own = [order.index(one.rotation) for one in calibration.fits]
    return np.asarray((variance[:, own] <= max_sigma**2).all(axis=1))


def foreign(calibration: Calibration, readings: Floats) -> Bools:
    """Find readings that no sample came near.

    Parameters
    ----------
    readings : (T, S) in the order of the glove's sensors.

    Returns
    -------
    (T, S)
    """
    readings = calibration.as_sampled(readings)
    size = calibration.high - calibration.low
    with np.errstate(invalid="ignore"):
        below = readings < calibration.low - _FOREIGN_SHARE * size
        out = below | (readings > calibration.high + _FOREIGN_SHARE * size)
    return np.asarray(out)
