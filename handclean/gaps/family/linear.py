"""A marker goes straight and evenly from one end of a gap to the other.

Its doubt grows with the time to the nearer end, as it does for a marker of constant but
unknown velocity.
"""

from handclean.gaps.family.ends import (
    away,
    expect_both_ends,
    shares,
    speed_beside,
    with_floor,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Tracks


def prepare(tracks: Tracks) -> Fill:
    """Fill along a straight line at constant speed."""

    def fill(gap: Gap) -> Path:
        expect_both_ends(tracks, gap)
        column = tracks.positions[:, gap.column]
        first, last = column[gap.start - 1], column[gap.stop]
        share = shares(gap)
        places = (1.0 - share) * first + share * last
        spread = speed_beside(tracks, gap) * away(tracks, gap)
        return Path(places, with_floor(spread))

    return fill
