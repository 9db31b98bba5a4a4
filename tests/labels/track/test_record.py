"""What a frame tells of its markers is written, and learnt."""

import numpy as np
import pytest

from handclean.labels.track.fit import measure_fit, observe_points
from handclean.labels.track.record import BIAS_SHARE, learn_marker, record_frame
from handclean.labels.track.state import (
    ABSENT,
    FOLLOWED,
    OUTLIER,
    REJECTED,
    RETURNED,
    empty_result,
)

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(("unseen", "share"), [(0, BIAS_SHARE), (4, 1.0)])
def test_a_bias_is_learnt_in_the_links_frame_at_once_after_a_gap(hand, unseen, share):
    stats = hand.stats(np.full(hand.markers, unseen))
    point, place = np.array([0.0, 0.003, 0.004]), np.zeros(3)
    square = learn_marker(2, place, TURN, point, stats, hand.setup.rules)
    assert square == pytest.approx(25e-6)
    np.testing.assert_allclose(stats.bias[2], share * np.array([0.003, 0.0, 0.004]))
    assert not np.delete(stats.bias, 2, axis=0).any()


def test_distances_are_learnt_in_their_averages(hand):
    stats = hand.stats()
    before = stats.usual.mean[2]
    for _ in range(30):
        point = np.array([0.0, 0.0, 0.002])
        learn_marker(2, np.zeros(3), TURN, point, stats, hand.setup.rules)
    assert stats.usual.mean[2] > 1.2 * before
    assert stats.usual.mean[3] == before


def test_each_marker_has_its_row_and_its_outcome(hand, sequence):
    pose = hand.pose()
    points = hand.points(pose)[0]
    unseen = np.zeros(hand.markers, dtype=int)
    unseen[1] = 3
    state, stats = hand.state(pose), hand.stats(unseen)
    state.chosen[:] = np.arange(hand.markers)
    observe_points(points, state.chosen, state.observed, state.weight)
    state.weight[[2, 3]] = 0.0
    state.role[3] = OUTLIER
    state.confidence[:] = 0.5
    fit = measure_fit(pose, state, hand.tracker)
    result = empty_result(2, hand.markers, len(hand.target.mean))
    take = sequence([points, points])
    record_frame(1, take, fit, state, stats, hand.tracker, result)
    expected = np.full(hand.markers, FOLLOWED)
    expected[1:4] = RETURNED, ABSENT, REJECTED
    np.testing.assert_array_equal(result.outcome[1], expected)
    rows = hand.markers + np.arange(hand.markers)
    rows[[2, 3]] = -1
    np.testing.assert_array_equal(result.chosen[1], rows)
    np.testing.assert_array_equal(result.confidence[1] > 0.0, rows >= 0)
    assert stats.unseen[:5].tolist() == [0, 0, 1, 1, 0]
    assert result.tracked.tolist() == [False, True]
    assert result.cost[1] == fit.cost
    assert result.rms[1] < 1e-9
    np.testing.assert_array_equal(result.pose[1], pose)
