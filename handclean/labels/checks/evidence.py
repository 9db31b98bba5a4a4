"""Is what was followed this hand at all? It shows most of its markers at some time.

Few points fit a hand wherever they are: each finger has four joints to turn until a
marker or two meet a point. What points of other things do not do is to be most of a
set's markers at once, and to go on being so. So every stretch of frames through which
a model was followed must show, at some time, `GOOD` of the set in a frame, as a search
that ended well does, or `MOST` of it through `LONG` frames. A stretch that never does
is given up: its points have no names.

Measured with a set of 13 on takes without a hand: 4 to 7 markers at once in gait,
dance, standing points and noise, 8 in a few frames; takes in which half of a hand's
markers are hidden show 12 or 13 before.
"""

import numpy as np

from handclean.arrays import Bools, Ints
from handclean.labels.track.tracker import ABSENT, Trace

GOOD = 0.9
"""Share of a set's markers that tells a hand in one frame."""

MOST, LONG = 0.6, 10
"""Share of them that does in so many frames on end."""


def unproven(count: Ints, known: Bools, markers: int, patience: int) -> Bools:
    """(T,) frames of stretches that never show the hand, see above.

    Parameters
    ----------
    count : (T,) markers in each frame; known : (T,) whether it was followed.
    markers : of the set.
    patience : frames without the model that do not end a stretch.
    """
    out = np.zeros(len(known), dtype=bool)
    frames = np.flatnonzero(known)
    if len(frames) == 0:
        return out
    for rows in np.split(frames, np.flatnonzero(np.diff(frames) > patience + 1) + 1):
        here = count[rows]
        most = here >= MOST * markers
        long = min(LONG, len(rows))
        longest = np.convolve(most, np.ones(long), "valid").max()
        if here.max() < GOOD * markers and longest < LONG:
            out[rows] = True
    return out


def give_up(trace: Trace, patience: int) -> int:
    """Forget what was followed without having been proven, in place.

    Returns
    -------
    Most markers that such a frame showed, 0 if there is none.
    """
    count = (trace.chosen >= 0).sum(axis=1)
    rows = unproven(count, trace.known, trace.chosen.shape[1], patience)
    if not rows.any():
        return 0
    trace.chosen[rows], trace.sure[rows] = -1, 0.0
    trace.fate[rows], trace.rms[rows] = ABSENT, np.nan
    trace.known[rows] = False
    return int(count[rows].max())
