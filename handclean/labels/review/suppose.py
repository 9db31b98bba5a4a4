"""What a path of points would be worth under another name."""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.labels.review.paths import Glance
from handclean.labels.track.alternatives import restart_finger
from handclean.labels.track.fit import PointFit, no_fit, place_markers, solve_pose
from handclean.labels.track.state import FrameSequence, FrameState, TrackResult
from handclean.labels.track.tracker import Tracker

MAX_JUMP_COST = 4.0
"""What it costs at most that a finger jumped (chosen)."""


class Renaming(NamedTuple):
    """Another name for a point.

    name : marker that it shall be, -1 none. other : marker that the point which has
    that name shall be, -1 none may have it; with the point's own name the two change
    places. bent : whether to restart these markers' fingers in any case; else only if
    it does not fit.
    """

    name: int
    other: int
    bent: bool


@jit
def cost_if_renamed(
    t: int,
    row: int,
    renaming: Renaming,
    sequence: FrameSequence,
    state: FrameState,
    tracker: Tracker,
    result: TrackResult,
) -> PointFit:
    """Return how well a frame is fitted if a point has another name.

    Parameters
    ----------
    row : the point, -1 to leave all as it is.
    state : its trial_pose is overwritten by the pose.

    Returns
    -------
    A fit of infinite cost if a name belongs to another point.
    """
    name, other, bent = renaming.name, renaming.other, renaming.bent
    moved = -1
    if name >= 0 and result.chosen[t, name] != row:
        moved = result.chosen[t, name]
    if moved >= 0 and (other < 0 or result.chosen[t, other] not in (-1, row)):
        return no_fit(state.weight.shape[0])
    for m in range(state.weight.shape[0]):
        p = result.chosen[t, m]
        if m == name:
            p = row
        elif m == other and moved >= 0:
            p = moved
        elif p == row:
            p = -1
        state.weight[m] = 0.0
        if p >= 0:
            state.weight[m] = 1.0
            state.observed[m] = sequence.at[p]
    state.trial_pose[:] = result.pose[t]
    fit = solve_pose(state.trial_pose, tracker.no_basis, state, tracker)
    if name < 0:
        return fit
    far = fit.squares[name] > 4.0 * tracker.variance[name]
    if bent or far or fit.cost > 2.0 * state.weight.shape[0]:
        for m in (name, other):
            if m >= 0 and tracker.branch[m] > 0:
                branch = tracker.branch[m]
                fit = restart_finger(state.trial_pose, branch, fit, state, tracker)
    return fit


@jit
def jump(
    t: int, by: int, name: int, pose: Floats, tracker: Tracker, result: TrackResult
) -> float:
    """Return how unlikely a finger moved so far while its marker was out of sight.

    Parameters
    ----------
    t : first or last frame of a path, with its pose; by : -1 or 1, the way out of it.
    """
    other = t + by
    while 0 <= other < result.chosen.shape[0] and result.chosen[other, name] < 0:
        other += by
    if not 0 <= other < result.chosen.shape[0]:
        return 0.0
    sd = 0.1 + tracker.rules.usual_turn_rad * (abs(other - t) - 1)
    total = 0.0
    for d in range(tracker.hinge_branch.shape[0]):
        if tracker.hinge_branch[d] == tracker.branch[name]:
            away = (pose[7 + d] - result.pose[other, 7 + d]) / sd
            total += away * away
    return min(total, MAX_JUMP_COST)


@jit
def judge_path(
    seen: Glance,
    renaming: Renaming,
    enough: float,
    write: bool,
    sequence: FrameSequence,
    state: FrameState,
    tracker: Tracker,
    result: TrackResult,
) -> tuple[float, float]:
    """Return what a path costs under a name, on average over some of its frames.

    Beside it stands what its finger's jumps at both ends cost.

    Parameters
    ----------
    enough : a path that cannot cost less any more is infinitely bad.
    write : whether to keep the poses, in the result.
    """
    total, count, jumps = 0.0, 0, 0.0
    name, size = renaming.name, seen.rows.shape[0]
    for n in range(size):
        t = seen.frames[n]
        if not result.tracked[t]:
            continue
        fit = cost_if_renamed(
            t, seen.rows[n], renaming, sequence, state, tracker, result
        )
        if fit.cost == math.inf:
            return math.inf, 0.0
        for by in (-1, 1):
            if name >= 0 and n == (0 if by < 0 else size - 1):
                jumps += jump(t, by, name, state.trial_pose, tracker, result)
        if write:
            keep_pose(t, state.trial_pose, fit, result)
        total += fit.cost
        count += 1
        if total > size * enough:
            return math.inf, 0.0
    return (total / count, jumps) if count > 0 else (math.inf, 0.0)


@jit
def keep_pose(t: int, pose: Floats, fit: PointFit, result: TrackResult) -> None:
    """Write a frame's pose, and how well it fits."""
    square = 0.0
    for m in range(fit.squares.shape[0]):
        if not math.isnan(fit.squares[m]):
            distance = math.sqrt(fit.squares[m])
            square += distance * distance
    result.pose[t] = pose
    result.cost[t] = fit.cost
    result.rms[t] = math.sqrt(square / fit.assigned)


@jit
def measure(
    sequence: FrameSequence,
    tracker: Tracker,
    result: TrackResult,
    places: Floats,
    squares: Floats,
) -> None:
    """Write where the poses of a result put the markers, and how far their points are.

    Parameters
    ----------
    places : (T, M, 3) [m]; squares : (T, M) [m^2], NaN where there is no point.
    """
    for t in range(places.shape[0]):
        place_markers(result.pose[t], tracker, places[t])
        for m in range(places.shape[1]):
            p = result.chosen[t, m]
            squares[t, m] = math.nan
            if p >= 0 and result.tracked[t]:
                total = 0.0
                for n in range(3):
                    total += (sequence.at[p, n] - places[t, m, n]) ** 2
                squares[t, m] = total


def measured(
    sequence: FrameSequence, tracker: Tracker, result: TrackResult
) -> tuple[Floats, Floats]:
    """(T, M, 3) [m] places and (T, M) [m^2] squared distances, see `measure`."""
    frames, markers = result.chosen.shape
    places, squares = np.zeros((frames, markers, 3)), np.zeros((frames, markers))
    measure(sequence, tracker, result, places, squares)
    return places, squares


def usual_variance(squares: Floats, tracker: Tracker) -> Floats:
    """(M,) [m^2] of the markers' distances in this take, no less than calibrated.

    Four in five distances are shorter; a few ghosts do not matter to that.
    """
    rows = np.flatnonzero(np.isfinite(squares).any(axis=1))
    some = squares[rows[:: max(len(rows) // 500, 1)]]
    size = np.isfinite(some).sum(axis=0)
    if len(some) == 0:
        return tracker.variance
    order = np.sort(some, axis=0)  # NaN last
    at = np.maximum(np.ceil(0.8 * size).astype(int) - 1, 0)
    found = order[at, np.arange(some.shape[1])]
    return np.where(size > 0, np.fmax(tracker.variance, found), tracker.variance)
