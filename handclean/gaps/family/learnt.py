"""Fillers that learn from a take: once for a hidden marker and the markers that tell.

What is learnt is kept and used for every gap of the marker with the same others in
sight. Its path is led onto the measured samples at the ends of the gap.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Protocol

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.gaps.family.donors import Donors, Group
from handclean.gaps.family.ends import away, expect_an_end, onto_ends, with_floor
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Tracks

LESSONS_KEPT = 1024
"""How many are kept to be used again (chosen; some 10 kB each)."""

SETTLED_S = 0.1
"""[s] from an end until the error is that of what was learnt (chosen)."""


class Lesson(Protocol):
    """What was learnt of one hidden marker."""

    @property
    def residual(self) -> float:
        """[m] root mean square error per axis where it was learnt."""

    def path(self, gap: Gap) -> Floats:
        """(N, 3) [m] places in a gap and at the ends it has, see `ends.frames_of`."""


Learn = Callable[[int, Group], Lesson]
"""Learns of a hidden marker from its group; raises `Refused`."""


def prepare_learnt(tracks: Tracks, learn: Learn) -> Fill:
    """Return a filler that follows what was learnt."""
    donors = Donors(tracks)

    @lru_cache(maxsize=LESSONS_KEPT)
    def lesson(hidden: int, through: bytes) -> Lesson:
        others: Bools = np.frombuffer(through, dtype=bool)
        return learn(hidden, donors.group(hidden, others))

    def fill(gap: Gap) -> Path:
        expect_an_end(tracks, gap)
        through = donors.seen_through(gap)
        learnt = lesson(gap.column, through.tobytes())
        settled = 1.0 - np.exp(-away(tracks, gap) / SETTLED_S)
        spread = with_floor(learnt.residual * np.sqrt(settled))
        return Path(onto_ends(tracks, gap, learnt.path(gap)), spread)

    return fill
