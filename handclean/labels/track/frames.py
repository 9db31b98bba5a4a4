"""From frame to frame: predict, assign, fit, reject, accept (Maycock 2015 III-B, C).

For every frame

1. `predict_pose` moves the pose on, and `expected_places` says where that puts the
   markers (`prediction`);
2. `assign_points` assigns points to markers by the Hungarian method, within gates
   (`assign`); links between points change its costs (`links`);
3. `reject_outliers` fits the pose to the markers that were seen before; those further
   from the model than their threshold are left out, the worst first (`outliers`,
   `residual_gate`);
4. where that leaves a fit that is not what this hand usually has, `recover_pose` tries
   other starts (`other_poses`, `alternatives`); where they fail too, the target is
   lost, and the caller looks for it anew;
5. `reassign_missing` gives points to the markers that have none, and
   `accept_reappearing` fits the pose to them as well: those that stay below their
   threshold, and push no other above its own, are accepted;
6. `record_frame` writes what was found (`record`), and what was learnt of markers,
   links and velocity goes on to the next frame.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.labels.track.assign import (
    assign_points,
    pair_costs,
    rate_labels,
    reassign_missing,
    select_anchors,
)
from handclean.labels.track.fit import (
    MIN_POINTS,
    PointFit,
    no_fit,
    place_markers,
    solve_pose,
)
from handclean.labels.track.links import learn_link_trust
from handclean.labels.track.other_poses import recover_pose
from handclean.labels.track.outliers import (
    accept_reappearing,
    count_lost,
    is_poor_fit,
    reject_outliers,
)
from handclean.labels.track.prediction import (
    expected_places,
    freeze_unseen_hinges,
    learn_prediction_error,
    learn_velocity,
    predict_pose,
    prediction_variance,
)
from handclean.labels.track.record import record_frame
from handclean.labels.track.state import (
    ANCHOR,
    FrameSequence,
    FrameState,
    MarkerStats,
    TrackResult,
    frame_points,
)
from handclean.labels.track.tracker import Tracker, TrackRules

MANY_LOST = 3
"""If so many markers lose their points in one frame, the fit is doubtful. Chosen."""

RECOVERY_GATE_PER_REACH = 3.0
"""Gate of `recover_pose`, in units of the setting ``reach_m``. Chosen."""

NO_FIT_COST = 1e9
"""Stands for the cost of a pose that fits too few points; any fit is better. Chosen."""


@jit
def track_frames(
    sequence: FrameSequence,
    first: int,
    stop: int,
    by: int,
    state: FrameState,
    stats: MarkerStats,
    tracker: Tracker,
    result: TrackResult,
) -> int:
    """Track a target through frames ``first``, ``first + by``, ... before ``stop``.

    Parameters
    ----------
    sequence : the points of all frames and their paths, seen in this direction.
    state : its pose is that of the frame before ``first``, or of ``first`` itself.
    stats : of the markers, overwritten. result : rows of the frames, overwritten.

    Returns
    -------
    The frame in which it lost the target, or ``stop``.
    """
    t = first
    while t != stop:
        if not track_frame(t, sequence, state, stats, tracker, result):
            return t
        t += by
    return stop


@jit
def track_frame(
    t: int,
    sequence: FrameSequence,
    state: FrameState,
    stats: MarkerStats,
    tracker: Tracker,
    result: TrackResult,
) -> bool:
    """Track a target into the next frame, see the module; return whether it is there.

    It is there, too, in a frame that shows too few points, unless too many frames on
    end did (``lost_after``).
    """
    points, rules = frame_points(sequence, t), tracker.rules
    state.last_pose[:] = state.pose
    predict_pose(state, tracker.chain.limits)
    expected = expected_places(state.pose, stats.bias, tracker)
    fit = fit_frame(t, sequence, expected, state, stats, tracker)
    if is_doubtful(points.shape[0], fit, stats, rules):
        fit = recover_frame(points, fit, state, stats, tracker)
        if fit.assigned < MIN_POINTS or is_poor_fit(fit, stats.usual, rules):
            state.pose[:] = state.last_pose
            return False
    if fit.assigned < MIN_POINTS:
        return wait_frame(t, state, stats, rules, result)
    state.progress.lost_frames = 0
    learn_prediction_error(expected, state, stats, rules.min_error_m)
    reassign_missing(points, state, stats, tracker)
    fit = accept_reappearing(state, stats, tracker)
    freeze_unseen_hinges(state.weight, tracker.chain, state.frozen)
    record_frame(t, sequence, fit, state, stats, tracker, result)
    learn_link_trust(t, sequence, state)
    learn_velocity(state, rules.max_turn_rad)
    return True


@jit
def fit_frame(
    t: int,
    sequence: FrameSequence,
    expected: Floats,
    state: FrameState,
    stats: MarkerStats,
    tracker: Tracker,
) -> PointFit:
    """Assign a frame's points, and fit the pose to the markers that were seen before.

    Parameters
    ----------
    expected : (M, 3) [m] where the markers are expected.

    Returns
    -------
    How well the pose fits; `no_fit` where too few markers have a point.
    """
    pairs = assign_points(t, sequence, expected, state, stats, tracker)
    assigned = 0
    for m in range(state.chosen.shape[0]):
        assigned += 1 if state.chosen[m] >= 0 else 0
    if assigned >= MIN_POINTS:
        rate_labels(pairs, state.chosen, state.confidence)
        points = frame_points(sequence, t)
        if select_anchors(points, state, stats.unseen) >= MIN_POINTS:
            return reject_outliers(state, stats, tracker)
    return no_fit(state.chosen.shape[0])


@jit
def is_doubtful(
    points: int, fit: PointFit, stats: MarkerStats, rules: TrackRules
) -> bool:
    """Whether a fit is poor, or lost many markers, though the frame has enough points.

    Parameters
    ----------
    points : how many points the frame has.
    """
    if points < MIN_POINTS or 2 * points < stats.unseen.shape[0]:
        return False
    return (
        fit.assigned < MIN_POINTS
        or is_poor_fit(fit, stats.usual, rules)
        or count_lost(fit, stats.unseen) >= MANY_LOST
    )


@jit
def recover_frame(
    points: Floats,
    fit: PointFit,
    state: FrameState,
    stats: MarkerStats,
    tracker: Tracker,
) -> PointFit:
    """Try other starts for a doubtful fit, and reject outliers of a better one.

    Parameters
    ----------
    points : (P, 3) [m]
    fit : how well the pose fits so far.

    Returns
    -------
    How well the pose fits afterwards.
    """
    rules = tracker.rules
    before = fit.cost if fit.assigned >= MIN_POINTS else NO_FIT_COST
    gate_m = RECOVERY_GATE_PER_REACH * rules.reach_m
    if recover_pose(points, state, tracker, gate_m, before) < before:
        places = np.zeros(state.observed.shape)
        place_markers(state.pose, tracker, places)
        variance = prediction_variance(state.frozen, stats, tracker.chain, rules, 1.0)
        pairs = pair_costs(points, places, variance, stats.unseen, rules)
        rate_labels(pairs, state.chosen, state.confidence)
        state.role[:] = ANCHOR  # the trials are over: every marker holds its point
        return reject_outliers(state, stats, tracker)
    if fit.assigned >= MIN_POINTS:
        return solve_pose(state.pose, tracker.no_basis, state, tracker)
    return fit


@jit
def wait_frame(
    t: int,
    state: FrameState,
    stats: MarkerStats,
    rules: TrackRules,
    result: TrackResult,
) -> bool:
    """Keep the last pose in a frame with too few points.

    Returns
    -------
    Whether to go on; False once the target has been out of sight for too long.
    """
    state.pose[:] = state.last_pose
    state.velocity[:] = 0.0
    state.last_row[:] = -1
    state.progress.lost_frames += 1
    result.pose[t] = state.pose
    for m in range(stats.unseen.shape[0]):
        stats.unseen[m] += 1
    return bool(state.progress.lost_frames <= rules.lost_after)
