"""A marker stays where it was last seen (Pavllo 2019 section 3.2.1, last known)."""

import numpy as np

from handclean.gaps.family.ends import (
    away_since,
    expect_start,
    speed_before,
    with_floor,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Tracks


def prepare(tracks: Tracks) -> Fill:
    """Fill with the last known place; reads nothing after a gap's start."""

    def fill(gap: Gap) -> Path:
        expect_start(tracks, gap)
        held = tracks.positions[gap.start - 1, gap.column]
        spread = speed_before(tracks, gap) * away_since(tracks, gap)
        return Path(np.tile(held, (gap.frames, 1)), with_floor(spread))

    return fill
