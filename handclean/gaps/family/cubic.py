"""A marker on the path of least acceleration, with end velocities from a fit.

See `gaps.min_acceleration`: the cubic that has the places of both ends and velocities
that a parabola through the nearest measured frames gives.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.family.ends import (
    RECENT_S,
    away,
    expect_both_ends,
    speed_beside,
    with_floor,
)
from handclean.gaps.min_acceleration import EndFit, bridge
from handclean.gaps.runs import Cluster, Gap
from handclean.gaps.tracks import Fill, Path, Tracks

END_FRAMES = 5
"""[frames] a parabola is fitted to, on each side."""


def prepare(tracks: Tracks) -> Fill:
    """Fill with the path of least acceleration of the marker itself."""

    def fill(gap: Gap) -> Path:
        expect_both_ends(tracks, gap)
        (found,) = bridge(
            tracks.positions[:, gap.column],
            tracks.seen[:, gap.column],
            Cluster(gaps=(gap,)),
            EndFit(order=2, frames=END_FRAMES),
            2 * END_FRAMES,
        )
        return Path(found.path, smooth_spread(tracks, gap))

    return fill


def smooth_spread(tracks: Tracks, gap: Gap) -> Floats:
    """(N,) [m] doubt of a path that has the velocities of both ends.

    An integrated random walk of velocity errs as (s (1 - s))^(3/2) along a gap.
    """
    share = np.sqrt(away(tracks, gap) / RECENT_S)
    return with_floor(speed_beside(tracks, gap) * away(tracks, gap) * share)
