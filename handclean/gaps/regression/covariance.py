"""How alike the places of a hidden marker are in two frames, by what the others show.

Rows are frames. Places and features are local: rotated and moved with the body, see
`features`. With a, b, n the features by speed (slow, middle, fast), c the mean of a
over the gap, D the distance of two postures and time in frames of 120 Hz, the
covariance of rows s and t is ::

    k = K0 + (a_s - c) . (a_t - c) (G + H exp(-D^2 / 2))
        + B b_s . b_t + N n_s . n_t + v R exp(-D / 2 - |s - t| / 200)

The first line is a linear regression whose slopes differ a little from posture to
posture. The second lets quick movements have slopes of their own, and ends with what no
linear rule says: a residual that is alike in like postures not long apart. v is the
features' variance per marker times a factor that is fitted (`process`). (Rasmussen and
Williams, Gaussian Processes for Machine Learning, 2006, section 2.7 and equation 4.18.)

Tried and left: residuals that are alike in like postures at any time, and in frames not
long apart whatever the posture (Matern 3/2): less than 1 % either way on five takes,
once the size of residuals is fitted.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.kernels.frame_covariance import Parts, Shares, add_covariances

MEAN_M2 = 1e-3
"""[m^2] variance of a constant, K0: that of any place in reach of a hand."""

GLOBAL_SLOPE, LOCAL_SLOPE = 0.9, 0.09
MIDDLE_SLOPE, FAST_SLOPE = 0.3, 0.3
RESIDUAL, RESIDUAL_REACH = 0.05, 200.0
"""Share of the features' variance, and reach in frames of 120 Hz. All shares chosen on
takes of hands of three systems; what each gains: table "gaps" of RESULTS.md."""

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
    from_centre = left.slow - scale.centre
    other = from_centre if right is left else right.slow - scale.centre
    slow = from_centre @ other.T
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
        fading=np.exp(-apart / RESIDUAL_REACH),
    )
    add_covariances(parts, _shares(scale.variance), lower, out)
    return np.asarray(out)


def _shares(variance: float) -> Shares:
    return Shares(
        constant=MEAN_M2,
        slope=GLOBAL_SLOPE,
        local_slope=LOCAL_SLOPE,
        residual=variance * RESIDUAL,
    )


def own_variance(rows: Rows, scale: Scale) -> Floats:
    """(N,) [m^2] covariance of each row with itself."""
    slow = np.sum((rows.slow - scale.centre) ** 2, axis=1)
    quick = np.sum(rows.quick**2, axis=1)
    residual = scale.variance * RESIDUAL
    return np.asarray(MEAN_M2 + (GLOBAL_SLOPE + LOCAL_SLOPE) * slow + quick + residual)
