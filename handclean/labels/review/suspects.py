"""Which frames of a tracked take fit worse than they should."""

import math

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.kernels import jit
from handclean.labels.track.alternatives import MIN_GAIN
from handclean.labels.track.fit import MISSING_COST
from handclean.labels.track.state import FrameSequence, TrackResult
from handclean.labels.track.tracker import Tracker

AROUND = 2
"""Frames on either side over which the cost is averaged (chosen)."""

EXPECTED = 2.0
"""Cost per assigned marker that is not worth a look, whatever the others cost
(chosen)."""

BESIDE = 0.04
"""[m] a point nearer than this to a marker's place is near the hand (chosen)."""


@jit
def count_spare(
    sequence: FrameSequence, result: TrackResult, places: Floats, spare: Floats
) -> None:
    """Write how many markers a frame lacks needlessly.

    Parameters
    ----------
    places : (T, M, 3) [m] of the markers.
    spare : (T,) markers without a point, as far as there are points without a marker
        near the hand.
    """
    markers = places.shape[1]
    most = 0
    for t in range(places.shape[0]):
        most = max(most, sequence.start[t + 1] - sequence.start[t])
    free = np.zeros(most, np.bool_)
    for t in range(places.shape[0]):
        spare[t] = 0.0
        begin, end = sequence.start[t], sequence.start[t + 1]
        free[: end - begin] = True
        count = 0
        for m in range(markers):
            if result.chosen[t, m] >= 0:
                free[result.chosen[t, m] - begin] = False
                count += 1
        if not result.tracked[t] or count == markers:
            continue
        near = 0
        for p in range(end - begin):
            if not free[p]:
                continue
            for m in range(markers):
                d2 = 0.0
                for n in range(3):
                    d2 += (sequence.at[begin + p, n] - places[t, m, n]) ** 2
                if d2 < BESIDE * BESIDE:
                    near += 1
                    break
        spare[t] = min(markers - count, near)


def mean_cost(squares: Floats, tracker: Tracker) -> Floats:
    """(T,) squared standard deviations per assigned marker, NaN where none are."""
    has = np.isfinite(squares)
    cost = np.where(has, np.fmin(squares / tracker.variance, MISSING_COST), 0.0).sum(
        axis=1
    )
    count = has.sum(axis=1)
    return np.where(count > 0, cost / np.maximum(count, 1), math.nan)


def suspicious(fit: Floats, spare: Floats, markers: int) -> Floats:
    """(T,) by how much the cost around each frame is above what is usual, or 0."""
    known = np.isfinite(fit)
    if not known.any():
        return np.zeros(len(fit))
    weight = np.maximum(_around(known), 1.0)
    mean = _around(np.where(known, fit, 0.0)) / weight
    middle = float(np.median(mean[known]))
    spread = 1.48 * float(np.median(np.abs(mean[known] - middle)))
    most = min(middle + 4.0 * spread, EXPECTED) + MIN_GAIN / markers
    excess = np.where(mean > most, mean / most - 1.0, 0.0)
    idle = _around(spare) / (2 * AROUND + 1)
    return np.where(known, excess + np.where(idle > 1.5, idle, 0.0), 0.0)


def _around(values: Floats | Bools) -> Floats:
    """(T,) sum over each frame and those around it, however few frames there are."""
    total: Floats = np.convolve(values, np.ones(2 * AROUND + 1))
    return total[AROUND : len(total) - AROUND]
