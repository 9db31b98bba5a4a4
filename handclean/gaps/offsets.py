"""What is left over between markers and posture, carried through the gaps.

A marker is never quite where the model has it: skin slides, a calibration errs, and a
posture divides such contradictions among all markers it was fitted to. When one of them
goes missing, the others alone would pull the posture elsewhere, by a step.

So within a gap the model is the one that holds at its ends: every marker's place on its
bone is moved by what is left over there. With e(t) the left-over of a marker in its
bone's frame in frames that tell it, the places in between are moved by ::

    r(t) = sum_s K(t - s) w(s) e(s) / sum_s K(t - s) w(s),
    K(d) = (1 + (d / width)^2)^(-3/2)

an average over a few frames near a frame that tells (which ones are: w = 1 where all
markers expected are seen, little where some are missing), inverse distance weighting
(Shepard 1968), hence a smooth blend of both ends, in a gap. In the frames at a gap's
ends the moved model fits with any choice of markers, so none of them makes a step.

The width is the one with which a take's known stretches would have been restored best
(see `trial`); what it left over there, by length of gap, is part of sigma.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats
from handclean.gaps.cross_validation import ENOUGH, WINDOWS, lengths_to_try
from handclean.hand.model import Model, bone_rotations, marker_positions

WIDTHS = (0.5, 2.0, 6.0)
"""[frames] to try (chosen)."""

PARTIAL = 0.01
"""Weight of a frame in which an expected marker is missing (chosen)."""

USUAL = 1e-4
"""Weight of a marker's mean over the take, for when nothing else is near (chosen)."""

UNTRIED = 1e-3
"""[m] per axis, the error mid-gap where the take cannot say (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Leftovers:
    """How marker places move on their bones.

    Attributes
    ----------
    places : (T, M, 3) [m] left-over to be expected in each frame, in the bone's frame.
    width : [frames] of the kernel.
    lengths : (N,) [frames] gap lengths tried, rising; at least one.
    variance : (N,) [m^2] per axis, of the error in the middle of such gaps.
    """

    places: Floats
    width: float
    lengths: Floats
    variance: Floats

    def at(self, frames: int) -> float:
        """[m^2] variance per axis mid-gap, for a gap of this length."""
        logs = np.interp(np.log(frames), np.log(self.lengths), np.log(self.variance))
        return float(np.exp(logs))


def left_over(model: Model, poses: Floats, positions: Floats) -> Floats:
    """(T, M, 3) [m] measured minus model, in the bones' frames; NaN if not measured."""
    away = positions - marker_positions(model, poses)
    turns = bone_rotations(model.tree, poses)
    local = np.zeros(away.shape)
    for m, bone in enumerate(model.bone):
        local[:, m] = np.einsum("tij,ti->tj", turns[:, bone], away[:, m])
    return local


def carry(local: Floats, tells: Floats, longest: int) -> Leftovers:
    """Carry what is left over through gaps.

    Parameters
    ----------
    local : (T, M, 3) [m] as `left_over` gives it.
    tells : (T,) weight of each frame, 0 where the posture is not known.
    longest : [frames] longest gap.
    """
    series = local.reshape(len(local), -1)
    told = np.isfinite(series) & (tells[:, None] > 0.0)
    clean = np.where(told & (tells[:, None] > PARTIAL), series, np.nan)
    best: tuple[float, dict[float, float]] = (WIDTHS[1], {})
    least = np.inf
    for width in WIDTHS:
        found = {}
        for frames in lengths_to_try(longest):
            error = _errors(clean, int(frames), width)
            if len(error) >= ENOUGH:
                found[float(frames)] = float(np.mean(error * error)) + 1e-16
        if found and (score := np.mean(np.log(list(found.values())))) < least:
            least, best = float(score), (width, found)
    width, found = best
    found = found or {1.0: UNTRIED**2}
    weight = np.where(told, tells[:, None], 0.0)
    return Leftovers(
        places=_smooth(np.where(told, series, 0.0), weight, width, longest).reshape(
            local.shape
        ),
        width=width,
        lengths=np.array(list(found)),
        variance=np.array(list(found.values())),
    )


def kernel(distance: NDArray[np.floating[Any]], width: float) -> Floats:
    """K of the module's formula."""
    return np.asarray((1.0 + (distance / width) ** 2) ** -1.5)


def convolved(series: Floats, around: Floats) -> Floats:
    """(T, C) columns convolved with (2 R + 1,) weights, 0 beyond the ends.

    By Fourier transforms of overlapping blocks, so that time grows with T log R and
    memory with T. (``scipy.signal`` does the same; to load it takes a third of the time
    that cleaning a short take does.)
    """
    frames, reach = len(series), len(around) // 2
    size = 1 << int(np.ceil(np.log2(5 * len(around))))
    block = size - len(around) + 1
    spectrum = np.fft.rfft(around, size)[:, None]
    out = np.zeros((frames + size, series.shape[1]))
    for first in range(0, frames, block):
        part = np.fft.rfft(series[first : first + block], size, axis=0)
        out[first : first + size] += np.fft.irfft(part * spectrum, size, axis=0)
    return out[reach : reach + frames]


def _smooth(series: Floats, weight: Floats, width: float, longest: int) -> Floats:
    """(T, C) r of the module's formula; 0 for a column that nothing tells."""
    reach = min(2 * longest + 50, max(len(series) - 1, 1))
    around = kernel(np.arange(-reach, reach + 1.0), width)
    total = weight.sum(axis=0)
    usual = (weight * series).sum(axis=0) / np.where(total > 0.0, total, 1.0)
    weighed = convolved(weight * (series - usual), around)
    weights = convolved(weight, around)
    floor = USUAL * kernel(np.array(float(reach)), width)
    return np.asarray(usual + weighed / (np.maximum(weights, 0.0) + floor))


def _errors(series: Floats, frames: int, width: float) -> Floats:
    """(N,) errors in the middle of windows around which all is known."""
    span = frames + 1
    count = 10 + span // 2
    first, last = count - 1, len(series) - count - span
    if last < first:
        return np.zeros(0)
    left = np.arange(first, last + 1, max(1, (last - first) // WINDOWS))
    around = np.arange(count)
    weights = kernel(np.arange(0.5 * span, 0.5 * span + count), width)
    weights /= 2.0 * weights.sum()
    before = np.tensordot(series[left[:, None] - around], weights, axes=(1, 0))
    after = np.tensordot(series[(left + span)[:, None] + around], weights, axes=(1, 0))
    error = (before + after - series[left + span // 2]).ravel()
    return np.asarray(error[np.isfinite(error)])
