"""Whether a take's points are of a hand's size at all: is its unit of length right?"""

import numpy as np

from handclean.arrays import Floats
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.labels.points import Cloud

_FRAMES = 50
"""So many frames are measured, evenly through the take."""

_MOST_POINTS = 200
"""So many points of a frame are measured; further ones are not of a hand's markers."""


def unit_hint(cloud: Cloud, model: Model) -> str:
    """Say that points are ten or more times too far apart for a hand, or too close.

    What tells is how far a point is from its nearest neighbour: other things in view
    change that less than the extent of all points, which only must not contradict it.
    The medians over frames are compared with the hand's in its zero posture.

    Returns
    -------
    A question about the unit; "" where the points may be a hand's.
    """
    hand_span, hand_apart = _measure(
        marker_positions(model, neutral_pose(model.tree)[None])[0]
    )
    counts = np.diff(cloud.start)
    rows = np.flatnonzero(counts >= min(4, len(model.labels)))
    if not len(rows) or not hand_apart > 0.0:
        return ""
    rows = rows[np.linspace(0, len(rows) - 1, min(_FRAMES, len(rows))).astype(int)]
    found = [_measure(cloud.at[cloud.start[t] : cloud.start[t + 1]]) for t in rows]
    span, apart = np.median(found, axis=0)
    if not (apart > 0.0 and span > 0.0):
        return ""
    power = round(float(np.log10(apart / hand_apart)))
    extent = float(np.log10(span / hand_span))
    if power == 0 or (extent < power - 0.5 if power > 0 else extent > power + 1.0):
        return ""
    return (
        f"the points of a frame span {_metres(span)} where the hand's span "
        f"{_metres(hand_span)}: is the unit right? (--unit)"
    )


def _measure(points: Floats) -> tuple[float, float]:
    """[m] the longest side of the box around points (P, 3), and how far apart they are.

    The latter is the median distance to the nearest neighbour.
    """
    span = float(np.ptp(points, axis=0).max())
    some = points[:_MOST_POINTS]
    apart = np.linalg.norm(some[:, None] - some[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return span, float(np.median(apart.min(axis=1)))


def _metres(length: float) -> str:
    """Say a length so that zeros need not be counted."""
    if length >= 0.095:
        return f"{length:.2g} m" if length < 100.0 else f"{length:.0f} m"
    return f"{1e3 * length:.2g} mm"
