"""A pose fitted to points: assignment and inverse kinematics in turns, and the cost."""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.ik.frames import PoseProblem, solve_frame
from handclean.kernels import jit
from handclean.kernels.chain import place_links, place_points
from handclean.kernels.gauss_newton import (
    ROOT_OPEN,
    Observations,
    Openness,
    Subspace,
    find_open_hinges,
    misfit,
)
from handclean.labels.track.state import FrameState
from handclean.labels.track.tracker import Tracker
from handclean.numerics.assignment import assign_rows

MIN_POINTS = 4
"""Markers with a point that a pose is fitted to at least; three fit too easily.
Chosen."""

MAX_ROUNDS, SUBSPACE_ROUNDS = 20, 4
"""Rounds of `assign_and_solve` at most, and how many of them begin in the posture
subspace. Chosen."""

MISSING_COST = 12.0
"""Cost of a marker without a point, as much as one at 3.5 times its RMS distance.
Chosen."""

MIN_GATE_M, GATE_SD = 8e-3, 3.0
"""[m], [sd] a gate never closes further than to the larger of these. Chosen."""

GATE_SHRINK = 0.75
"""Factor by which the gate closes from round to round. Chosen."""


class PointFit(NamedTuple):
    """How well a pose fits the points of its markers.

    squares (M,) [m^2] : squared distance of each marker from its point, NaN where it
    has none. cost : see `fit_cost`. assigned : markers with a point.
    """

    squares: Floats
    cost: float
    assigned: int


@jit
def no_fit(markers: int) -> PointFit:
    """Return the fit of a pose to no points at all; its cost is infinite."""
    return PointFit(np.full(markers, math.nan), math.inf, 0)


@jit
def fit_cost(squares: Floats, variance: Floats) -> float:
    """Cost of a fit, in squared standard deviations.

    A marker costs its squared distance over its variance, `MISSING_COST` at most; a
    marker without a point costs `MISSING_COST`.

    Parameters
    ----------
    squares : (M,) [m^2], NaN without a point. variance : (M,) [m^2]
    """
    total = 0.0
    for m in range(squares.shape[0]):
        if math.isnan(squares[m]):
            total += MISSING_COST
        else:
            total += min(squares[m] / variance[m], MISSING_COST)
    return total


@jit
def place_markers(pose: Floats, tracker: Tracker, places: Floats) -> Floats:
    """Write where (M, 3) [m] a pose puts the markers.

    Returns
    -------
    (L, 3, 3) rotation of each link: a view of the workspace, until the next call.
    """
    chain, work = tracker.chain, tracker.work
    place_links(
        pose, chain.parent, chain.offset, chain.axis, work.turn, work.origin,
        work.column,
    )  # fmt: skip
    place_points(work.turn, work.origin, chain.link, chain.at, places)
    for m in range(places.shape[0]):
        for n in range(3):
            places[m, n] += pose[n]
    return work.turn


@jit
def measure_fit(pose: Floats, state: FrameState, tracker: Tracker) -> PointFit:
    """Return how well a pose fits the points that the state observes."""
    weight = state.weight
    seen = Observations(state.observed, weight)
    error = misfit(pose, seen, tracker.chain, tracker.work).error
    squares, assigned = np.full(weight.shape[0], math.nan), 0
    for m in range(weight.shape[0]):
        if weight[m] > 0.0:
            e = error[m]
            squares[m] = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
            assigned += 1
    return PointFit(squares, fit_cost(squares, tracker.variance), assigned)


@jit
def solve_pose(
    pose: Floats, basis: Floats, state: FrameState, tracker: Tracker
) -> PointFit:
    """Solve for ``pose``, in place, from the points that the state observes.

    Which joints are open is tested again when other markers are observed than in the
    last solve; the state remembers both.

    Parameters
    ----------
    pose : (7 + D,) start, overwritten.
    basis : ``tracker.basis`` to begin in the posture subspace, or ``no_basis``.

    Returns
    -------
    How well the pose fits afterwards.
    """
    chain, work, progress = tracker.chain, tracker.work, state.progress
    steps, lever_m = tracker.steps, tracker.rules.lever_m
    same, seen = True, Observations(state.observed, state.weight)
    for m in range(state.weight.shape[0]):
        same = same and (state.weight[m] > 0.0) == (state.solved_weight[m] > 0.0)
        state.solved_weight[m] = state.weight[m]
    if not same or progress.open_level == ROOT_OPEN:
        progress.open_level = find_open_hinges(
            pose, seen, chain, steps.damping, lever_m, work, state.is_open
        ).level
    problem = PoseProblem(
        chain, Subspace(tracker.mean, basis, tracker.prior_m), steps, lever_m
    )
    openness = Openness(max(progress.open_level, 1), state.is_open)
    solve_frame(pose, seen, openness, problem, work, math.inf)
    return measure_fit(pose, state, tracker)


@jit
def gated_squares(places: Floats, points: Floats, gate_m: float, out: Floats) -> None:
    """Write squared distances (M, P) [m^2], infinity beyond the gate."""
    for m in range(places.shape[0]):
        x, y, z = places[m, 0], places[m, 1], places[m, 2]
        for p in range(points.shape[0]):
            a, b, c = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
            d = a * a + b * b + c * c
            out[m, p] = d if d <= gate_m * gate_m else math.inf


@jit
def observe_points(
    points: Floats, chosen: Ints, observed: Floats, weight: Floats
) -> int:
    """Write each marker's point and weight 1, or weight 0; return how many have one."""
    count = 0
    for m in range(chosen.shape[0]):
        weight[m] = 0.0
        if chosen[m] >= 0:
            observed[m] = points[chosen[m]]
            weight[m] = 1.0
            count += 1
    return count


@jit
def closed_gate(variance: Floats) -> float:
    """[m] gate that no marker in its place leaves, from (M,) [m^2] variances."""
    return max(MIN_GATE_M, GATE_SD * math.sqrt(variance.max()))


@jit
def assign_and_solve(
    pose: Floats,
    points: Floats,
    state: FrameState,
    tracker: Tracker,
    basis: Floats,
    gate_m: float,
    least_gate_m: float,
) -> float:
    """Assign points and solve for the pose, in turns, until the assignment stands.

    Parameters
    ----------
    pose : (7 + D,) start, overwritten.
    points : (P, 3) [m]
    state : its chosen, observed and weight are overwritten.
    basis : ``tracker.basis`` to begin in the posture subspace, or ``no_basis``.
    gate_m, least_gate_m : [m] at the start and at the end.

    Returns
    -------
    `fit_cost`; infinity without enough points.
    """
    markers = state.weight.shape[0]
    squares, price = np.zeros((markers, points.shape[0])), np.zeros(markers)
    places, before = np.zeros((markers, 3)), np.full(markers, -2)
    for turn in range(MAX_ROUNDS):
        place_markers(pose, tracker, places)
        gated_squares(places, points, gate_m, squares)
        price[:] = gate_m * gate_m
        assign_rows(squares, price, state.chosen)
        count = observe_points(points, state.chosen, state.observed, state.weight)
        if count < MIN_POINTS:
            return math.inf
        same = True
        for m in range(markers):
            same = same and state.chosen[m] == before[m]
            before[m] = state.chosen[m]
        if same and gate_m <= least_gate_m:
            break
        gate_m = max(GATE_SHRINK * gate_m, least_gate_m)
        subspace = basis if turn < SUBSPACE_ROUNDS else tracker.no_basis
        solve_pose(pose, subspace, state, tracker)
    return measure_fit(pose, state, tracker).cost
