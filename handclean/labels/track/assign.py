"""Which point each marker has: the costs of pairs, their assignment, its confidence.

The cost of a pair is minus twice the logarithm of how much likelier the point is as
that marker than as a ghost,

    d^2 / s^2 + 3 ln(s^2 / s0^2),         cost of no point: 2 ln(odds / ghosts)

with d the distance from where the marker is expected and s its prediction error per
axis. A marker out of sight has an s that grows, and lower odds. Where a pair would cost
more than no point is the gate (Maycock 2015 section III-B).
"""

import math

import numpy as np

from handclean.arrays import Floats, Floats32, Ints
from handclean.kernels import jit
from handclean.labels.track.fit import MIN_POINTS
from handclean.labels.track.links import add_link_costs
from handclean.labels.track.prediction import expected_places, prediction_variance
from handclean.labels.track.state import (
    ANCHOR,
    NEWCOMER,
    FrameSequence,
    FrameState,
    MarkerStats,
    PairCosts,
    frame_points,
)
from handclean.labels.track.tracker import REFERENCE_ERROR_M, Tracker, TrackRules
from handclean.numerics.assignment import NO_POINT, assign_rows

GATE_SCALE_STEP, MAX_GATE_SCALE = 2.5, 6.25
"""By how much all gates widen where too few markers find a point, and how far at most.
Chosen."""

FOUND_SHARE = 2.0 / 3.0
"""Share of the markers seen before that must find a point, or the gates widen.
Chosen."""

MISSING_GATE_SCALE = 1.5
"""By how much the gates are wider for markers that are assigned a second time.
Chosen."""


@jit
def pair_costs(
    points: Floats,
    places: Floats,
    variance: Floats,
    unseen: Ints,
    rules: TrackRules,
) -> PairCosts:
    """Return the costs of all pairs of a marker and a point, and of no point.

    Parameters
    ----------
    points : (P, 3) [m]
    places : (M, 3) [m] where the markers are expected.
    variance : (M,) [m^2] of that, per axis.
    unseen : (M,) frames out of sight.
    """
    markers = places.shape[0]
    pair, no_point = np.zeros((markers, points.shape[0])), np.zeros(markers)
    for m in range(markers):
        is_unseen = unseen[m] > 0
        no_point[m] = rules.unseen_price if is_unseen else rules.seen_price
        size = 3.0 * math.log(variance[m] / (REFERENCE_ERROR_M * REFERENCE_ERROR_M))
        gate2 = (no_point[m] - size) * variance[m]
        if is_unseen:
            gate2 = min(gate2, rules.reach_m * rules.reach_m)
        x, y, z = places[m, 0], places[m, 1], places[m, 2]
        for p in range(points.shape[0]):
            a, b, c = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
            d2 = a * a + b * b + c * c
            pair[m, p] = d2 / variance[m] + size if d2 < gate2 else math.inf
    return PairCosts(pair, no_point)


@jit
def rate_labels(pairs: PairCosts, chosen: Ints, confidence: Floats32) -> None:
    """Write (M,) how likely each label is right.

    Against it stand: the point is a ghost; another free point is the marker; two
    markers have changed places.
    """
    pair, no_point = pairs.pair, pairs.no_point
    owner = np.full(pair.shape[1], -1)
    for m in range(chosen.shape[0]):
        if chosen[m] >= 0:
            owner[chosen[m]] = m
    for m in range(chosen.shape[0]):
        p = chosen[m]
        confidence[m] = 0.0
        if p < 0 or pair[m, p] == math.inf:
            continue
        against = math.exp(-0.5 * max(no_point[m] - pair[m, p], 0.0))
        for q in range(pair.shape[1]):
            if q == p or pair[m, q] == math.inf:
                continue
            more = pair[m, q] - pair[m, p]
            other = owner[q]
            if other >= 0 and pair[other, q] < math.inf:
                more += min(pair[other, p], no_point[other]) - pair[other, q]
            against += math.exp(-0.5 * max(more, 0.0))
        confidence[m] = 1.0 / (1.0 + against)


@jit
def most_are_found(chosen: Ints, unseen: Ints) -> bool:
    """Whether at least `FOUND_SHARE` of the markers seen before have a point."""
    seen, found = 0, 0
    for m in range(chosen.shape[0]):
        if unseen[m] == 0:
            seen += 1
            found += 1 if chosen[m] >= 0 else 0
    return found >= FOUND_SHARE * seen


@jit
def assign_points(
    t: int,
    sequence: FrameSequence,
    expected: Floats,
    state: FrameState,
    stats: MarkerStats,
    tracker: Tracker,
) -> PairCosts:
    """Assign a frame's points to the markers; widen the gates if few find one.

    Parameters
    ----------
    expected : (M, 3) [m] where the markers are expected.
    state : its chosen is overwritten.

    Returns
    -------
    The costs that decided.
    """
    points = frame_points(sequence, t)
    previous = sequence.previous[sequence.start[t] : sequence.start[t + 1]]
    chain, rules, gate_scale = tracker.chain, tracker.rules, 1.0
    while True:
        variance = prediction_variance(state.frozen, stats, chain, rules, gate_scale)
        pairs = pair_costs(points, expected, variance, stats.unseen, rules)
        add_link_costs(previous, pairs, state, stats.unseen)
        assign_rows(pairs.pair, pairs.no_point, state.chosen)
        if gate_scale >= MAX_GATE_SCALE or most_are_found(state.chosen, stats.unseen):
            return pairs
        gate_scale *= GATE_SCALE_STEP


@jit
def select_anchors(points: Floats, state: FrameState, unseen: Ints) -> int:
    """Choose the markers that hold the model: those with a point that were seen before.

    Markers that reappear are on trial (`NEWCOMER`). Where fewer than `MIN_POINTS` were
    seen before, they hold the model at once.

    Returns
    -------
    How many markers hold the model.
    """
    count, newcomers = 0, 0
    for m in range(state.chosen.shape[0]):
        state.role[m], state.weight[m] = ANCHOR, 0.0
        if state.chosen[m] < 0:
            continue
        state.observed[m] = points[state.chosen[m]]
        if unseen[m] > 0:
            newcomers += 1
        else:
            state.weight[m] = 1.0
            count += 1
    if count < MIN_POINTS:
        count += newcomers
        for m in range(state.chosen.shape[0]):
            if state.chosen[m] >= 0:
                state.weight[m] = 1.0
                state.role[m] = NEWCOMER if unseen[m] > 0 else ANCHOR
    return count


@jit
def reassign_missing(
    points: Floats, state: FrameState, stats: MarkerStats, tracker: Tracker
) -> None:
    """Assign the points that are left to the markers that are left, as newcomers.

    They are expected where the pose of this frame, rather than the last, puts them.
    """
    chosen, markers = state.chosen, state.weight.shape[0]
    missing = 0
    for m in range(markers):
        if state.weight[m] <= 0.0:
            missing += 1
            chosen[m] = NO_POINT
    if missing == 0 or markers - missing >= points.shape[0]:
        return
    places = expected_places(state.pose, stats.bias, tracker)
    variance = prediction_variance(
        state.frozen, stats, tracker.chain, tracker.rules, MISSING_GATE_SCALE
    )
    pairs = pair_costs(points, places, variance, stats.unseen, tracker.rules)
    for m in range(markers):
        if chosen[m] >= 0:
            pairs.pair[m, :] = math.inf
            pairs.pair[:, chosen[m]] = math.inf
    found = chosen.copy()
    assign_rows(pairs.pair, pairs.no_point, found)
    for m in range(markers):
        if chosen[m] < 0 and found[m] >= 0:
            chosen[m] = found[m]
            state.observed[m] = points[found[m]]
            state.role[m] = NEWCOMER
            state.confidence[m] = newcomer_confidence(pairs, m, found[m])


@jit
def newcomer_confidence(pairs: PairCosts, m: int, p: int) -> float:
    """Return how likely marker m is point p, rather than another or none."""
    cost, against = pairs.pair[m, p], 0.0
    for q in range(pairs.pair.shape[1]):
        if q != p and pairs.pair[m, q] < math.inf:
            against += math.exp(-0.5 * max(pairs.pair[m, q] - cost, 0.0))
    against += math.exp(-0.5 * (pairs.no_point[m] - cost))
    return 1.0 / (1.0 + against)
