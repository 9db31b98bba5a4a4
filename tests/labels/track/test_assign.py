"""Points are assigned where that is likeliest, within gates, as links tell."""

import numpy as np
import pytest

from handclean.labels.track.assign import (
    FOUND_SHARE,
    assign_points,
    most_are_found,
    newcomer_confidence,
    pair_costs,
    rate_labels,
    reassign_missing,
    select_anchors,
)
from handclean.labels.track.state import ANCHOR, NEWCOMER, PairCosts
from handclean.labels.track.tracker import REFERENCE_ERROR_M


def assigned(hand, sequence, points, previous=None, rows=None, trust=0.9):
    """Which point each marker gets that is expected where a pose puts it."""
    state, stats = hand.state(hand.pose()), hand.stats()
    state.progress.link_trust = trust
    if rows is not None:
        state.last_row[:] = rows
    expected = hand.points(hand.pose())[0]
    take = sequence([points], previous)
    assign_points(0, take, expected, state, stats, hand.tracker)
    return state.chosen.copy()


def test_the_cost_of_a_pair_is_the_likelihood_against_a_ghost(hand):
    points, places = np.array([[3e-3, 0.0, 0.0]]), np.zeros((1, 3))
    variance, rules = np.array([4e-6]), hand.setup.rules
    seen = pair_costs(points, places, variance, np.array([0]), rules)
    expected = 9.0 / 4.0 + 3.0 * np.log(4e-6 / REFERENCE_ERROR_M**2)
    assert seen.pair[0, 0] == pytest.approx(expected)
    assert seen.no_point[0] == rules.seen_price
    unseen = pair_costs(points, places, variance, np.array([5]), rules)
    assert unseen.no_point[0] == rules.unseen_price < rules.seen_price


def test_a_pair_that_costs_more_than_no_point_is_beyond_the_gate(hand):
    rules, variance = hand.setup.rules, np.array([1e-6])
    size = 3.0 * np.log(1e-6 / REFERENCE_ERROR_M**2)
    gate = np.sqrt((rules.seen_price - size) * 1e-6)
    points = np.array([[0.99 * gate, 0.0, 0.0], [1.01 * gate, 0.0, 0.0]])
    costs = pair_costs(points, np.zeros((1, 3)), variance, np.array([0]), rules).pair[0]
    assert costs[0] < rules.seen_price
    assert costs[1] == np.inf


def test_no_marker_reappears_beyond_its_reach(hand):
    rules, wide = hand.setup.rules, np.array([1.0])
    points = np.array([[0.99, 0, 0], [1.01, 0, 0]]) * rules.reach_m
    costs = pair_costs(points, np.zeros((1, 3)), wide, np.array([9]), rules).pair[0]
    assert np.isfinite(costs[0]) or rules.unseen_price < costs[0]
    assert costs[1] == np.inf


def test_a_label_without_rivals_is_as_sure_as_it_is_no_ghost():
    pairs, sure = (
        PairCosts(np.array([[2.0]]), np.array([10.0])),
        np.zeros(1, np.float32),
    )
    rate_labels(pairs, np.array([0]), sure)
    assert sure[0] == pytest.approx(1.0 / (1.0 + np.exp(-4.0)))


def test_what_makes_a_label_doubtful_lowers_its_confidence():
    inf = np.inf

    def confidence(pair):
        sure = np.zeros(2, np.float32)
        pairs = PairCosts(np.array(pair), np.array([20.0, 20.0]))
        rate_labels(pairs, np.array([0, 1]), sure)
        return sure[0]

    alone = confidence([[0.0, inf, inf], [inf, 0.0, inf]])
    free_point = confidence([[0.0, inf, 2.0], [inf, 0.0, inf]])
    exchange = confidence([[0.0, 1.0, inf], [1.0, 0.0, inf]])
    assert alone > 0.999
    assert free_point == pytest.approx(1.0 / (1.0 + np.exp(-1.0)), abs=1e-3)
    assert exchange == pytest.approx(1.0 / (1.0 + np.exp(-1.0)), abs=1e-3)


def test_only_what_another_point_costs_more_makes_a_label_doubtful():
    """All costs may have the same number added: a density has no zero."""
    sure = np.zeros(1, np.float32)
    for more in (0.0, 5.0):
        pairs = PairCosts(np.array([[1.0, 4.0]]) + more, np.array([3.0 + more]))
        rate_labels(pairs, np.array([0]), sure)
        right = 1.0 / (1.0 + np.exp(-0.5 * 2.0) + np.exp(-0.5 * 3.0))
        assert sure[0] == pytest.approx(right)


def test_a_newcomer_is_as_sure_as_no_other_point_is_near():
    pairs = PairCosts(np.array([[1.0, 3.0, np.inf]]), np.array([5.0]))
    expected = 1.0 / (1.0 + np.exp(-1.0) + np.exp(-2.0))
    assert newcomer_confidence(pairs, 0, 0) == pytest.approx(expected)


def test_points_go_to_the_markers_expected_there_whatever_their_order(
    hand, sequence, rng
):
    points = hand.points(hand.pose())[0]
    order = rng.permutation(hand.markers)
    chosen = assigned(hand, sequence, points[order])
    np.testing.assert_array_equal(order[chosen], np.arange(hand.markers))


def test_a_point_of_no_marker_is_left(hand, sequence):
    points = hand.points(hand.pose())[0]
    points[4] += 0.2
    assert assigned(hand, sequence, points)[4] == -1


def test_links_decide_where_the_prediction_does_not(hand, sequence):
    """Two points between two markers, each a little nearer to the wrong one."""
    points = hand.points(hand.pose())[0]
    near = np.linalg.norm(points[0] - points, axis=1)
    other = int(np.argsort(near)[1])
    middle, apart = (points[0] + points[other]) / 2.0, points[other] - points[0]
    points[0], points[other] = middle + 0.005 * apart, middle - 0.005 * apart
    rows = 100 + np.arange(hand.markers)
    alone = assigned(hand, sequence, points)
    linked = assigned(hand, sequence, points, rows, rows, trust=0.98)
    assert (alone[0], alone[other]) == (other, 0)
    assert (linked[0], linked[other]) == (0, other)


def test_gates_widen_when_most_markers_find_no_point(hand, sequence):
    points = hand.points(hand.pose())[0]
    thin = np.linalg.svd(points - points.mean(axis=0))[2][2]  # out of the palm
    few = points.copy()
    few[:6] += 0.02 * thin
    assert (assigned(hand, sequence, few)[:6] < 0).all()
    found = assigned(hand, sequence, points + 0.02 * thin)
    np.testing.assert_array_equal(found, np.arange(hand.markers))


def test_most_are_found_counts_the_markers_seen_before():
    assert pytest.approx(2.0 / 3.0) == FOUND_SHARE
    chosen = np.array([0, 1, -1, -1])
    assert most_are_found(chosen, np.array([0, 0, 0, 4]))
    assert not most_are_found(chosen, np.array([0, 0, 0, 0]))


def test_markers_seen_before_hold_the_model_and_others_are_on_trial(hand):
    state, points = hand.state(hand.pose()), hand.points(hand.pose())[0]
    state.chosen[:] = np.arange(hand.markers)
    state.chosen[0] = -1
    unseen = np.zeros(hand.markers, dtype=int)
    unseen[1] = 3
    assert select_anchors(points, state, unseen) == hand.markers - 2
    assert state.weight[:3].tolist() == [0.0, 0.0, 1.0]
    np.testing.assert_array_equal(state.observed[1:], points[1:])


def test_where_too_few_were_seen_before_all_hold_the_model(hand):
    state, points = hand.state(hand.pose()), hand.points(hand.pose())[0]
    state.chosen[:] = np.arange(hand.markers)
    unseen = np.full(hand.markers, 3)
    unseen[:3] = 0
    assert select_anchors(points, state, unseen) == hand.markers
    assert (state.weight == 1.0).all()
    assert state.role[:4].tolist() == [ANCHOR, ANCHOR, ANCHOR, NEWCOMER]


def test_markers_without_a_point_get_one_that_is_left(hand):
    state, points = hand.state(hand.pose()), hand.points(hand.pose())[0]
    state.chosen[:], state.weight[:] = np.arange(hand.markers), 1.0
    state.weight[[2, 9]] = 0.0
    points[9] += 0.2  # not there
    reassign_missing(points, state, hand.stats(), hand.tracker)
    assert state.chosen[2] == 2
    assert state.role[2] == NEWCOMER
    assert state.confidence[2] > 0.5
    assert state.chosen[9] == -1
    others = np.delete(np.arange(hand.markers), [2, 9])
    np.testing.assert_array_equal(state.chosen[others], others)
