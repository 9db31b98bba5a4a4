"""A marker as an affine combination of the others (Pavllo 2019 section 3.2.1).

In the last frame before a gap, with the markers X (V, 3) that are seen and the hidden
one at y, weights w that sum to one are sought that minimise (equation 5) ::

    |y - w X|^2 + lambda |w|^2

and used in the frames of the gap. The paper adds a coordinate that is 1 to y and X and
solves equation 8, W = Y X^T (X X^T + lambda I)^-1, which leaves the sum of the weights
a little under one and depends on where the origin is. Seen from the centroid c of the
X, with X' = X - c, both slips vanish ::

    w = 1 / V + (y - c) (X'^T X' + lambda I)^-1 X'^T

sums to one exactly, since X' sums to nothing, and is what equation 8 gives for a
lambda that is small beside V. The paper's lambda = 1e-8 has a unit of length; here it
is that part of the sum of |X'|^2.

Whatever w X misses of y in the last frame, since there are fewer than four markers or
all lie in one plane, is carried along, so that no marker jumps ("discontinuities are
avoided by design"). Only what is seen up to a frame is used for it: when another marker
disappears, the weights are found anew in the frame before, from where the hidden marker
was put in it.
"""

from itertools import pairwise

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.gaps.family.ends import (
    away_since,
    expect_start,
    speed_before,
    with_floor,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Refused, Tracks

REGULARIZATION = 1e-8
"""lambda over the sum of squared distances from the centroid (Pavllo 2019, equation 5,
without its unit)."""


def prepare(tracks: Tracks) -> Fill:
    """Fill by affine weights; reads the others up to the frame that is filled."""

    def fill(gap: Gap) -> Path:
        expect_start(tracks, gap)
        places = np.zeros((gap.frames, 3))
        last = tracks.positions[gap.start - 1, gap.column]
        for start, stop, others in _stretches(tracks, gap):
            group = tracks.positions[start - 1 : stop][:, others]
            weights = weights_of(last, group[0])
            path = weights @ group
            rows = slice(start - gap.start, stop - gap.start)
            places[rows] = path[1:] + (last - path[0])
            last = places[stop - gap.start - 1]
        spread = speed_before(tracks, gap) * away_since(tracks, gap)
        return Path(places, with_floor(spread))

    return fill


def weights_of(place: Floats, others: Floats) -> Floats:
    """(V,) weights, of sum 1, that make a place from those of other markers.

    Parameters
    ----------
    place : (3,) [m]; others : (V, 3) [m], V >= 1.
    """
    centre = others.mean(axis=0)
    away = others - centre
    square = away.T @ away
    size = float(np.trace(square))
    even = np.full(len(others), 1.0 / len(others))
    if not size > 0.0:
        return even
    square[np.diag_indices(3)] += REGULARIZATION * size
    return np.asarray(even + away @ np.linalg.solve(square, place - centre))


def _stretches(tracks: Tracks, gap: Gap) -> list[tuple[int, int, Ints]]:
    """First frame, frame behind the last, and markers seen in and just before these."""
    seen = tracks.seen[gap.start - 1 : gap.stop].copy()
    seen[:, gap.column] = False
    still = np.logical_and.accumulate(seen, axis=0)[1:]
    if not still[-1].any():
        raise Refused("no other marker is seen throughout")
    changes = 1 + np.flatnonzero((still[1:] != still[:-1]).any(axis=1))
    edges = [0, *changes.tolist(), gap.frames]
    return [
        (gap.start + first, gap.start + stop, np.flatnonzero(still[first]))
        for first, stop in pairwise(edges)
    ]
