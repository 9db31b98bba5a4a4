"""Covariances of frames put together from their parts: compiled.

The formula is that of `handclean.gaps.regression.covariance`.
"""

import math
from typing import NamedTuple

from handclean.arrays import Floats, Ints
from handclean.kernels import jit


class Shares(NamedTuple):
    """How much each part counts: slopes [-], residual and the constant [m^2]."""

    constant: float
    slope: float
    local_slope: float
    residual: float


class Parts(NamedTuple):
    """What is known of pairs of frames, (N, N').

    posture [-], slow [m^2] products of their postures and slow features; left (N,),
    right (N',) [-] squares of their postures; rows (N,), columns (N',) numbers of the
    frames; fading, lasting (F,) factors by how many frames two are apart.
    """

    posture: Floats
    left: Floats
    right: Floats
    slow: Floats
    rows: Ints
    columns: Ints
    fading: Floats


@jit
def add_covariances(parts: Parts, shares: Shares, lower: bool, out: Floats) -> None:
    """Add to (N, N') ``out`` all but what quick features say.

    Parameters
    ----------
    lower : whether only the lower triangle is wanted.
    """
    for s in range(parts.posture.shape[0]):
        stop = s + 1 if lower else parts.posture.shape[1]
        for t in range(stop):
            square = parts.left[s] + parts.right[t] - 2.0 * parts.posture[s, t]
            square = max(square, 0.0)
            distance = math.sqrt(square)
            apart = abs(parts.rows[s] - parts.columns[t])
            slope = shares.slope + shares.local_slope * math.exp(-0.5 * square)
            alike = math.exp(-0.5 * distance) * parts.fading[apart]
            out[s, t] += (
                shares.constant + parts.slow[s, t] * slope + shares.residual * alike
            )
