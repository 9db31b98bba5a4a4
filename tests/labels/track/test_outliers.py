"""Points too far from the model are refused, and those that reappear are tried."""

import numpy as np
import pytest

from handclean.labels.track.fit import PointFit, observe_points
from handclean.labels.track.outliers import (
    accept_reappearing,
    count_lost,
    find_outlier,
    is_poor_fit,
    reject_outliers,
)
from handclean.labels.track.residual_gate import FOLLOWED_GATE_FACTOR, threshold
from handclean.labels.track.state import ANCHOR, NEWCOMER, OUTLIER


def fit_of(squares):
    squares = np.asarray(squares, dtype=float)
    return PointFit(squares, 0.0, int(np.isfinite(squares).sum()))


def followed(hand, pose, points):
    """A state in which every marker holds the model with the point of its row."""
    state = hand.state(pose)
    state.chosen[:] = np.arange(hand.markers)
    observe_points(points, state.chosen, state.observed, state.weight)
    return state


@pytest.fixture
def gate(hand):
    rules = hand.setup.rules
    return threshold(hand.stats().usual, 0, rules.strict, rules.small_m)


def outlier(hand, distances, newcomers=()):
    role = np.full(hand.markers, ANCHOR)
    role[list(newcomers)] = NEWCOMER
    squares = np.zeros(hand.markers)
    for m, distance in distances.items():
        squares[m] = distance**2
    stats, rules = hand.stats(), hand.setup.rules
    return find_outlier(fit_of(squares), role, stats.usual, rules)


def test_the_farthest_marker_beyond_its_threshold_is_the_outlier(hand, gate):
    wide = FOLLOWED_GATE_FACTOR * gate
    assert outlier(hand, {}) == -1
    assert outlier(hand, {2: 0.99 * wide}) == -1
    assert outlier(hand, {2: 1.01 * wide, 5: 1.02 * wide}) == 5
    assert outlier(hand, {2: np.nan}) == -1


def test_newcomers_have_a_narrower_gate_and_go_first(hand, gate):
    wide = FOLLOWED_GATE_FACTOR * gate
    assert outlier(hand, {2: 0.99 * gate}, newcomers=[2]) == -1
    assert outlier(hand, {2: 1.01 * gate}, newcomers=[2]) == 2
    assert outlier(hand, {2: 0.5 * gate, 5: 1.5 * wide}, newcomers=[2]) == 2


def test_a_point_far_from_the_model_is_rejected_and_no_other(hand):
    pose = hand.pose()
    points = hand.points(pose)[0]
    points[11] += [0.0, 0.03, 0.03]
    state = followed(hand, pose, points)
    fit = reject_outliers(state, hand.stats(), hand.tracker)
    assert np.flatnonzero(state.weight == 0.0).tolist() == [11]
    assert state.role[11] == OUTLIER
    assert fit.assigned == hand.markers - 1
    assert np.nanmax(fit.squares) < 1e-8


def test_points_that_fit_are_all_kept(hand, rng):
    pose = hand.pose()
    points = hand.points(pose)[0] + rng.normal(scale=3e-4, size=(hand.markers, 3))
    state = followed(hand, pose, points)
    assert reject_outliers(state, hand.stats(), hand.tracker).assigned == hand.markers


@pytest.mark.parametrize(("away", "kept"), [(0.0, True), (0.04, False)])
def test_a_marker_that_reappears_is_accepted_where_it_fits(hand, away, kept):
    pose = hand.pose()
    points = hand.points(pose)[0]
    points[11] += away
    state = followed(hand, pose, points)
    state.weight[11], state.role[11] = 0.0, NEWCOMER
    fit = accept_reappearing(state, hand.stats(), hand.tracker)
    assert (state.weight[11] > 0.0) == kept
    assert fit.assigned == hand.markers - (not kept)
    np.testing.assert_allclose(state.pose, pose, atol=1e-3)


def test_a_fit_is_poor_if_it_is_clearly_worse_than_usual(hand):
    stats, rules = hand.stats(), hand.setup.rules
    usual = np.sqrt(stats.usual.mean[0] ** 2 + stats.usual.variance[0])
    most = 1.6 * usual + rules.small_m
    near = np.full(hand.markers, (0.99 * most) ** 2)
    far = np.full(hand.markers, (1.01 * most) ** 2)
    near[:4], far[:4] = np.nan, np.nan
    assert not is_poor_fit(fit_of(near), stats.usual, rules)
    assert is_poor_fit(fit_of(far), stats.usual, rules)
    assert is_poor_fit(fit_of(np.full(hand.markers, np.nan)), stats.usual, rules)


def test_lost_markers_are_those_seen_before_without_a_point_now():
    unseen = np.array([0, 0, 3, 3])
    assert count_lost(fit_of([np.nan, 0.0, np.nan, 0.0]), unseen) == 1
