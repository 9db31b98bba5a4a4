"""A marker on the discrete path of least acceleration, as the papers print it.

Maycock 2015 (III-C) and Schroeder 2017 (equation 6) ask for values and velocities at
both ends (C1) and replace derivatives by differences of frames. With x the known
samples on both sides and second differences a_t = x_(t-1) - 2 x_t + x_(t+1), the
unknown ones minimise the sum of |a_t|^2. Where that is least the fourth differences
vanish, so that the path is the one cubic through two samples on each side: its end
velocities are differences of single frames, so that noise of the markers grows with
the gap, 5.5 times over 20 frames and 25 times over 100. `cubic` is the same path with
velocities from a fit; this one shows what the fit gains.

With T the frames between the ends x0, x1, their outer neighbours x0' and x1' are at
s = -1 / T and 1 + 1 / T, and Lagrange's formula goes through the four.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.family.cubic import smooth_spread
from handclean.gaps.family.ends import expect_both_ends
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Refused, Tracks


def prepare(tracks: Tracks) -> Fill:
    """Fill with the cubic through two samples on each side."""

    def fill(gap: Gap) -> Path:
        expect_both_ends(tracks, gap)
        knots = np.array([gap.start - 2, gap.start - 1, gap.stop, gap.stop + 1])
        within = knots[0] >= 0 and knots[3] < len(tracks.seen)
        if not (within and tracks.seen[knots, gap.column].all()):
            raise Refused("two samples on each side of it should be measured")
        weights = _lagrange(knots, gap)
        places = weights @ tracks.positions[knots, gap.column]
        return Path(places, smooth_spread(tracks, gap))

    return fill


def _lagrange(knots: Floats, gap: Gap) -> Floats:
    """(N, 4) weights of samples at four knots in the frames of a gap."""
    middle, half = 0.5 * (knots[0] + knots[3]), 0.5 * (knots[3] - knots[0])
    x = (np.arange(gap.start, gap.stop) - middle) / half
    at = (knots - middle) / half
    weights = np.ones((gap.frames, 4))
    for k in range(4):
        for other in range(4):
            if other != k:
                weights[:, k] *= (x - at[other]) / (at[k] - at[other])
    return weights
