"""What was found in a frame, written down; and what it tells of each marker."""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.labels.track.fit import PointFit, place_markers
from handclean.labels.track.residual_gate import (
    FOLLOWED_GATE_FACTOR,
    learn_residual,
    threshold,
)
from handclean.labels.track.state import (
    ABSENT,
    FOLLOWED,
    OUTLIER,
    REJECTED,
    RETURNED,
    FrameSequence,
    FrameState,
    MarkerStats,
    TrackResult,
)
from handclean.labels.track.tracker import Tracker, TrackRules

BIAS_SHARE = 0.2
"""Share of the last frame in a marker's bias. Chosen."""


@jit
def record_frame(
    t: int,
    sequence: FrameSequence,
    fit: PointFit,
    state: FrameState,
    stats: MarkerStats,
    tracker: Tracker,
    result: TrackResult,
) -> None:
    """Write what was found in a frame, and learn each marker's bias and distance."""
    begin, places = sequence.start[t], np.zeros(state.observed.shape)
    turns = place_markers(state.pose, tracker, places)
    rules, square, count = tracker.rules, 0.0, 0
    for m in range(state.weight.shape[0]):
        if state.weight[m] <= 0.0:
            rejected = state.role[m] == OUTLIER
            result.outcome[t, m] = REJECTED if rejected else ABSENT
            result.chosen[t, m], result.confidence[t, m] = -1, 0.0
            stats.unseen[m] += 1
            continue
        away = learn_marker(
            m, places[m], turns[tracker.chain.link[m]], state.observed[m], stats, rules
        )
        returned = stats.unseen[m] > 0
        result.outcome[t, m] = RETURNED if returned else FOLLOWED
        result.chosen[t, m] = begin + state.chosen[m]
        result.confidence[t, m] = state.confidence[m]
        stats.unseen[m] = 0
        square += away
        count += 1
    result.pose[t] = state.pose
    result.cost[t] = fit.cost
    result.rms[t] = math.sqrt(square / count) if count > 0 else math.nan
    result.tracked[t] = count > 0


@jit
def learn_marker(
    m: int,
    place: Floats,
    turn: Floats,
    point: Floats,
    stats: MarkerStats,
    rules: TrackRules,
) -> float:
    """Update a marker's bias and usual distance by its point in this frame.

    Parameters
    ----------
    place : (3,) [m] where the pose puts the marker. turn : (3, 3) of its link.
    point : (3,) [m] the marker's point.

    Returns
    -------
    [m^2] squared distance of the point from that place.
    """
    square = 0.0
    share = 1.0 if stats.unseen[m] > 0 else BIAS_SHARE
    for j in range(3):
        local = 0.0
        for n in range(3):
            local += turn[n, j] * (point[n] - place[n])
        square += local * local
        stats.bias[m, j] += share * (local - stats.bias[m, j])
    most = threshold(stats.usual, m, rules.strict, rules.small_m)
    learn_residual(stats.usual, m, math.sqrt(square), FOLLOWED_GATE_FACTOR * most)
    return square
