"""Other fits to try when one is poor: a finger restarted, searched for or exchanged.

Fingers stand beside each other and look alike, so that two of them can change places,
whole or from a joint outwards, and bend until the residual is nearly right. No single
exchange of two points leads back: the fingers must be exchanged as wholes.
"""

import math

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit
from handclean.labels.track.fit import (
    MIN_POINTS,
    PointFit,
    gated_squares,
    measure_fit,
    observe_points,
    place_markers,
    solve_pose,
)
from handclean.labels.track.state import FrameState
from handclean.labels.track.tracker import Tracker
from handclean.numerics.assignment import assign_rows

MIN_GAIN = 4.0
"""By how much another assignment must lower `fit_cost` to be believed, in squared
standard deviations. Chosen: two standard deviations of one marker."""

SEARCH_ROUNDS = 6
"""Rounds of assignment in `search_missing_fingers` at most. Chosen."""

EXCHANGES, MAX_EXCHANGED_MARKERS = 4, 4
"""Exchanges in a row at most, and markers of a finger that are exchanged at most: as
many as marker sets put on one. Chosen."""


@jit
def exchange_outer_markers(
    chosen: Ints, one: int, other: int, depth: int, branch: Ints, rank: Ints
) -> tuple[Ints, bool]:
    """Exchange the points of the ``depth`` outermost markers of two fingers.

    Parameters
    ----------
    chosen : (M,) row of each marker's point.
    one, other : the fingers' numbers in ``branch``.
    branch, rank : (M,) see `Tracker`.

    Returns
    -------
    (M,) rows, and whether both fingers have so many markers.
    """
    exchanged, deep_enough = chosen.copy(), False
    for m in range(chosen.shape[0]):
        if branch[m] != one or rank[m] >= depth:
            continue
        for n in range(chosen.shape[0]):
            if branch[n] == other and rank[n] == rank[m]:
                exchanged[m], exchanged[n] = chosen[n], chosen[m]
                if rank[m] == depth - 1:
                    deep_enough = True
    return exchanged, deep_enough


@jit
def exchange_fingers(
    pose: Floats, points: Floats, state: FrameState, tracker: Tracker, cost: float
) -> float:
    """Exchange the outer markers of two fingers where that is better, in place.

    Parameters
    ----------
    pose : (7 + D,) a fit, overwritten by a better one.
    state : its chosen, observed and weight go with the pose.
    cost : `fit_cost` of the fit.

    Returns
    -------
    `fit_cost` afterwards.
    """
    best, best_pose = state.chosen.copy(), pose.copy()
    base, trial = state.chosen.copy(), pose.copy()
    branch, rank = tracker.branch, tracker.rank
    fingers = branch.max() if base.shape[0] > 0 else 0
    for _ in range(EXCHANGES):
        lowest = cost
        for one in range(1, fingers + 1):
            for other in range(one + 1, fingers + 1):
                for depth in range(1, MAX_EXCHANGED_MARKERS + 1):
                    exchanged, deep_enough = exchange_outer_markers(
                        base, one, other, depth, branch, rank
                    )
                    if not deep_enough:
                        break
                    state.chosen[:] = exchanged
                    trial[:] = pose
                    count = observe_points(
                        points, exchanged, state.observed, state.weight
                    )
                    if count < MIN_POINTS:
                        continue
                    fit = solve_pose(trial, tracker.no_basis, state, tracker)
                    if fit.cost < lowest - MIN_GAIN:
                        lowest = fit.cost
                        best[:] = exchanged
                        best_pose[:] = trial
        if lowest >= cost:
            break
        cost = lowest
        pose[:] = best_pose
        base[:] = best
    state.chosen[:] = base
    observe_points(points, state.chosen, state.observed, state.weight)
    return cost


@jit
def restart_finger(
    pose: Floats, branch: int, fit: PointFit, state: FrameState, tracker: Tracker
) -> PointFit:
    """Solve again with one finger in other postures; keep the best pose, in place.

    With few markers a finger can fit in more than one way, and tracking it can end in
    the wrong one.

    Parameters
    ----------
    pose : (7 + D,) a solution, overwritten by a better one.
    branch : the finger's number in ``tracker.branch``.
    fit : how well ``pose`` fits.

    Returns
    -------
    How well the pose fits afterwards.
    """
    lowest, best_pose, trial = fit.cost, pose.copy(), pose.copy()
    for start in range(tracker.starts.shape[0]):
        trial[:] = pose
        for d in range(tracker.hinge_branch.shape[0]):
            if tracker.hinge_branch[d] == branch:
                trial[7 + d] = tracker.starts[start, d]
        found = solve_pose(trial, tracker.no_basis, state, tracker)
        if found.cost < lowest - MIN_GAIN:
            lowest = found.cost
            best_pose[:] = trial
    pose[:] = best_pose
    return measure_fit(pose, state, tracker)


@jit
def fit_branch(
    pose: Floats,
    points: Floats,
    searched: Bools,
    free: Bools,
    state: FrameState,
    tracker: Tracker,
    gate_m: float,
) -> float:
    """Assign free points to some markers and solve, in turns; ``pose`` in place.

    Parameters
    ----------
    searched : (M,) markers that are given points anew; others keep those they have.
    free : (P,) points that they may have.
    state : its chosen, observed and weight are overwritten.

    Returns
    -------
    `fit_cost`.
    """
    markers = state.weight.shape[0]
    squares, price = np.zeros((markers, points.shape[0])), np.zeros(markers)
    places, found = np.zeros((markers, 3)), np.full(markers, -1)
    last = state.chosen.copy()
    for _ in range(SEARCH_ROUNDS):
        place_markers(pose, tracker, places)
        gated_squares(places, points, gate_m, squares)
        for m in range(markers):
            price[m] = gate_m * gate_m if searched[m] else -1.0
            for p in range(points.shape[0]):
                if not searched[m] or not free[p]:
                    squares[m, p] = math.inf
        assign_rows(squares, price, found)
        same = True
        for m in range(markers):
            if searched[m]:
                state.chosen[m] = found[m]
            same = same and state.chosen[m] == last[m]
            last[m] = state.chosen[m]
        if same:
            break
        count = observe_points(points, state.chosen, state.observed, state.weight)
        if count < MIN_POINTS:
            break
        solve_pose(pose, tracker.no_basis, state, tracker)
    return measure_fit(pose, state, tracker).cost


@jit
def search_missing_fingers(
    pose: Floats,
    points: Floats,
    state: FrameState,
    tracker: Tracker,
    gate_m: float,
    cost: float,
) -> float:
    """Give markers without a point, finger by finger, points further off, in place.

    A finger far from where the start posture had it is left without points when the
    gate closes. Once the rest of the hand stands, it is searched for alone: first its
    markers without a point, then all of them.

    Parameters
    ----------
    pose : (7 + D,) a fit, overwritten by a better one.
    state : its chosen, observed and weight go with the pose.
    gate_m : [m] how far from its place a marker's point may be.
    cost : `fit_cost` of the fit.

    Returns
    -------
    `fit_cost` afterwards.
    """
    markers = state.weight.shape[0]
    base, base_pose = state.chosen.copy(), pose.copy()
    searched = np.zeros(markers, np.bool_)
    free = np.zeros(points.shape[0], np.bool_)
    for branch in range(tracker.branch.max() + 1):
        for whole_finger in (False, True):
            missing = 0
            free[:] = True
            for m in range(markers):
                mine = tracker.branch[m] == branch
                missing += 1 if mine and base[m] < 0 else 0
                searched[m] = mine and (whole_finger or base[m] < 0)
                if base[m] >= 0 and not searched[m]:
                    free[base[m]] = False
            if missing == 0:
                break
            pose[:] = base_pose
            state.chosen[:] = base
            after = fit_branch(pose, points, searched, free, state, tracker, gate_m)
            if after < cost - MIN_GAIN:
                cost = after
                base[:] = state.chosen
                base_pose[:] = pose
    pose[:] = base_pose
    state.chosen[:] = base
    observe_points(points, state.chosen, state.observed, state.weight)
    return cost
