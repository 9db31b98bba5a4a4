"""How alike the places of a hidden marker are in two frames, by what the others show.

Rows are frames. Places and features are local: rotated and moved with the body, see
`features`. With a, b, n the features by speed (slow, middle, fast), c the mean of a
over the gap, D the distance of two postures, M(r) = (1 + sqrt(3) r) exp(-sqrt(3) r)
(Matern 3/2) and time in frames of 120 Hz, the covariance of rows s and t is ::

    k = K0 + (a_s - c) . (a_t - c) (G + H exp(-D^2 / 2))
        + B b_s . b_t + N n_s . n_t
        + v (P M(D) + Q exp(-D / 2 - |s - t| / 200) + S M(|s - t| / 600))

The first line is a linear regression whose slopes differ a little from posture to
posture; the second lets quick movements have slopes of their own; the third is what no
linear rule says: a residual that is alike in like postures, in like postures not long
apart, and in frames not long apart. v is the features' variance per marker. (Rasmussen
and Williams, Gaussian Processes for Machine Learning, 2006, equations 2.37, 4.17.)
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels.frame_covariance import Parts, Shares, add_covariances

MEAN_M2 = 1e-3
"""[m^2] variance of a constant, K0: that of any place in reach of a hand."""

GLOBAL_SLOPE, LOCAL_SLOPE = 0.9, 0.09
MIDDLE_SLOPE, FAST_SLOPE = 0.3, 0.3
POSTURE, POSTURE_TIME, TIME = 0.06, 0.05, 0.027
POSTURE_TIME_REACH, TIME_REACH = 200.0, 600.0
"""Shares of the features' variance, and reaches in frames of 120 Hz. Chosen on takes of
hands of three systems; what each gains: table "gaps" of RESULTS.md."""

CLOCK_HZ = 120.0
"""[Hz] frames that reaches count in."""


class Rows(NamedTuple):
    """N frames as the covariance sees them.

    posture (N, P) [-] for distances; slow (N, P), quick (N, Q) [m] features, those of
    quick times the root of their share; frame (N,) number of each frame.
    """

    posture: Floats
    slow: Floats
    quick: Floats
    frame: Ints


class Scale(NamedTuple):
    """What covariances are scaled by.

    centre (P,) [m] c of the module's formula; variance v [m^2]; clock: how many frames
    of 120 Hz a frame of the take is.
    """

    centre: Floats
    variance: float
    clock: float


def covariance(left: Rows, right: Rows, scale: Scale, *, lower: bool = False) -> Floats:
    """(N, N') [m^2] covariance of the rows of ``left`` with those of ``right``.

    Parameters
    ----------
    lower : whether only the lower triangle is needed; the rest is not covariance then.
    """
    slow = (left.slow - scale.centre) @ (right.slow - scale.centre).T
    out = left.quick @ right.quick.T
    furthest = max(left.frame.max(), right.frame.max())
    apart = scale.clock * np.arange(furthest + 1)
    parts = Parts(
        posture=left.posture @ right.posture.T,
        left=np.einsum("np,np->n", left.posture, left.posture),
        right=np.einsum("np,np->n", right.posture, right.posture),
        slow=slow,
        rows=left.frame,
        columns=right.frame,
        fading=np.exp(-apart / POSTURE_TIME_REACH),
        lasting=matern(apart / TIME_REACH),
    )
    add_covariances(parts, _shares(scale.variance), lower, out)
    return np.asarray(out)


def _shares(variance: float) -> Shares:
    return Shares(
        constant=MEAN_M2,
        slope=GLOBAL_SLOPE,
        local_slope=LOCAL_SLOPE,
        posture=variance * POSTURE,
        posture_time=variance * POSTURE_TIME,
        time=variance * TIME,
    )


def own_variance(rows: Rows, scale: Scale) -> Floats:
    """(N,) [m^2] covariance of each row with itself."""
    slow = np.sum((rows.slow - scale.centre) ** 2, axis=1)
    quick = np.sum(rows.quick**2, axis=1)
    residual = scale.variance * (POSTURE + POSTURE_TIME + TIME)
    return np.asarray(MEAN_M2 + (GLOBAL_SLOPE + LOCAL_SLOPE) * slow + quick + residual)


def matern(distance: Floats) -> Floats:
    """M of the module's formula."""
    scaled = np.sqrt(3.0) * distance
    return np.asarray((1.0 + scaled) * np.exp(-scaled))
