"""Is it the other hand? The mirror image of a model, looked for in the same points.

Points of a left hand can be given a right hand's names, thumb for little finger, and
fit it badly but not hopelessly. So where what was followed fits worse than it usually
does, the mirror image is looked for in a few frames: if it fits clearly better by
equation 2 (distance and markers missing, see `align`), it is that hand. Measured on
real takes, RMS of a template as the other hand and as what it was: 7.5 and 4.1 mm
(dfki13), 8.7 and 4.1 mm (xu19), 11.3 and 4.2 mm (han19).
"""

from dataclasses import replace

import numpy as np

from handclean.arrays import Floats
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.ik.wrong_side import MIRROR_RATIO, is_odd, mirrored, refuse
from handclean.labels.points import Cloud
from handclean.labels.target import make_target
from handclean.labels.track.state import TrackResult
from handclean.labels.track.tracker import TrackSetup
from handclean.labels.track_take import THOROUGH_SEARCH, find_in_frame

MIRROR_FRAMES = 5
"""Frames in which the mirror image is looked for. Chosen."""


def expect_side(
    cloud: Cloud,
    subject: Subject,
    result: TrackResult,
    prior: PosturePrior | None,
    setup: TrackSetup,
) -> None:
    """Expect that the other hand does not fit the points of a take clearly better.

    Raises
    ------
    HandcleanError
        If it does.
    """
    seen = result.chosen >= 0
    if not subject.model.tree.side or not is_odd(subject, seen, result.rms):
        return
    other = make_target(replace(subject, model=mirrored(subject.model)), prior)
    count = seen.sum(axis=1)
    rows = np.flatnonzero(
        result.tracked & (count >= np.quantile(count[result.tracked], 0.5))
    )
    rows = rows[np.linspace(0, len(rows) - 1, MIRROR_FRAMES).astype(int)]
    missing = 1.0 - seen[rows].mean(axis=1)
    own = result.rms[rows] / other.spacing + setup.labelling.alpha * missing
    found, not_better = [], 0
    for row, score in zip(rows, own, strict=True):
        fit = find_in_frame(cloud, other, int(row), setup, THOROUGH_SEARCH)
        if fit is None:
            return
        found.append(fit)
        not_better += not fit.score < MIRROR_RATIO * score
        if 2 * not_better > len(rows):  # the median is not better, whatever follows
            return
    has = [float((fit.chosen >= 0).sum()) for fit in found]
    better = f"{np.median(has):.0f} markers at {_mm([fit.rms for fit in found])}"
    worse = f"{np.median(count[rows]):.0f} at {_mm(result.rms[rows])}"
    refuse(subject, f"{better} against {worse}")


def _mm(rms: Floats | list[float]) -> str:
    return f"{1e3 * np.median(rms):.2g} mm"
