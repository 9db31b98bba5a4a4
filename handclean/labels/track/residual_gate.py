"""When a point is near enough to be a marker: the adaptive distance threshold.

Maycock 2015 section III-C accepts a marker if its distance from the model, after
inverse kinematics, stays below the average distance plus a small term. Here every
marker has its own average and spread, since some sit on soft skin and some on bone:

    threshold = average + strict * spread + small

Both start from the subject's calibration and follow what is accepted. A marker that has
been followed without a break may stray `STEADY` times as far: its path speaks for it.
"""

import math
from typing import NamedTuple

from handclean.arrays import Floats
from handclean.kernels import jit

STEADY = 2.5
"""How much further than a newcomer may be a marker followed without a break."""

_RATE = 0.02
"""Share of a new distance in the averages."""


class Usual(NamedTuple):
    """(M,) [m], [m^2], [m]: average, variance of each marker's distance, and a limit.

    No average grows beyond ``most``: a finger that is bent the wrong way round would
    otherwise make its misfit usual.
    """

    mean: Floats
    variance: Floats
    most: Floats


def usual(sigma: Floats, small: float) -> Usual:
    """Start from (M,) [m] RMS distances; those of random vectors have these moments."""
    return Usual(
        mean=0.92 * sigma,
        variance=(0.39 * sigma) ** 2,
        most=2.0 * sigma + small,
    )


@jit
def threshold(of: Usual, m: int, strict: float, small: float) -> float:
    """[m] how far marker m may be from its place and still be accepted."""
    return float(of.mean[m] + strict * math.sqrt(of.variance[m]) + small)


@jit
def learn(of: Usual, m: int, distance: float, most: float) -> None:
    """Let an accepted distance [m], cut at ``most``, into the averages."""
    away = min(distance, most) - of.mean[m]
    limit = of.most[m]
    of.mean[m] = min(of.mean[m] + _RATE * away, limit)
    variance = of.variance[m] + _RATE * ((1.0 - _RATE) * away * away - of.variance[m])
    of.variance[m] = min(variance, 0.25 * limit * limit)
