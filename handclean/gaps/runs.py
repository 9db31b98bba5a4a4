"""Where something is not known, for how long, and whether that can be bridged.

A gap is bridged from both sides, so each side should hold at least ``seed`` known
frames among the ``2 * seed`` next to the gap. Where it does not, the gap and its
neighbour become one *cluster*, bridged at once with the few frames between them as
support. A cluster longer than the limit, or one that reaches the start or end of the
take, stays open, and every gap of it says why. (Vicon Nexus refuses likewise: fewer
than five consecutive frames beside a gap, or a donor that is missing at its ends.)
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape

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
    longest : [frames] longest gap, or cluster of gaps, to bridge.
    seed : known frames needed on each side, among twice as many.
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


def runs(mask: Bools) -> list[tuple[int, int]]:
    """Stretches of true values as (start, stop) pairs."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def clusters_of(known: Bools, limits: Limits, column: int = 0) -> list[Cluster]:
    """Find and judge the gaps of one thing that is known in some frames of a take.

    Parameters
    ----------
    known : (T,)
    """
    expect_shape("known", known, "T")
    found = runs(~known)
    if not found:
        return []
    count = np.concatenate([[0], np.cumsum(known)])
    clusters: list[list[tuple[int, int]]] = []
    for gap in found:
        if clusters and not _anchored(count, clusters[-1][-1][1], gap[0], limits):
            clusters[-1].append(gap)
        else:
            clusters.append([gap])
    return [_judged(part, count, limits, column) for part in clusters]


def gaps_of(known: Bools, limits: Limits) -> list[Gap]:
    """Find and judge the gaps of all columns of (T, C); by column, then by time."""
    return [
        gap
        for column in range(known.shape[1])
        for cluster in clusters_of(known[:, column], limits, column)
        for gap in cluster.gaps
    ]


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


def _judged(
    part: list[tuple[int, int]], count: Ints, limits: Limits, column: int
) -> Cluster:
    start, stop, frames = part[0][0], part[-1][1], len(count) - 1
    least = min(_before(count, start, limits), _after(count, stop, limits))
    fine = (
        start > 0
        and stop < frames
        and stop - start <= limits.longest
        and least >= limits.seed
    )
    reasons = ["" if fine else _reason(a, b, frames, limits) for a, b in part]
    return Cluster(
        gaps=tuple(
            Gap(column=column, start=a, stop=b, refused=why)
            for (a, b), why in zip(part, reasons, strict=True)
        )
    )


def _reason(start: int, stop: int, frames: int, limits: Limits) -> str:
    """Why a gap of a cluster that cannot be bridged stays open."""
    if start == 0 and stop == frames:
        return THROUGHOUT
    if start == 0:
        return AT_START
    if stop == frames:
        return AT_END
    if stop - start > limits.longest:
        return f"{TOO_LONG} {limits.longest / limits.rate:.3g} s"
    seed = limits.seed
    return f"{NO_SEED}: {seed} of the {2 * seed} frames on each side should be known"
