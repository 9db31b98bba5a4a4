"""A marker moves as its nearest neighbour does (pattern fill of Vicon Nexus).

With the places g0, g1 of the marker and d0, d1 of the donor at both ends, and s from 0
to 1 between them, the marker is at d(s) + (1 - s) (g0 - d0) + s (g1 - d1). A donor of
the same rigid body is preferred, the nearest of several.
"""

import numpy as np

from handclean.gaps.family.ends import (
    away,
    expect_an_end,
    frames_of,
    onto_ends,
    root_mean_square,
    with_floor,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Refused, Tracks


def prepare(tracks: Tracks) -> Fill:
    """Fill with the movement of one other marker that is seen throughout."""

    def fill(gap: Gap) -> Path:
        expect_an_end(tracks, gap)
        donor = tracks.positions[frames_of(tracks, gap), _donor(tracks, gap)]
        speed = root_mean_square(np.diff(donor, axis=0)) * tracks.rate
        spread = with_floor(speed * away(tracks, gap))
        return Path(onto_ends(tracks, gap, donor), spread)

    return fill


def _donor(tracks: Tracks, gap: Gap) -> int:
    """Choose the marker to follow: of the same body if any is, then the nearest."""
    through = tracks.seen_through(gap)
    through[gap.column] = False
    donors = np.flatnonzero(through)
    if len(donors) == 0:
        raise Refused("no other marker is seen throughout")
    ends = frames_of(tracks, gap)[[0, -1]]
    there = tracks.positions[ends[tracks.seen[ends, gap.column]]]
    apart = np.linalg.norm(there - there[:, [gap.column]], axis=2).mean(axis=0)
    body = tracks.bones[gap.column]
    other = (tracks.bones[donors] != body) | (body < 0)
    return int(donors[np.lexsort([apart[donors], other])[0]])
