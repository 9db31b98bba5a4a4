"""Where the fit is worse than it should be: look again, follow from there, compare.

Following can go wrong for a while - two fingers change places in a fast movement - and
the cost of every frame says so, long before or after the tracker notices. The worst
frames are looked at on their own, first from the pose they have, with fingers exchanged
and reaching out; then as if nothing were known. From a better fit the hand is followed
both ways, and takes over as far as it stays better in sum.
"""

import math

import numpy as np

from handclean.arrays import Floats
from handclean.labels.review.suppose import measured
from handclean.labels.review.suspects import (
    AROUND,
    EXPECTED,
    count_spare,
    mean_cost,
    suspicious,
)
from handclean.labels.search.align import SearchEffort, search_frame
from handclean.labels.target import TrackTarget
from handclean.labels.track.alternatives import (
    MIN_GAIN,
    exchange_fingers,
    restart_finger,
    search_missing_fingers,
)
from handclean.labels.track.fit import (
    MISSING_COST,
    PointFit,
    assign_and_solve,
    closed_gate,
    measure_fit,
    observe_points,
    solve_pose,
)
from handclean.labels.track.frames import track_frames
from handclean.labels.track.state import (
    FrameSequence,
    FrameState,
    TrackResult,
    empty_result,
    frame_points,
    new_state,
    start_stats,
)
from handclean.labels.track.tracker import Tracker, TrackSetup

SUSPECTS, STRANGERS = 30, 6
"""How many bad frames are looked at again, at most; how many as if nothing were known,
one and another for every ``2 * EACH`` frames (chosen)."""

MAX_FAILED_LOOKS = 8
"""Looks without success in a row after which no more are taken, at most (chosen)."""

EACH = 1000
"""Frames that add one to the looks without success that are allowed, from two on
(chosen)."""

STRANGE_COST_PER_MARKER = 2.5
"""Cost per assigned marker at which nothing that is known may be right (chosen)."""

STRETCH = 200
"""Frames that are followed before it is asked whether to go on (chosen)."""


def amend(
    t: int,
    sequence: FrameSequence,
    state: FrameState,
    tracker: Tracker,
    result: TrackResult,
) -> float:
    """Look for a better fit of one frame near the one it has; it is left in ``s``.

    Returns
    -------
    What the fit is worth.
    """
    begin = sequence.start[t]
    points = sequence.at[begin : sequence.start[t + 1]]
    state.chosen[:] = np.where(result.chosen[t] >= 0, result.chosen[t] - begin, -1)
    state.pose[:] = result.pose[t]
    if observe_points(points, state.chosen, state.observed, state.weight) < 4:
        return math.inf
    cost = measure_fit(state.pose, state, tracker).cost
    state.trial_pose[:] = state.pose
    chosen = state.chosen.copy()
    found = assign_and_solve(
        state.trial_pose, points, state, tracker, tracker.no_basis,
        tracker.rules.reach_m, closed_gate(tracker.variance),
    )  # fmt: skip
    if found < cost:
        cost = found
        state.pose[:] = state.trial_pose
    else:
        state.chosen[:] = chosen
    observe_points(points, state.chosen, state.observed, state.weight)
    fit = solve_pose(state.pose, tracker.no_basis, state, tracker)
    for branch in poor_fingers(fit, state, tracker):
        fit = restart_finger(state.pose, branch, fit, state, tracker)
        cost = fit.cost
    gate_m = 2.0 * tracker.rules.reach_m
    cost = search_missing_fingers(state.pose, points, state, tracker, gate_m, cost)
    return float(exchange_fingers(state.pose, points, state, tracker, cost))


def poor_fingers(fit: PointFit, state: FrameState, tracker: Tracker) -> list[int]:
    """Fingers that fit worse than is expected of their markers."""
    weight, branch = state.weight, tracker.branch
    squares = np.nan_to_num(fit.squares)
    cost = np.where(
        weight > 0.0, np.fmin(squares / tracker.variance, MISSING_COST), 0.0
    )
    mean = [
        cost[branch == finger].sum() / max(weight[branch == finger].sum(), 1)
        for finger in range(1, int(branch.max(initial=0)) + 1)
    ]
    return [n + 1 for n, value in enumerate(mean) if value > EXPECTED]


def repair(
    ways: tuple[FrameSequence, FrameSequence],
    target: TrackTarget,
    tracker: Tracker,
    setup: TrackSetup,
    result: TrackResult,
) -> list[tuple[int, int]]:
    """Replace stretches of a result by better ones, in place.

    Parameters
    ----------
    ways : the take followed forwards, and backwards.

    Returns
    -------
    First frame and frame after the last of every stretch replaced.
    """
    done: list[tuple[int, int]] = []
    state = new_state(len(target.sigma), len(target.mean))
    places, squares = measured(ways[0], tracker, result)
    fit, spare = mean_cost(squares, tracker), np.zeros(len(result.tracked))
    count_spare(ways[0], result, places, spare)
    excess = suspicious(fit, spare, len(target.sigma))
    usual, strangers = float(np.median(fit[np.isfinite(fit)])), 0
    failed, most = 0, min(2 + len(fit) // EACH, MAX_FAILED_LOOKS)
    for _ in range(SUSPECTS):
        t = int(np.argmax(excess))
        if excess[t] <= 0.0 or failed >= most:
            break
        cost = amend(t, ways[0], state, tracker, result)
        strange = fit[t] > STRANGE_COST_PER_MARKER * max(usual, 1.0) or spare[t] > 2.0
        if (
            cost > result.cost[t] - MIN_GAIN
            and strange
            and strangers < min(1 + len(fit) // (2 * EACH), STRANGERS)
        ):
            strangers += 1
            cost = _stranger(t, ways[0], target, tracker, setup, state)
        a, b = t, t + 1
        if cost < result.cost[t] - MIN_GAIN:
            a, b = _take_over(t, ways, target, tracker, state, result)
            if b > a:
                done.append((a, b))
        failed = 0 if b > a + 1 else failed + 1
        excess[max(min(a, t) - AROUND, 0) : max(b, t) + 1 + AROUND] = 0.0
    return done


def _stranger(
    t: int,
    sequence: FrameSequence,
    target: TrackTarget,
    tracker: Tracker,
    setup: TrackSetup,
    state: FrameState,
) -> float:
    """Find the hand in a frame as if nothing were known; return what it is worth."""
    points = frame_points(sequence, t)
    effort = SearchEffort(postures=len(target.starts), rotations=30, kept=30)
    fits = search_frame(points, target, t, setup, effort)
    if not fits:
        return math.inf
    state.pose[:], state.chosen[:] = fits[0].pose, fits[0].chosen
    observe_points(points, state.chosen, state.observed, state.weight)
    return float(measure_fit(state.pose, state, tracker).cost)


def _take_over(
    t: int,
    ways: tuple[FrameSequence, FrameSequence],
    target: TrackTarget,
    tracker: Tracker,
    found: FrameState,
    result: TrackResult,
) -> tuple[int, int]:
    """Follow a better fit both ways, as far as it stays better in sum.

    Returns
    -------
    The first frame replaced, and the one after the last.
    """
    frames, markers = result.chosen.shape
    other = empty_result(frames, markers, len(target.mean))
    edges = []
    for sequence, by in zip(ways, (1, -1), strict=True):
        state = new_state(markers, len(target.mean))
        state.pose[:] = found.pose
        gone = (found.chosen < 0).astype(np.int64)
        stats = start_stats(target, tracker.rules, gone)
        here, best, gain, edge = t, 0.0, 0.0, t
        end = frames if by > 0 else -1
        while here != end:
            stop = min(here + STRETCH, frames) if by > 0 else max(here - STRETCH, -1)
            reached = int(
                track_frames(sequence, here, stop, by, state, stats, tracker, other)
            )
            rows = np.arange(here, reached, by)
            gains = gain + np.cumsum(
                _known(result.cost[rows]) - _known(other.cost[rows])
            )
            if len(rows) and gains.max() > best:
                best, edge = float(gains.max()), int(rows[np.argmax(gains)]) + by
            if len(rows) == 0 or reached != stop or edge != stop:
                break
            gain, here = float(gains[-1]), stop
        edges.append(edge)
    if edges == [t, t]:
        return t, t
    a, b = min(edges[1] + 1, t), max(edges[0], t + 1)
    for name in TrackResult._fields:
        getattr(result, name)[a:b] = getattr(other, name)[a:b]
    return a, b


def _known(cost: Floats) -> Floats:
    """Costs, with a high one where there is none."""
    return np.where(np.isfinite(cost), cost, 1e3)
