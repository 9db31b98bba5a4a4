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
from handclean.ik.settings import SolveConfig
from handclean.ik.wrong_side import MIRROR_RATIO, is_odd, mirrored, refuse
from handclean.labels.points import Cloud
from handclean.labels.settings import LabelConfig
from handclean.labels.target import sought
from handclean.labels.track.tracker import Rules, Trace
from handclean.labels.track_take import EFFORTS, find

FRAMES = 5
"""Frames in which the mirror image is looked for."""


def expect_side(
    cloud: Cloud,
    subject: Subject,
    trace: Trace,
    prior: PosturePrior | None,
    rules: Rules,
    settings: LabelConfig,
    solving: SolveConfig,
) -> None:
    """Expect that the other hand does not fit the points of a take clearly better.

    Raises
    ------
    HandcleanError
        If it does.
    """
    seen = trace.chosen >= 0
    if not subject.model.tree.side or not is_odd(subject, seen, trace.rms):
        return
    other = sought(replace(subject, model=mirrored(subject.model)), prior)
    count = seen.sum(axis=1)
    rows = np.flatnonzero(trace.known & (count >= np.quantile(count[trace.known], 0.5)))
    rows = rows[np.linspace(0, len(rows) - 1, FRAMES).astype(int)]
    ways = [
        find(cloud, other, int(frame), rules, settings, solving, EFFORTS[1])
        for frame in rows
    ]
    found = [way for way in ways if way is not None]
    if len(found) < len(rows):
        return
    missing = 1.0 - seen[rows].mean(axis=1)
    own = trace.rms[rows] / other.spacing + settings.alpha * missing
    if np.median([way.score for way in found] / own) < MIRROR_RATIO:
        has = [float((way.chosen >= 0).sum()) for way in found]
        better = f"{np.median(has):.0f} markers at {_mm([way.rms for way in found])}"
        worse = f"{np.median(count[rows]):.0f} at {_mm(trace.rms[rows])}"
        refuse(subject, f"{better} against {worse}")


def _mm(rms: Floats | list[float]) -> str:
    return f"{1e3 * np.median(rms):.2g} mm"
