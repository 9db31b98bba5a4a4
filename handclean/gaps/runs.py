"""Where something is not known, for how long, and whether that can be bridged.

Each gap is judged by itself: one longer than the limit, or one that reaches the start
or end of the take, stays open, whatever is beside it. Any other is bridged from both
sides, so each side should hold at least ``seed`` known frames among the ``2 * seed``
next to the gap, or as many as the gap has frames, if these are fewer: the velocity at
an end matters less, the shorter the gap. Where two such gaps leave too few between
them, they become one *cluster*, bridged at once with these few frames as support. What
lies before the first gap of a cluster and behind the last should be enough for all of
them; a gap at its end without that is judged alone, and the others without it. (Vicon
Nexus refuses fewer than five consecutive frames beside a gap, or a donor that is
missing at its ends.)
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape, runs

THROUGHOUT = "missing in all of the take"
AT_START = "reaches the start of the take"
AT_END = "reaches the end of the take"
TOO_LONG = "longer than max_gap_s ="
NO_SEED = "too little known beside it"


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What may be bridged.

    Attributes
    ----------
    longest : [frames] longest gap to bridge.
    seed : known frames needed on each side, among twice as many, or as many as the gap
        has.
    rate : [Hz] for the words.
    """

    longest: int
    seed: int
    rate: float


@dataclass(frozen=True, kw_only=True)
class Gap:
    """Frames ``start`` to ``stop`` (exclusive) in which one thing is not known.

    Attributes
    ----------
    column : which marker or hinge.
    refused : why it stays open; "" if it can be bridged.
    """

    column: int
    start: int
    stop: int
    refused: str = ""

    @property
    def frames(self) -> int:
        """Length of the gap."""
        return self.stop - self.start


@dataclass(frozen=True, kw_only=True)
class Cluster:
    """Gaps of one column that are bridged at once, in order of time."""

    gaps: tuple[Gap, ...]

    @property
    def start(self) -> int:
        """First unknown frame."""
        return self.gaps[0].start

    @property
    def stop(self) -> int:
        """First known frame after the last gap."""
        return self.gaps[-1].stop

    @property
    def refused(self) -> bool:
        """Whether it stays open."""
        return bool(self.gaps[0].refused)


def seen_in(positions: Floats) -> Bools:
    """(T, M) which samples of (T, M, 3) positions are there."""
    return np.asarray(np.isfinite(positions).all(axis=2))


def clusters_of(known: Bools, limits: Limits, column: int = 0) -> list[Cluster]:
    """Find and judge the gaps of one thing that is known in some frames of a take.

    Parameters
    ----------
    known : (T,)
    """
    expect_shape("known", known, "T")
    count = np.concatenate([[0], np.cumsum(known)])
    clusters: list[Cluster] = []
    part: list[Gap] = []
    for start, stop in runs(~known):
        gap = Gap(column=column, start=start, stop=stop)
        if why := _alone(gap, len(known), limits):
            refused = Cluster(gaps=(replace(gap, refused=why),))
            clusters += [*_judged(part, count, limits), refused]
            part = []
            continue
        if part and _anchored(count, part[-1].stop, start, limits):
            clusters += _judged(part, count, limits)
            part = []
        part.append(gap)
    return [*clusters, *_judged(part, count, limits)]


def gaps_of(known: Bools, limits: Limits) -> list[Gap]:
    """Find and judge the gaps of all columns of (T, C); by column, then by time."""
    return [
        gap
        for column in range(known.shape[1])
        for cluster in clusters_of(known[:, column], limits, column)
        for gap in cluster.gaps
    ]


def _alone(gap: Gap, frames: int, limits: Limits) -> str:
    """Why a gap stays open whatever is beside it; "" if nothing says so."""
    if gap.start == 0:
        return THROUGHOUT if gap.stop == frames else AT_START
    if gap.stop == frames:
        return AT_END
    if gap.frames > limits.longest:
        return f"{TOO_LONG} {limits.longest / limits.rate:.3g} s"
    return ""


def _before(count: Ints, start: int, limits: Limits) -> int:
    """Known frames among those just before a gap."""
    return int(count[start] - count[max(start - 2 * limits.seed, 0)])


def _after(count: Ints, stop: int, limits: Limits) -> int:
    """Known frames among those just after a gap."""
    return int(count[min(stop + 2 * limits.seed, len(count) - 1)] - count[stop])


def _anchored(count: Ints, stop: int, start: int, limits: Limits) -> bool:
    """Whether the frames between two gaps, ``stop`` to ``start``, support both."""
    least = min(_after(count, stop, limits), _before(count, start, limits))
    return least >= limits.seed


def _judged(part: list[Gap], count: Ints, limits: Limits) -> list[Cluster]:
    """Make a cluster of gaps; those at its ends that cannot be part of it go alone."""
    left: list[Cluster] = []
    right: list[Cluster] = []
    while part:
        needed = min(limits.seed, sum(gap.frames for gap in part))
        held = _before(count, part[0].start, limits) >= needed
        holds = _after(count, part[-1].stop, limits) >= needed
        if held and holds:
            return [*left, Cluster(gaps=tuple(part)), *right]
        if not held:
            left.append(_single(part[0], count, limits))
            part = part[1:]
        if not holds and part:
            right.insert(0, _single(part[-1], count, limits))
            part = part[:-1]
    return [*left, *right]


def _single(gap: Gap, count: Ints, limits: Limits) -> Cluster:
    """Make a cluster of one gap, refused if too little is known beside it."""
    needed = min(limits.seed, gap.frames)
    least = min(_before(count, gap.start, limits), _after(count, gap.stop, limits))
    why = f"{NO_SEED}: {needed} of the {2 * limits.seed} frames on each side should be"
    return Cluster(
        gaps=(gap if least >= needed else replace(gap, refused=f"{why} known"),)
    )
