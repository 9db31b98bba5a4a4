"""Gaps cut into a take where nothing is missing, to judge fillers by.

The protocol is that of Pavllo et al. 2019 (section 6.2.1): one to four markers hidden
at once for 0.1 to 2 s, and, where a take's limbs are known, all markers of a limb (a
finger). To these come gaps like the take's own (`pseudo.draw`). Several are cut at
once, in a *round*, disjoint in time, so that a filler looks at a take with gaps.

Nothing is random. Which markers and which part of the take the i-th gap of a cell gets
are steps of irrational length through all there are (a Kronecker sequence), which
spread evenly however many are taken.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from handclean.arrays import Bools, Ints
from handclean.gaps import pseudo
from handclean.gaps.fill_tracks import gaps_of_take
from handclean.gaps.pseudo import PseudoGap
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Tracks

LENGTHS_S = (0.1, 0.2, 0.5, 1.0, 2.0)
"""[s] lengths of Pavllo et al. 2019, table 3."""

AT_ONCE = (1, 2, 3, 4)
"""Markers hidden at once: Pavllo et al. 2019, table 3."""

FINGER, OWN = "finger", "own"
"""Patterns beside the numbers of `AT_ONCE`."""

PER_CELL = 24
"""Gaps of one length and pattern, at most (chosen)."""

MOST_ROUNDS = 12
"""Rounds, at most (chosen): they bound the time that judging takes."""

MOST_HIDDEN = 0.2
"""Share of a take's frames in which something is cut in one round, at most (chosen)."""

LEAST_SEEN = 0.2
"""A marker seen in less of the take than this share is not hidden (chosen)."""

ROOM_S = 0.5
"""[s] between two gaps of a round, at least (chosen)."""

_STEPS = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0]) % 1.0
"""Of the Kronecker sequence: one for each marker, the last for time."""


@dataclass(frozen=True, kw_only=True)
class Cut:
    """Markers hidden together for a while.

    Attributes
    ----------
    pattern : "1" to "4", "finger" or "own".
    length_s : [s] its column of tables.
    parts : what fillers are asked, one for each marker that is judged.
    """

    pattern: str
    length_s: float
    parts: tuple[PseudoGap, ...]

    @property
    def start(self) -> int:
        """First frame in which anything is hidden."""
        return min(one.start for one in self.parts)

    @property
    def stop(self) -> int:
        """First frame behind all that is hidden."""
        return max(one.stop for one in self.parts)

    @property
    def frames(self) -> int:
        """Length of the gaps that are judged."""
        return self.parts[0].gap.frames

    @property
    def columns(self) -> tuple[int, ...]:
        """Markers that are judged."""
        return tuple(one.gap.column for one in self.parts)


def plan_cuts(
    tracks: Tracks,
    limbs: Sequence[Ints] = (),
    *,
    per_cell: int = PER_CELL,
    most_rounds: int = MOST_ROUNDS,
) -> list[list[Cut]]:
    """Plan where a take is cut.

    Parameters
    ----------
    limbs : columns of the markers of each limb; may be empty.
    per_cell : gaps of one length and pattern, at most.
    most_rounds : rounds, at most; where they do not hold all gaps, cells have fewer,
        as even as can be.

    Returns
    -------
    rounds of cuts, in order of time; no round where nothing can be cut.
    """
    calendar = _Calendar(tracks, most_rounds)
    for wish in _wishes(tracks, limbs, per_cell):
        calendar.place(wish)
    return [sorted(part, key=lambda cut: cut.start) for part in calendar.rounds if part]


@dataclass(frozen=True, kw_only=True)
class _Wish:
    """A cut without a place, ``where`` of all places; or with that of ``cut``."""

    pattern: str = ""
    length_s: float = 0.0
    columns: tuple[int, ...] = ()
    where: float = 0.0
    cut: Cut | None = None


def _wishes(tracks: Tracks, limbs: Sequence[Ints], per_cell: int) -> Iterator[_Wish]:
    """Yield the first gap of every cell, then the second of every cell ..."""
    seen = tracks.seen.mean(axis=0) >= LEAST_SEEN
    pool = np.flatnonzero(seen)
    groups = [limb[seen[limb]] for limb in limbs]
    groups = [group for group in groups if len(group) > 1]
    of_pattern: dict[str, list[_Wish]] = {}
    patterns = [str(k) for k in AT_ONCE if k <= len(pool)]
    for number, pattern in enumerate(patterns + [FINGER] * bool(groups)):
        of_pattern[pattern] = [
            _drawn(pattern, groups or [pool], pool, i, 5 * number + place)
            for i in range(per_cell)
            for place in range(len(LENGTHS_S))
        ]
    of_pattern[OWN] = list(_own(tracks, seen, per_cell))
    for wishes in zip_longest(*of_pattern.values()):
        yield from (wish for wish in wishes if wish is not None)


def _drawn(
    pattern: str, groups: Sequence[Ints], pool: Ints, i: int, cell: int
) -> _Wish:
    """Draw the markers and the time of the i-th gap of a cell."""
    share = ((i + 1.0) * _STEPS + 0.5 * cell * pseudo.GOLDEN) % 1.0
    if pattern == FINGER:
        columns = [int(c) for c in groups[int(share[0] * len(groups))]]
    else:
        left = pool.tolist()
        columns = [left.pop(int(s * len(left))) for s in share[: int(pattern)]]
    return _Wish(
        pattern=pattern,
        length_s=LENGTHS_S[cell % len(LENGTHS_S)],
        columns=tuple(sorted(columns)),
        where=float(share[-1]),
    )


def _own(tracks: Tracks, usual: Bools, per_cell: int) -> Iterator[_Wish]:
    """Yield pseudo-gaps like the take's own, of markers that are usually seen."""
    own = [
        gap
        for gap in gaps_of_take(tracks, 0.0)
        if not gap.refused and usual[gap.column]
    ]
    drawn: Mapping[pseudo.Kind, list[PseudoGap]] = pseudo.draw(tracks, own, per_cell)
    for ones in zip_longest(*drawn.values()):
        for kind, one in zip(drawn, ones, strict=True):
            if one is not None:
                cut = Cut(pattern=OWN, length_s=kind.length_s, parts=(one,))
                yield _Wish(cut=cut)


class _Calendar:
    """Which frames of which round are taken."""

    def __init__(self, tracks: Tracks, most_rounds: int) -> None:
        frames = len(tracks.seen)
        self.rounds: list[list[Cut]] = [[] for _ in range(most_rounds)]
        self._tracks = tracks
        self._taken = np.zeros((most_rounds, frames), dtype=bool)
        self._left = np.full(most_rounds, int(MOST_HIDDEN * frames))
        self._room = round(ROOM_S * tracks.rate)

    def place(self, wish: _Wish) -> None:
        """Put a cut into the first round that has room; into none if none has."""
        if wish.cut is not None:
            span = wish.cut.stop - wish.cut.start
            places, frames = np.array([wish.cut.start]), span
        else:
            frames = max(round(wish.length_s * self._tracks.rate), 1)
            places = self._shown(wish.columns, frames)
        for number in range(len(self.rounds)):
            if len(places) == 0 or frames > self._left[number]:
                continue
            free = places[self._free(number, places, frames)]
            if len(free):
                start = int(free[int(wish.where * len(free))])
                self._take(number, wish.cut or self._cut(wish, start, frames))
                return

    def _shown(self, columns: Sequence[int], frames: int) -> Ints:
        """(N,) starts of gaps that markers are seen in and beside."""
        shown = self._tracks.seen[:, columns].all(axis=1)
        count = np.concatenate([[0], np.cumsum(shown)])
        if frames + 2 >= len(count):
            return np.zeros(0, dtype=np.int64)
        whole = count[frames + 2 :] - count[: -frames - 2] == frames + 2
        return np.flatnonzero(whole) + 1

    def _free(self, number: int, places: Ints, frames: int) -> Bools:
        count = np.concatenate([[0], np.cumsum(self._taken[number])])
        return np.asarray(count[places + frames] == count[places])

    def _take(self, number: int, cut: Cut) -> None:
        first = max(cut.start - self._room, 0)
        self._taken[number, first : cut.stop + self._room] = True
        self._left[number] -= cut.stop - cut.start
        self.rounds[number].append(cut)

    def _cut(self, wish: _Wish, start: int, frames: int) -> Cut:
        hidden = np.zeros(self._tracks.seen.shape[1], dtype=bool)
        hidden[list(wish.columns)] = True
        stop = start + frames
        parts = tuple(
            PseudoGap(
                gap=Gap(column=column, start=start, stop=stop),
                hidden=hidden,
                start=start,
                stop=stop,
            )
            for column in wish.columns
        )
        return Cut(pattern=wish.pattern, length_s=wish.length_s, parts=parts)
