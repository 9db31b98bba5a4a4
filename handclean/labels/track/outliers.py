"""Points that are not what they were taken for: refused after the fit, worst first."""

import math

import numpy as np

from handclean.arrays import Ints
from handclean.kernels import jit
from handclean.labels.track.alternatives import restart_finger
from handclean.labels.track.fit import MIN_POINTS, PointFit, measure_fit, solve_pose
from handclean.labels.track.residual_gate import (
    FOLLOWED_GATE_FACTOR,
    UsualResiduals,
    threshold,
)
from handclean.labels.track.state import (
    ANCHOR,
    NEWCOMER,
    OUTLIER,
    FrameState,
    MarkerStats,
)
from handclean.labels.track.tracker import Tracker, TrackRules

POOR_FIT_FACTOR = 1.6
"""A fit is poor if its RMS distance is so many times the usual, and ``small_m`` more.
Chosen."""


@jit
def find_outlier(
    fit: PointFit, role: Ints, usual: UsualResiduals, rules: TrackRules
) -> int:
    """Return the marker to be rejected next, or -1 if none is beyond its threshold.

    Newcomers go before markers that hold the model, which they may have pushed beyond.

    Parameters
    ----------
    fit : how far the markers are from their points.
    role : (M,) `ANCHOR` or `NEWCOMER`. usual : their usual distances.
    """
    largest, outlier, largest_new, newcomer = 1.0, -1, 0.0, -1
    for m in range(role.shape[0]):
        if math.isnan(fit.squares[m]):
            continue
        allowed = threshold(usual, m, rules.strict, rules.small_m)
        if role[m] == ANCHOR:
            allowed *= FOLLOWED_GATE_FACTOR
        ratio = math.sqrt(fit.squares[m]) / allowed
        if ratio > largest:
            largest, outlier = ratio, m
        if role[m] == NEWCOMER and ratio > largest_new:
            largest_new, newcomer = ratio, m
    return newcomer if outlier >= 0 and newcomer >= 0 else outlier


@jit
def reject_outliers(
    state: FrameState, stats: MarkerStats, tracker: Tracker
) -> PointFit:
    """Solve for the pose, and leave out markers beyond their threshold, one by one.

    Before the first marker of a finger is left out, the finger is tried in other
    postures.

    Parameters
    ----------
    state : its pose, weight and role are overwritten.

    Returns
    -------
    How well the pose fits the markers that are left.
    """
    restarted = np.zeros(tracker.chain.parent.shape[0], dtype=np.bool_)  # of branches
    fit = solve_pose(state.pose, tracker.no_basis, state, tracker)
    while True:
        outlier = find_outlier(fit, state.role, stats.usual, tracker.rules)
        if outlier < 0 or fit.assigned <= MIN_POINTS:
            return fit
        branch = tracker.branch[outlier]
        if branch > 0 and not restarted[branch]:
            restarted[branch] = True
            fit = restart_finger(state.pose, branch, fit, state, tracker)
            continue
        state.weight[outlier] = 0.0
        state.role[outlier] = OUTLIER
        fit = solve_pose(state.pose, tracker.no_basis, state, tracker)


@jit
def accept_reappearing(
    state: FrameState, stats: MarkerStats, tracker: Tracker
) -> PointFit:
    """Fit the pose to the newcomers as well; leave out those that do not fit.

    All are tried together. They are accepted once every one is below its threshold and
    pushes no other above its own.

    Parameters
    ----------
    state : its pose, weight and role are overwritten.

    Returns
    -------
    How well the pose fits afterwards.
    """
    newcomers, trial = 0, state.trial_pose
    for m in range(state.weight.shape[0]):
        if state.role[m] == NEWCOMER and state.weight[m] <= 0.0:
            state.weight[m] = 1.0
            newcomers += 1
    while newcomers > 0:
        trial[:] = state.pose
        fit = solve_pose(trial, tracker.no_basis, state, tracker)
        outlier = find_outlier(fit, state.role, stats.usual, tracker.rules)
        if (
            outlier >= 0
            and tracker.branch[outlier] > 0
            and state.role[outlier] == NEWCOMER
        ):
            branch = tracker.branch[outlier]
            fit = restart_finger(trial, branch, fit, state, tracker)
            outlier = find_outlier(fit, state.role, stats.usual, tracker.rules)
        if outlier < 0 or state.role[outlier] != NEWCOMER:
            state.pose[:] = trial
            break
        state.weight[outlier] = 0.0
        state.role[outlier] = OUTLIER
        newcomers -= 1
    return measure_fit(state.pose, state, tracker)


@jit
def is_poor_fit(fit: PointFit, usual: UsualResiduals, rules: TrackRules) -> bool:
    """Whether the fit is clearly worse than this hand's usual ones."""
    square, usual_square, count = 0.0, 0.0, 0
    for m in range(fit.squares.shape[0]):
        if not math.isnan(fit.squares[m]):
            square += fit.squares[m]
            usual_square += usual.mean[m] ** 2 + usual.variance[m]
            count += 1
    if count == 0:
        return True
    most = POOR_FIT_FACTOR * math.sqrt(usual_square / count) + rules.small_m
    return math.sqrt(square / count) > most


@jit
def count_lost(fit: PointFit, unseen: Ints) -> int:
    """Count the markers that were seen before and have no point now.

    Parameters
    ----------
    unseen : (M,) frames out of sight before this one.
    """
    lost = 0
    for m in range(unseen.shape[0]):
        if unseen[m] == 0 and math.isnan(fit.squares[m]):
            lost += 1
    return lost
