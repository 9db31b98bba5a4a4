"""A target found again near where it was last: several starts, the best is kept."""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.kernels.align import align
from handclean.labels.track.alternatives import (
    exchange_fingers,
    search_missing_fingers,
)
from handclean.labels.track.fit import (
    MIN_POINTS,
    assign_and_solve,
    closed_gate,
    gated_squares,
    observe_points,
    place_markers,
)
from handclean.labels.track.state import FrameState
from handclean.labels.track.tracker import Tracker
from handclean.numerics.assignment import assign_rows

MIN_RECOVERY_GAIN = 1.0
"""By how much another start must lower `fit_cost`, in squared standard deviations.
Chosen."""

RIGID_ROUNDS, RIGID_GATE_SHRINK = 4, 0.2
"""Rounds of `align_rigidly`, and the share of the gate that each takes off. Chosen."""

SOLVE_GATE_SHARE = 0.7
"""Share of the rigid alignment's gate with which fitting begins. Chosen."""

CENTRE_RADIUS_M, CENTRE_ROUNDS = 0.15, 3
"""[m] points about a pose that are taken for the hand's, and how often their middle is
taken. Chosen: most of a hand's length."""

POOR_COST_PER_MARKER = 2.0
"""`fit_cost` per marker above which single fingers are searched for. Chosen."""


@jit
def recover_pose(
    points: Floats, state: FrameState, tracker: Tracker, gate_m: float, cost: float
) -> float:
    """Find the target again from where it was.

    Starts are the last pose and the predicted pose, each as it is and moved by as much
    as the middle of all points near it; each is aligned rigidly, then fitted.

    Parameters
    ----------
    points : (P, 3) [m]
    state : ``pose`` and ``chosen`` are the fit so far; overwritten by a better one.
    gate_m : [m] how far from its place a marker's point may be.
    cost : `fit_cost` of the fit so far.

    Returns
    -------
    `fit_cost` afterwards.
    """
    best_pose, best = state.pose.copy(), state.chosen.copy()
    start, least = state.trial_pose, closed_gate(tracker.variance)
    for centred in (False, True):
        for predicted in (False, True):
            start[:] = state.last_pose
            if predicted:
                _move_on(start, state.velocity)
            if centred:
                _centre_on_points(start, points, tracker)
            align_rigidly(start, points, state, tracker, gate_m)
            found = assign_and_solve(
                start, points, state, tracker, tracker.no_basis,
                SOLVE_GATE_SHARE * gate_m, least,
            )  # fmt: skip
            if found < cost - MIN_RECOVERY_GAIN:
                cost = found
                best_pose[:] = start
                best[:] = state.chosen
    state.pose[:] = best_pose
    state.chosen[:] = best
    observe_points(points, state.chosen, state.observed, state.weight)
    if cost > POOR_COST_PER_MARKER * state.weight.shape[0]:
        cost = search_missing_fingers(state.pose, points, state, tracker, gate_m, cost)
        cost = exchange_fingers(state.pose, points, state, tracker, cost)
    return cost


@jit
def align_rigidly(
    pose: Floats, points: Floats, state: FrameState, tracker: Tracker, gate_m: float
) -> None:
    """Align a stiff hand with points, in place: a few rounds of assignment."""
    markers = state.weight.shape[0]
    squares, price = np.zeros((markers, points.shape[0])), np.zeros(markers)
    places, unmoved = np.zeros((markers, 3)), np.zeros(pose.shape[0])
    for turn in range(RIGID_ROUNDS):
        reach = gate_m * (1.0 - RIGID_GATE_SHRINK * turn)
        place_markers(pose, tracker, places)
        gated_squares(places, points, reach, squares)
        price[:] = reach * reach
        assign_rows(squares, price, state.chosen)
        count = observe_points(points, state.chosen, state.observed, state.weight)
        if count < MIN_POINTS:
            return
        unmoved[:] = pose
        unmoved[:3] = 0.0
        unmoved[3] = 1.0
        unmoved[4:7] = 0.0
        place_markers(unmoved, tracker, places)
        align(places, state.observed, state.weight, pose)


@jit
def _move_on(pose: Floats, velocity: Floats) -> None:
    """Add a frame's motion to a pose, in place."""
    norm = 0.0
    for n in range(pose.shape[0]):
        pose[n] += velocity[n]
    for n in range(3, 7):
        norm += pose[n] ** 2
    for n in range(3, 7):
        pose[n] /= math.sqrt(norm)


@jit
def _centre_on_points(pose: Floats, points: Floats, tracker: Tracker) -> None:
    """Move a pose so that the middle of its markers is that of the points about it."""
    markers = tracker.branch.shape[0]
    places, middle = np.zeros((markers, 3)), np.zeros(3)
    place_markers(pose, tracker, places)
    for m in range(markers):
        for n in range(3):
            middle[n] += places[m, n] / markers
    for _ in range(CENTRE_ROUNDS):
        total, count = np.zeros(3), 0
        for p in range(points.shape[0]):
            square = 0.0
            for n in range(3):
                square += (points[p, n] - middle[n]) ** 2
            if square < CENTRE_RADIUS_M * CENTRE_RADIUS_M:
                count += 1
                for n in range(3):
                    total[n] += points[p, n] - middle[n]
        if count < MIN_POINTS:
            return
        for n in range(3):
            middle[n] += total[n] / count
            pose[n] += total[n] / count
