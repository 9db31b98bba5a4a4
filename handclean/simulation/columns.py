"""Tracks in raw columns, as a capture system writes what it could not name.

Every unbroken track fills one column for a while. A marker that reappears does so in
another column; columns are reused after a pause. Their order says nothing.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Ints, Ints32
from handclean.simulation.ghosts import Ghost

_PAUSE_FRAMES = 8
"""Frames that a column stays empty before another track may use it (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Which column holds what.

    Attributes
    ----------
    marker : (T, M) column of each marker's sample, -1 where there is none.
    ghost : one column per ghost.
    count : number of columns.
    """

    marker: Ints32
    ghost: Ints
    count: int


def assign_columns(
    tracks: Ints,
    ghosts: list[Ghost],
    frames: int,
    markers: int,
    rng: np.random.Generator,
) -> Columns:
    """Put tracks and ghosts into columns.

    Parameters
    ----------
    tracks : (N, 3) marker, first frame, frame after the last.
    """
    spans = [(int(a), int(b)) for _, a, b in tracks]
    spans += [(ghost.start, ghost.start + len(ghost.points)) for ghost in ghosts]
    heirs = {len(tracks) + g: _before(tracks, ghost) for g, ghost in enumerate(ghosts)}
    order = sorted(range(len(spans)), key=lambda n: (spans[n][0], rng.random()))
    column = np.full(len(spans), -1, dtype=np.int64)
    free_from: list[int] = []
    last: list[int] = []
    for n in order:
        start, stop = spans[n]
        heir = heirs.get(n, -1)
        inherited = heir >= 0 and last[column[heir]] == heir
        if inherited:
            chosen = int(column[heir])
        else:
            open_ones = [k for k, when in enumerate(free_from) if when <= start]
            if open_ones:
                chosen = open_ones[rng.integers(len(open_ones))]
            else:
                chosen = len(free_from)
                free_from.append(0)
                last.append(-1)
        column[n] = chosen
        free_from[chosen], last[chosen] = stop + _PAUSE_FRAMES, n
    shuffled = rng.permutation(len(free_from))
    column = shuffled[column] if len(column) else column
    table = np.full((frames, markers), -1, dtype=np.int32)
    for n, (m, a, b) in enumerate(tracks):
        table[a:b, m] = column[n]
    return Columns(marker=table, ghost=column[len(tracks) :], count=len(free_from))


def _before(tracks: Ints, ghost: Ghost) -> int:
    """The track a ghost takes over from, or -1."""
    if not ghost.continues:
        return -1
    fits = (tracks[:, 0] == ghost.beside) & (tracks[:, 2] == ghost.start)
    found = np.flatnonzero(fits)
    return int(found[0]) if len(found) else -1
