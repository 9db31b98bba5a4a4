"""Pseudo-gaps: stretches of a take in which nothing is missing, hidden for trial.

They are like the take's own gaps: as long, of the same marker, with the same other
markers hidden, open at the same side. What a filler makes of them, compared with what
was measured there, tells how far off it is in this take.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Path, Prepare, Refused, Tracks

LENGTHS_S = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)
"""[s] gaps count as of the nearest of these lengths, by ratio."""

PER_KIND, FEWEST = 24, 8
"""Pseudo-gaps of a kind, at most and at least; between, as many as gaps (chosen)."""

HIDDEN_SHARE = 0.5
"""A marker missing in more of a gap than this is hidden in its pseudo-gaps."""

GOLDEN = (5.0**0.5 - 1.0) / 2.0
"""Steps of this share of a whole spread evenly, however many there are."""

SEEN_SHARES, FEWEST_SEEN = (0.3, 0.1), 5
"""Share of a pseudo-gap in which its marker is seen, at least, if no stretch shows it
throughout; and how many frames (chosen)."""

NEAR_S = 0.5
"""[s] what is measured so far beyond a missing end is hidden, too, in a pseudo-gap of a
gap that has one end only."""


@dataclass(frozen=True, order=True)
class Kind:
    """Gaps that are judged together.

    Attributes
    ----------
    length_s : [s] one of `LENGTHS_S`.
    ends : how many ends are measured, 1 or 2.
    """

    length_s: float
    ends: int


@dataclass(frozen=True, kw_only=True)
class PseudoGap:
    """A stretch to fill, and what else is hidden in it.

    Attributes
    ----------
    gap : its marker and frames.
    hidden : (M,) markers hidden in all of it; that of the gap among them.
    start, stop : frames in which its own marker is hidden; beyond the gap where a side
        is to have no end.
    """

    gap: Gap
    hidden: Bools
    start: int
    stop: int


def kind_of(tracks: Tracks, gap: Gap) -> Kind:
    """Return the kind of a gap."""
    length = np.log(gap.frames / tracks.rate)
    nearest = int(np.argmin(np.abs(np.log(LENGTHS_S) - length)))
    ends = int(tracks.has_start(gap)) + int(tracks.has_end(gap))
    return Kind(LENGTHS_S[nearest], max(ends, 1))


def hidden_with(tracks: Tracks, gap: Gap) -> Bools:
    """(M,) markers that are missing in most of a gap, that of the gap among them."""
    missing = ~tracks.seen[gap.start : gap.stop]
    hidden = np.asarray(missing.mean(axis=0) > HIDDEN_SHARE)
    hidden[gap.column] = True
    return hidden


def draw(
    tracks: Tracks, gaps: Sequence[Gap], per_kind: int = PER_KIND
) -> dict[Kind, list[PseudoGap]]:
    """Draw pseudo-gaps for every kind of gap there is, spread over gaps and take.

    Nothing is random: places are steps of the golden ratio through all there are.

    Parameters
    ----------
    gaps : the take's own; each pseudo-gap is like one of them.

    Returns
    -------
    up to ``per_kind`` for each kind, in order of time; fewer, or none, where a marker
    is hardly seen in any stretch of a gap's length.
    """
    of_kind: dict[Kind, list[Gap]] = {}
    for gap in gaps:
        of_kind.setdefault(kind_of(tracks, gap), []).append(gap)
    starts = _Starts(tracks.seen)
    found: dict[Kind, list[PseudoGap]] = {}
    for kind in sorted(of_kind):
        own = of_kind[kind]
        kept = {}
        count = min(max(len(own), FEWEST), per_kind)
        for i in range(count):
            gap = own[i * len(own) // count]
            one = _like(tracks, gap, starts, (i + 0.5) * GOLDEN % 1.0)
            if one is not None:
                kept[gap.column, one.gap.start, one.gap.stop] = one
        found[kind] = sorted(kept.values(), key=lambda p: (p.gap.start, p.gap.column))
    return found


class _Starts:
    """Finds where a marker is seen before, behind and, all or some of it, within."""

    def __init__(self, seen: Bools) -> None:
        self._seen = seen
        self._count: dict[int, Ints] = {}

    def of(self, column: int, frames: int, least: int) -> Ints:
        """(N,) first rows of stretches of ``frames`` rows with measured ends.

        Parameters
        ----------
        least : rows within in which the marker is seen, at least.
        """
        if column not in self._count:
            seen = np.concatenate([[0], np.cumsum(self._seen[:, column])])
            self._count[column] = seen
        count, seen = self._count[column], self._seen[:, column]
        if frames + 2 > len(seen):
            return np.zeros(0, dtype=np.int64)
        ends = seen[: -frames - 1] & seen[frames + 1 :]
        within = count[frames + 1 : -1] - count[1 : -frames - 1]
        return np.flatnonzero(ends & (within >= least)) + 1


def _like(tracks: Tracks, gap: Gap, starts: _Starts, where: float) -> PseudoGap | None:
    """Place a pseudo-gap like a gap, ``where`` of all places; None if there is none.

    Where its marker is never seen for so long in a row, it is where the marker is seen
    for a part of it.
    """
    for share in (1.0, *SEEN_SHARES):
        least = max(min(FEWEST_SEEN, gap.frames), int(share * gap.frames))
        places = starts.of(gap.column, gap.frames, least)
        if len(places):
            break
    else:
        return None
    start = int(places[int(where * len(places))])
    stop = start + gap.frames
    near = round(NEAR_S * tracks.rate)
    first = start if tracks.has_start(gap) else max(start - near, 0)
    last = stop if tracks.has_end(gap) else min(stop + near, len(tracks.seen))
    return PseudoGap(
        gap=Gap(column=gap.column, start=start, stop=stop),
        hidden=hidden_with(tracks, gap),
        start=first,
        stop=last,
    )


def punched(tracks: Tracks, pseudo: Sequence[PseudoGap]) -> Tracks:
    """Return a take in which pseudo-gaps are missing, too."""
    positions = tracks.positions.copy()
    for one in pseudo:
        positions[one.start : one.stop, one.gap.column] = np.nan
        positions[one.gap.start : one.gap.stop, one.hidden] = np.nan
    return Tracks(positions=positions, rate=tracks.rate, bones=tracks.bones)


def filled(
    prepare: Prepare, tracks: Tracks, pseudo: Sequence[PseudoGap]
) -> list[Path | None]:
    """Fill pseudo-gaps; None where the filler refuses.

    As many are hidden at once as leave each other alone; the filler is prepared anew
    for each such round.
    """
    paths: list[Path | None] = [None] * len(pseudo)
    for part in rounds(pseudo, tracks.rate):
        try:
            fill = prepare(punched(tracks, [pseudo[i] for i in part]))
        except Refused:
            continue
        for i in part:
            try:
                paths[i] = fill(pseudo[i].gap)
            except Refused:
                continue
    return paths


def rounds(pseudo: Sequence[PseudoGap], rate: float) -> list[list[int]]:
    """Part pseudo-gaps, in order of time, so that those of a part do not meet.

    Between two of a part there are as many frames as the longer has, at least half a
    second.
    """
    parts: list[list[int]] = []
    ends: list[int] = []
    for i, one in enumerate(pseudo):
        room = max(one.stop - one.start, round(NEAR_S * rate))
        for part, end in enumerate(ends):
            if one.start - room >= end:
                parts[part].append(i)
                ends[part] = one.stop
                break
        else:
            parts.append([i])
            ends.append(one.stop)
    return parts


def errors(tracks: Tracks, one: PseudoGap, path: Path) -> Floats:
    """(N, 3) [m] a path minus what was measured; NaN where nothing was."""
    return np.asarray(
        path.places - tracks.positions[one.gap.start : one.gap.stop, one.gap.column]
    )


Trials = Mapping[Kind, list[PseudoGap]]
