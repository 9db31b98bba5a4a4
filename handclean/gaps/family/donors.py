"""Which markers tell of a hidden one, and in which frames that can be learnt.

A marker that is seen in all of a gap and at the ends it has is a *donor*. Frames to
learn from are those in which the hidden marker and all donors are seen; a donor that
is itself often missing would leave few of them. So donors are taken one by one, those
most often seen together with the hidden marker first, as long as half of the frames in
which that is seen are left. (Gloersen and Federolf 2016 leave out, likewise, the
markers whose own gaps would cost frames.) Where nothing else is missing all markers
are donors, and all frames outside the gap are learnt from.

Frames in which the same markers are seen are counted once per take, so that asking
costs the same in long and short takes.
"""

from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Refused, Tracks

LEAST_SHARE = 0.5
"""Of the frames of a hidden marker, how many its donors must leave (chosen)."""

LEAST_MARKERS = 3
"""Donors that a body's rotation needs."""

LEAST_FRAMES = 30
"""Frames that a rule is learnt from, at the least (chosen)."""

MOST_FRAMES = 8192
"""Frames that a rule is learnt from, at the most, spread evenly: more change nothing
and cost time (chosen)."""

LEAST_WIDTH_M = 2e-3
"""[m] how far donors should reach from their common line (chosen)."""


class Group(NamedTuple):
    """Donors (V,), and the frames (N,) in which they and the hidden one are seen."""

    markers: Ints
    frames: Ints


class Donors:
    """Finds donors in one take."""

    def __init__(self, tracks: Tracks) -> None:
        self._tracks = tracks
        packed = np.packbits(tracks.seen, axis=1)
        _, first, kind, counts = np.unique(
            packed, axis=0, return_index=True, return_inverse=True, return_counts=True
        )
        self._kinds: Bools = tracks.seen[first]
        self._kind_of: Ints = kind.reshape(-1)
        self._counts: Ints = counts

    def seen_through(self, gap: Gap) -> Bools:
        """(M,) which other markers are seen in all of a gap and at its ends.

        Raises
        ------
        Refused
            If there are fewer than a body's rotation needs.
        """
        through = self._tracks.seen_through(gap)
        through[gap.column] = False
        if not through.any():
            raise Refused("no other marker is seen throughout")
        if through.sum() < LEAST_MARKERS:
            raise Refused("fewer than three other markers are seen throughout")
        return through

    def group(self, hidden: int, through: Bools) -> Group:
        """Choose donors of a marker among others, and the frames to learn from.

        Raises
        ------
        Refused
            If too few frames show the marker and donors enough.
        """
        shown = self._kinds[:, hidden]
        together = self._counts @ (self._kinds & shown[:, None])
        least = max(LEAST_SHARE * together[hidden], LEAST_FRAMES)
        if together[hidden] < LEAST_FRAMES:
            raise Refused(f"it is seen in fewer than {LEAST_FRAMES} frames")
        order = np.argsort(-together, kind="stable")
        taken: list[int] = []
        for marker in order[through[order]].tolist():
            left = shown & self._kinds[:, marker]
            if self._counts @ left >= least:
                taken.append(marker)
                shown = left
        if len(taken) < LEAST_MARKERS:
            raise Refused("too few frames show it and three other markers together")
        frames = np.flatnonzero(shown[self._kind_of])
        return Group(markers=np.sort(taken), frames=frames)


def expect_width(reference: Floats) -> None:
    """Refuse donors (V, 3) [m] on one line, which leave the body's rotation open."""
    widths = np.linalg.svd(reference - reference.mean(axis=0), compute_uv=False)
    if widths[1] < LEAST_WIDTH_M:
        raise Refused("the other markers that are seen lie on one line")


def spread_evenly(frames: Ints, most: int = MOST_FRAMES) -> Ints:
    """Take at most so many frames, evenly spread."""
    if len(frames) <= most:
        return frames
    return np.asarray(frames[np.linspace(0, len(frames) - 1, most).astype(int)])
