"""A marker goes on as it went of late (Pavllo 2019 section 3.2.1, moving average).

The velocity is the mean of those of the last third of a second: the paper's 20 frames
at its 60 Hz, the time kept instead of the number.
"""

import numpy as np

from handclean.gaps.family.ends import (
    away_since,
    expect_start,
    steps_before,
    with_floor,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Refused, Tracks


def prepare(tracks: Tracks) -> Fill:
    """Fill along the mean velocity; reads nothing after a gap's start."""

    def fill(gap: Gap) -> Path:
        expect_start(tracks, gap)
        steps = steps_before(tracks, gap)
        if len(steps) == 0:
            raise Refused("no velocity is known in the third of a second before it")
        last = tracks.positions[gap.start - 1, gap.column]
        step = steps.mean(axis=0)
        places = last + np.arange(1, gap.frames + 1)[:, None] * step
        rough = np.sqrt(np.mean((steps - step) ** 2) + np.mean(step**2))
        spread = rough * tracks.rate * away_since(tracks, gap)
        return Path(places, with_floor(spread))

    return fill
