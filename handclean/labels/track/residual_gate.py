"""When a point is near enough to be a marker: the adaptive distance threshold.

Maycock 2015 section III-C accepts a marker if its distance from the model, after
inverse kinematics, stays below the average distance plus a small term. Here every
marker has its own average and spread, since some sit on soft skin and some on bone:

    threshold = average + strict * spread + small

Both start from the subject's calibration and follow what is accepted. A marker that has
been followed without a break may be `FOLLOWED_GATE_FACTOR` times as far away, since it
cannot have been exchanged for another point.
"""

import math
from typing import NamedTuple

from handclean.arrays import Floats
from handclean.kernels import jit

FOLLOWED_GATE_FACTOR = 2.5
"""How much wider the gate is for a marker followed without a break. Chosen."""

LEARNING_SHARE = 0.02
"""Share of a frame's distance in the averages, 50 frames. Chosen."""

MEAN_PER_RMS, SD_PER_RMS = 0.92, 0.39
"""Mean and standard deviation of the length of a random vector with equal normal
components, per its RMS length: ``sqrt(8 / (3 pi))`` and ``sqrt(1 - 8 / (3 pi))``."""

MAX_MEAN_PER_RMS = 2.0
"""How many times the calibrated RMS distance an average grows to, at most. Chosen."""


class UsualResiduals(NamedTuple):
    """Each marker's usual distance from its point: mean, variance, limit of the mean.

    mean (M,) [m]. variance (M,) [m^2]. most (M,) [m] : no mean grows beyond it; a
    finger that is bent the wrong way round would otherwise make its misfit usual.
    """

    mean: Floats
    variance: Floats
    most: Floats


def usual_residuals(sigma: Floats, small_m: float) -> UsualResiduals:
    """Return the distances to expect from (M,) [m] calibrated RMS distances."""
    return UsualResiduals(
        mean=MEAN_PER_RMS * sigma,
        variance=(SD_PER_RMS * sigma) ** 2,
        most=MAX_MEAN_PER_RMS * sigma + small_m,
    )


@jit
def threshold(usual: UsualResiduals, m: int, strict: float, small_m: float) -> float:
    """[m] how far marker m may be from its place and still be accepted."""
    return float(usual.mean[m] + strict * math.sqrt(usual.variance[m]) + small_m)


@jit
def learn_residual(usual: UsualResiduals, m: int, distance: float, most: float) -> None:
    """Update marker m's averages, in place, by a distance [m], cut at ``most``."""
    away = min(distance, most) - usual.mean[m]
    limit = usual.most[m]
    usual.mean[m] = min(usual.mean[m] + LEARNING_SHARE * away, limit)
    variance = usual.variance[m] + LEARNING_SHARE * (
        (1.0 - LEARNING_SHARE) * away * away - usual.variance[m]
    )
    usual.variance[m] = min(variance, 0.25 * limit * limit)
