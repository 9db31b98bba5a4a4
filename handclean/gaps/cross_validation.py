"""What the take itself says about bridging: which fit is best, how far off it is.

Stretches of a take in which nothing is missing are bridged as if they were gaps, and
the middle of each bridge is compared with what was there. The fit of end velocities
that errs least is taken. Its squared errors e, by length of gap, follow ::

    e^2 ~ floor + gain * bend^2

bend being the path's own mean square acceleration: a gap through which the path must
bend is one in which much went on. (On the recordings of a Qualisys and of a NOKOV
system this puts 70-75 % of the errors within one sigma and 96 % within two, for gaps
from 0.05 to 0.5 s, where a constant per length has 70-94 % and 94-97 %.)

An integrated random walk of velocity, which is what least acceleration is the best
guess for, errs along the gap as (s (1 - s))^(3/2); that is the shape used on either
side of the middle.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.min_acceleration import EndFit, bend_of, slope_weights

WINDOWS = 60
"""Stretches tried per length (chosen)."""

ENOUGH = 40
"""Errors needed before a length counts (chosen)."""

_GAIN = 0.06
"""Middle error over bend times squared length, where the take cannot say; the
recordings named above have 0.03 to 0.08."""


@dataclass(frozen=True, kw_only=True)
class Law:
    """How far off a bridge is in its middle, one standard deviation.

    Attributes
    ----------
    lengths : (N,) [frames] gap lengths that were tried, rising; may be empty.
    floor : (N,) [unit^2]
    gain : (N,) [frame^4]
    """

    lengths: Floats
    floor: Floats
    gain: Floats

    def variance(self, frames: int, bend: Floats) -> Floats:
        """(C,) [unit^2] in the middle of a gap of ``frames`` frames.

        Parameters
        ----------
        bend : (C,) [unit/frame^2] root mean square acceleration of the path.
        """
        span = frames + 1.0
        if len(self.lengths) == 0:
            return np.asarray((_GAIN * span * span * bend) ** 2)
        spans = np.log(self.lengths + 1.0)
        at = float(np.clip(np.log(span), spans[0], spans[-1]))
        beyond = span / np.exp(at)
        floor = np.exp(np.interp(at, spans, np.log(self.floor))) * beyond**3
        gain = np.exp(np.interp(at, spans, np.log(self.gain))) * beyond**4
        return np.asarray(floor + gain * bend * bend)


def shape(frames: int) -> Floats:
    """(frames,) error along a gap over the error in its middle."""
    s = np.arange(1, frames + 1) / (frames + 1.0)
    return np.asarray((4.0 * s * (1.0 - s)) ** 1.5)


def lengths_to_try(longest: int) -> Ints:
    """Odd gap lengths from 1 frame to about the longest, each four times the last."""
    lengths, last = [1], max(longest - 1, 0) | 1
    while lengths[-1] < last:
        lengths.append(min(4 * lengths[-1] + 3, last))
    return np.array(lengths, dtype=np.int64)


def fits_to_try(rate: float) -> list[EndFit]:
    """Fits of 5 frames and of 50 and 100 ms, straight and bent, without repetition."""
    frames = sorted({5, *(max(5, round(seconds * rate)) for seconds in (0.05, 0.1))})
    return [EndFit(order=order, frames=n) for n in frames for order in (2, 1)]


def choose(
    values: Floats, known: Bools, longest: int, rate: float
) -> tuple[EndFit, Law]:
    """Find the fit that restores a take's known stretches best, and its law.

    Parameters
    ----------
    values, known : (T, C); columns of one unit and kind, which are pooled.
    longest : [frames] longest gap that will be bridged.
    rate : [Hz]
    """
    samples = np.where(known, values, np.nan)
    best, least = fits_to_try(rate)[0], np.inf
    found: dict[int, tuple[Floats, Floats]] = {}
    for fit in fits_to_try(rate):
        tried = {}
        for frames in lengths_to_try(longest):
            error, bend = errors_of(samples, int(frames), fit)
            whole = np.isfinite(error) & np.isfinite(bend)
            error, bend = error[whole], bend[whole]
            if len(error) >= ENOUGH:
                tried[int(frames)] = (error, bend)
        if len(tried) < max(len(found), 1):
            continue
        logs = [np.log(np.mean(error * error) + 1e-30) for error, _ in tried.values()]
        if np.mean(logs) < least:
            best, least, found = fit, float(np.mean(logs)), tried
    laws = np.array([_law(error, bend) for error, bend in found.values()])
    floor, gain = laws.reshape(-1, 2).T
    return best, Law(lengths=np.array(list(found), dtype=float), floor=floor, gain=gain)


def errors_of(
    samples: Floats, frames: int, fit: EndFit, windows: int = WINDOWS
) -> tuple[Floats, Floats]:
    """(W, C) what was there minus the bridge, mid-gap, and (W, C) the bridges' bends.

    Parameters
    ----------
    samples : (T, C), NaN where not known; so are errors of windows that lack something.
    frames : length of the gaps.
    windows : about how many to try.
    """
    span, width = frames + 1, fit.frames
    first, last = width - 1, len(samples) - width - span
    if last < first:
        return np.zeros((0, samples.shape[1])), np.zeros((0, samples.shape[1]))
    step = max(1, (last - first) // windows)
    left = np.arange(first, last + 1, step)
    right, back = left + span, np.arange(width)
    weights = slope_weights(-back, fit.order)
    v0 = np.tensordot(samples[left[:, None] - back], weights, axes=(1, 0))
    v1 = -np.tensordot(samples[right[:, None] + back], weights, axes=(1, 0))
    x0, x1 = samples[left], samples[right]
    middle = 0.5 * (x0 + x1) + span / 8.0 * (v0 - v1)
    bend = np.sqrt(bend_of(float(span), x0, v0, x1, v1))
    return samples[left + span // 2] - middle, bend


def _law(error: Floats, bend: Floats) -> tuple[float, float]:
    """Fit e^2 ~ floor + gain bend^2, each error weighed by its own sigma."""
    square, drive = error * error, bend * bend
    total = max(float(square.mean()), 1e-24)
    least = 1e-6 * total
    floor, gain = 0.5 * total, 0.5 * total / max(float(drive.mean()), 1e-30)
    for _ in range(20):
        weight = (floor + gain * drive) ** -2
        a, b = weight.sum(), (weight * drive).sum()
        c = (weight * drive * drive).sum()
        p, q = (weight * square).sum(), (weight * drive * square).sum()
        size = a * c - b * b
        if size <= 1e-12 * a * c:
            return total, 0.0 + 1e-30
        floor = max((c * p - b * q) / size, least)
        gain = max((a * q - b * p) / size, 1e-30)
    return floor, gain
