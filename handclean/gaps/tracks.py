"""The contract of fillers: what they look at, what they give, how they refuse.

A filler is prepared once for a take and then fills gap by gap ::

    fill = prepare(tracks)
    path = fill(gap)            # or raises Refused

It never changes ``tracks``; measured samples stay as they are, bit for bit, since a
path holds the samples of its gap only. Whoever has a filler of his own writes a
function like ``prepare`` and can judge it beside these (see `gaps.evaluate`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.gaps.runs import Gap, seen_in


class Refused(Exception):
    """A gap that a filler cannot fill, and why."""


@dataclass(frozen=True, kw_only=True)
class Tracks:
    """Marker trajectories of a take, with gaps.

    Attributes
    ----------
    positions : (T, M, 3) [m] measured samples, NaN elsewhere.
    rate : [Hz]
    bones : (M,) number of the rigid body that a marker sits on; -1 where it is not
        known. Nothing but "the same" is meant by it.
    seen : (T, M) which samples are measured.
    """

    positions: Floats
    rate: float
    bones: Ints
    seen: Bools = field(init=False, repr=False)

    def __post_init__(self) -> None:
        expect_shape("positions", self.positions, "T", "M", 3)
        expect_shape("bones", self.bones, self.positions.shape[1])
        object.__setattr__(self, "seen", seen_in(self.positions))

    def has_start(self, gap: Gap) -> bool:
        """Whether a sample is measured just before a gap."""
        return gap.start > 0 and bool(self.seen[gap.start - 1, gap.column])

    def has_end(self, gap: Gap) -> bool:
        """Whether a sample is measured just after a gap."""
        stop = gap.stop
        return stop < len(self.seen) and bool(self.seen[stop, gap.column])

    def seen_through(self, gap: Gap) -> Bools:
        """(M,) which markers are seen in all of a gap and at the ends it has."""
        first = max(gap.start - 1, 0)
        return np.asarray(self.seen[first : gap.stop + 1].all(axis=0))


class Path(NamedTuple):
    """What a filler gives for a gap of N frames.

    places (N, 3) [m]; spread (N,) [m] how far off to expect each axis, up to a factor
    that pseudo-gaps of the take tell (`gaps.doubt`).
    """

    places: Floats
    spread: Floats


Fill = Callable[[Gap], Path]
"""Fills one gap of the take it was prepared for; raises `Refused`."""

Prepare = Callable[[Tracks], Fill]
"""Learns what it needs from a take; raises `Refused` if it can fill no gap of it."""
