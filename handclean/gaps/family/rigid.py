"""A marker moves with three or more others of its rigid body (rigid body fill).

Their motion from an end of the gap to each frame of it takes the marker along, once
from either end; from one to the other end the two paths blend.
"""

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.gaps.body import motion_onto
from handclean.gaps.family.donors import LEAST_MARKERS, expect_width
from handclean.gaps.family.ends import away, expect_an_end, shares, with_floor
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Refused, Tracks

LOOSENESS_M_S = 1e-3
"""[m/s] how fast a marker of a rigid body leaves its place, for want of a measurement
(chosen)."""


def prepare(tracks: Tracks) -> Fill:
    """Fill with the rigid movement of other markers of the same body."""

    def fill(gap: Gap) -> Path:
        expect_an_end(tracks, gap)
        donors = _donors(tracks, gap)
        paths = [
            _carried(tracks, gap, donors, end)
            for end, known in (
                (gap.start - 1, tracks.has_start(gap)),
                (gap.stop, tracks.has_end(gap)),
            )
            if known
        ]
        share = shares(gap) if len(paths) == 2 else 0.0
        places = (1.0 - share) * paths[0] + share * paths[-1]
        return Path(places, with_floor(LOOSENESS_M_S * away(tracks, gap)))

    return fill


def _donors(tracks: Tracks, gap: Gap) -> Ints:
    if tracks.bones[gap.column] < 0:
        raise Refused("which rigid body it belongs to is not known")
    through = tracks.seen_through(gap)
    through[gap.column] = False
    donors = np.flatnonzero(through & (tracks.bones == tracks.bones[gap.column]))
    if len(donors) < LEAST_MARKERS:
        raise Refused("fewer than three other markers of its bone are seen throughout")
    return donors


def _carried(tracks: Tracks, gap: Gap, donors: Ints, end: int) -> Floats:
    """(N, 3) [m] places of the marker, moved with donors from one end."""
    reference = tracks.positions[end, donors]
    expect_width(reference)
    points = tracks.positions[gap.start : gap.stop][:, donors]
    motion = motion_onto(points, reference)
    held = np.tile(tracks.positions[end, gap.column], (gap.frames, 1))
    return motion.to_laboratory(held)
