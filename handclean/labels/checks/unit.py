"""Whether a take's points are of a hand's size at all: is its unit of length right?"""

from collections.abc import Sequence

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.labels.points import Cloud

MEASURED_FRAMES = 50
"""How many frames are measured, evenly through the take. Chosen."""

MEASURED_POINTS = 200
"""How many points of a frame are measured at most. Chosen: more than a hand has."""


def unit_hint(cloud: Cloud, model: Model) -> str:
    """Say that points are ten or more times too far apart for a hand, or too close.

    What tells is how far a point is from its nearest neighbour: other things in view
    change that less than the extent of all points, which only must not contradict it.
    The medians over frames are compared with the hand's in its zero posture.

    Returns
    -------
    A question about the unit; "" where the points may be a hand's.
    """
    counts = np.diff(cloud.start)
    rows = np.flatnonzero(counts >= min(4, len(model.labels)))
    some = [cloud.at[cloud.start[t] : cloud.start[t + 1]] for t in _spread(rows)]
    return _hint(some, model)


def markers_unit_hint(positions: Floats, model: Model) -> str:
    """Say that a hand's own markers are ten or more times too far apart, or too close.

    Parameters
    ----------
    positions : (T, M, 3) [m], NaN where missing.

    Returns
    -------
    A question about the unit; "" where the markers may be a hand's.
    """
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    rows = np.flatnonzero(seen.sum(axis=1) >= min(4, len(model.labels)))
    return _hint([positions[t, seen[t]] for t in _spread(rows)], model)


def _spread(rows: Ints) -> Ints:
    """Some of the frames, evenly through them."""
    count = min(MEASURED_FRAMES, len(rows))
    return np.asarray(rows[np.linspace(0, len(rows) - 1, count).astype(int)])


def _hint(frames: Sequence[Floats], model: Model) -> str:
    """Compare the points (P, 3) [m] of some frames with the hand's."""
    hand_span, hand_apart = _measure(
        marker_positions(model, neutral_pose(model.tree)[None])[0]
    )
    if not len(frames) or not 0.0 < hand_apart < np.inf:
        return ""
    span, apart = np.median([_measure(points) for points in frames], axis=0)
    if not (0.0 < apart < np.inf and span > 0.0):
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
    some = points[:MEASURED_POINTS]
    apart = np.linalg.norm(some[:, None] - some[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return span, float(np.median(apart.min(axis=1)))


def _metres(length: float) -> str:
    """Say a length so that zeros need not be counted."""
    if length >= 0.095:
        return f"{length:.2g} m" if length < 100.0 else f"{length:.0f} m"
    return f"{1e3 * length:.2g} mm"
