"""Adapt a calibration to another donning of the same glove.

A glove never sits as it did before it was taken off. Every sensor's readings are
shifted and stretched a little, the more so on another hand, and a calibration is off by
that much. A few samples of the new donning tell by how much. With
x' = m + g (x - m) + b and m the middle of the sensor's range, sought are the shifts b
and gains g under which the calibration explains these samples, ::

    sum_n |tau(x'_n) - theta_n|^2 / s_n^2  +  sum_s (b_s / B)^2 + ((g_s - 1) / G)^2,

by Gauss and Newton's steps, with slopes of tau by differences. B and G are what usually
changes, times 1, 2, 4 or 8, whichever has the largest evidence (Laplace): another
wearer's glove may have changed more. A recording in which nothing moves is one
observation, however many frames it has; one with motion counts for up to ten.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.errors import HandcleanError
from handclean.glove.calibration import Calibration, Donning, RotationFit
from handclean.glove.samples import IK, Samples

_POSE_SD_RAD, _TOUCH_SD_RAD = np.radians(1.2), np.radians(1.5)
"""[rad] standard deviation of the angles of FK and of IK samples (chosen)."""

_USUAL_SHIFT_RAD = np.radians(1.5)
"""[rad] usual shift where the calibration does not say (chosen; the default of
``repeat_deg``)."""

_USUAL_GAIN_SD = 0.02
"""[-] standard deviation of gains (chosen)."""

_USUAL_FACTORS = (1.0, 2.0, 4.0, 8.0)
"""[-] of the usual change, which are tried (chosen)."""

_MOST_STEPS, _LEAST_STEP_SD = 12, 1e-4
"""Steps at most; [-] the smallest, in standard deviations of the prior (chosen)."""

_MOVING_SD_SHARE = 0.04
"""[-] share of its range (sd) by which a sensor moves in a recording (chosen)."""

_MOST_OBSERVATIONS = 10.0
"""Observations that a recording with motion counts for, at most (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Adapted:
    """A calibration for a new donning, and how the donning differs.

    Attributes
    ----------
    calibration : for the new donning.
    shift : (S,) [rad] of the rotation each sensor measures, nan for sensors not used.
    gain : (S,) factor, nan likewise.
    before, after : [rad] weighted RMS of samples before and after.
    scale : of the usual change, that was most probable.
    doubt : [rad] what is not known of shifts, one standard deviation.
    samples : that were used.
    """

    calibration: Calibration
    shift: Floats
    gain: Floats
    before: float
    after: float
    scale: float
    doubt: float
    samples: int


@dataclass(frozen=True, kw_only=True)
class _Observed:
    """Samples of one rotation.

    Attributes
    ----------
    fit : its model; columns : (C,) places of its sensors.
    readings : (n, S) of the new donning; targets : (n,) [rad].
    sigma : (n,) [rad], with what samples share spread over them.
    """

    fit: RotationFit
    columns: Ints
    readings: Floats
    targets: Floats
    sigma: Floats


def adapt_to_donning(calibration: Calibration, samples: Samples) -> Adapted:
    """Adapt a calibration to another donning of the same glove.

    Parameters
    ----------
    calibration : of an earlier donning, perhaps another person's.
    samples : of the new one: a few key poses, touching, whatever there is.

    Raises
    ------
    HandcleanError
        If samples are of another glove, or none is of a calibrated rotation.
    """
    glove = calibration.glove
    if (samples.glove, samples.sensors) != (glove.name, glove.sensors):
        raise HandcleanError(
            f"samples: are of glove {samples.glove}, the calibration of {glove.name}"
        )
    calibration = replace(calibration, donning=None)
    observed = _observed(calibration, samples)
    if not observed:
        raise HandcleanError("samples: tell no rotation that is calibrated")
    usual = calibration.repeat or _USUAL_SHIFT_RAD
    found = [
        _search(calibration, observed, s * usual, s * _USUAL_GAIN_SD)
        for s in _USUAL_FACTORS
    ]
    best = int(np.argmax([evidence for _, evidence in found]))
    donning, _ = found[best]
    own = np.array([s in glove.used for s in glove.sensors])
    start = _donning(calibration, np.zeros(2 * len(own)))
    return Adapted(
        calibration=replace(
            calibration, donning=donning, subject=samples.subject or calibration.subject
        ),
        shift=np.where(own, donning.shift / _reading_per_radian(calibration), np.nan),
        gain=np.where(own, donning.gain, np.nan),
        before=_rms(observed, start),
        after=_rms(observed, donning),
        scale=_USUAL_FACTORS[best],
        doubt=donning.doubt,
        samples=int(np.isfinite(samples.targets).any(axis=1).sum()),
    )


def _observed(calibration: Calibration, samples: Samples) -> list[_Observed]:
    glove = calibration.glove
    size = calibration.high - calibration.low
    counts = _observations(samples, size)
    out = []
    for one in calibration.fits:
        targets = samples.targets[:, glove.hand.index(one.rotation)]
        columns = np.array([glove.sensors.index(name) for name in one.sensors])
        inputs = samples.readings[:, columns]
        known = np.flatnonzero(np.isfinite(targets) & np.isfinite(inputs).all(axis=1))
        if not len(known):
            continue
        group = samples.group[known]
        share = counts[group] / np.bincount(group)[group]
        off = np.array([_POSE_SD_RAD, _TOUCH_SD_RAD])[
            (samples.kind[known] == IK).astype(np.intp)
        ]
        _, own = one.fitted.predict(inputs[known])
        variance = one.scale * own + one.floor**2
        out.append(
            _Observed(
                fit=one,
                columns=columns,
                readings=samples.readings[known],
                targets=targets[known],
                sigma=np.sqrt((off**2 + variance) / share),
            )
        )
    return out


def _observations(samples: Samples, size: Floats) -> Floats:
    """(G,) for how many observations each recording counts."""
    out = np.ones(len(samples.groups))
    used = np.flatnonzero(size > 0.0)
    for g in np.unique(samples.group):
        own = samples.readings[samples.group == g][:, used]
        if (np.nanstd(own, axis=0) > _MOVING_SD_SHARE * size[used]).any():
            out[g] = min(len(own), _MOST_OBSERVATIONS)
    return out


def _reading_per_radian(calibration: Calibration) -> Floats:
    """(S,) how much sensors change for a radian of what they measure."""
    glove = calibration.glove
    size = calibration.high - calibration.low
    out: Floats = np.where(size > 0.0, size, 1.0) / np.radians(90.0)
    for row in glove.measured:
        low, high = glove.hand.ranges[glove.hand.index(row.rotation)]
        out[glove.sensors.index(row.measured_by)] *= np.radians(90.0) / (high - low)
    return out


def _donning(calibration: Calibration, step: Floats, doubt: float = 0.0) -> Donning:
    """Return shifts and gains of (2 S,) changes: [rad], and of gains less one."""
    middle = np.nan_to_num(0.5 * (calibration.low + calibration.high))
    shift, gain = step.reshape(2, -1)
    return Donning(
        middle=middle,
        shift=shift * _reading_per_radian(calibration),
        gain=1.0 + gain,
        doubt=doubt,
    )


def _search(
    calibration: Calibration, observed: list[_Observed], usual: float, gain: float
) -> tuple[Donning, float]:
    """Return the most probable donning, and its log evidence."""
    count = len(calibration.glove.sensors)
    prior = np.repeat([usual, gain], count)
    step = np.zeros(2 * count)
    for _ in range(_MOST_STEPS):
        matrix, right, _ = _normal(calibration, observed, step)
        more = np.linalg.solve(matrix + np.diag(prior**-2), right - step / prior**2)
        step = step + more
        if np.abs(more / prior).max() < _LEAST_STEP_SD:
            break
    matrix, _, cost = _normal(calibration, observed, step)
    inverse = np.linalg.inv(matrix + np.diag(prior**-2))
    half = 0.5 * float(np.linalg.slogdet(inverse)[1]) - float(np.log(prior).sum())
    evidence = half - 0.5 * (cost + float(((step / prior) ** 2).sum()))
    seen = np.unique(np.concatenate([o.columns[:1] for o in observed]))
    doubt = float(np.sqrt(np.diag(inverse)[seen].mean()))
    return _donning(calibration, step, doubt), evidence


def _normal(
    calibration: Calibration, observed: list[_Observed], step: Floats
) -> tuple[Floats, Floats, float]:
    """(2 S, 2 S) and (2 S,) of the samples' normal equations, and their cost."""
    donning = _donning(calibration, step)
    per_radian = _reading_per_radian(calibration)
    count = len(per_radian)
    matrix, right, cost = np.zeros((2 * count, 2 * count)), np.zeros(2 * count), 0.0
    for one in observed:
        inputs = donning.as_before(one.readings)[:, one.columns]
        mean, slope = _slopes(one.fit, inputs)
        off = (one.targets - mean) / one.sigma
        slope /= one.sigma[:, None]
        from_middle = (one.readings - donning.middle)[:, one.columns]
        both = np.hstack([slope * per_radian[one.columns], slope * from_middle])
        place = np.concatenate([one.columns, count + one.columns])
        matrix[np.ix_(place, place)] += both.T @ both
        right[place] += both.T @ off
        cost += float(off @ off)
    return matrix, right, cost


def _slopes(fit: RotationFit, inputs: Floats) -> tuple[Floats, Floats]:
    """(n,) [rad] a model's mean and (n, C) its slopes, by central differences."""
    spread = fit.fitted.scaling.spread
    slope = np.zeros(inputs.shape)
    for c in range(inputs.shape[1]):
        step = np.zeros(inputs.shape[1])
        step[c] = 1e-3 * spread[c]
        above, below = (fit.fitted.predict(inputs + s * step)[0] for s in (1.0, -1.0))
        slope[:, c] = (above - below) / (2.0 * step[c])
    return fit.fitted.predict(inputs)[0], slope


def _rms(observed: list[_Observed], donning: Donning) -> float:
    """[rad] RMS of the samples' differences, each with its weight."""
    total, weight = 0.0, 0.0
    for one in observed:
        mean, _ = one.fit.fitted.predict(
            donning.as_before(one.readings)[:, one.columns]
        )
        total += float((((mean - one.targets) / one.sigma) ** 2).sum())
        weight += float((one.sigma**-2).sum())
    return float(np.sqrt(total / weight))
