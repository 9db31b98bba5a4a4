"""Is what was followed this hand at all? It shows most of its markers at some time.

Few points fit a hand wherever they are: each finger has four joints to turn until a
marker or two meet a point. What points of other things do not do is to be most of a
set's markers at once, and to go on being so. So every stretch of frames through which
a model was tracked must show, at some time, `NEARLY_ALL_MARKERS_SHARE` of the set in a
frame, as a search that ended well does, or `MANY_MARKERS_SHARE` of it through
`MANY_MARKERS_FRAMES` frames. A stretch that never does is dropped: its points have no
names.

Measured with a set of 13 on takes without a hand: 4 to 7 markers at once in gait,
dance, standing points and noise, 8 in a few frames; takes in which half of a hand's
markers are hidden show 12 or 13 before.
"""

import numpy as np

from handclean.arrays import Bools, Ints
from handclean.labels.track.state import ABSENT, TrackResult

NEARLY_ALL_MARKERS_SHARE = 0.9
"""Share of a set's markers that tells a hand in one frame. Measured, see above."""

MANY_MARKERS_SHARE, MANY_MARKERS_FRAMES = 0.6, 10
"""Share of them that does in so many frames on end. Measured, see above."""


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
        most = here >= MANY_MARKERS_SHARE * markers
        long = min(MANY_MARKERS_FRAMES, len(rows))
        longest = np.convolve(most, np.ones(long), "valid").max()
        if (
            here.max() < NEARLY_ALL_MARKERS_SHARE * markers
            and longest < MANY_MARKERS_FRAMES
        ):
            out[rows] = True
    return out


def drop_unproven(result: TrackResult, patience: int) -> int:
    """Drop the stretches that never show the hand, in place.

    Returns
    -------
    Most markers that such a frame showed, 0 if there is none.
    """
    count = (result.chosen >= 0).sum(axis=1)
    rows = unproven(count, result.tracked, result.chosen.shape[1], patience)
    if not rows.any():
        return 0
    result.chosen[rows], result.confidence[rows] = -1, 0.0
    result.outcome[rows], result.rms[rows] = ABSENT, np.nan
    result.tracked[rows] = False
    return int(count[rows].max())
