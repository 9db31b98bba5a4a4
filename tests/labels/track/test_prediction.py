"""Where markers are expected, and how gates widen."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.labels.track import prediction
from handclean.labels.track.fit import place_markers
from handclean.labels.track.prediction import (
    MAX_DRIFT_PER_REACH,
    expected_places,
    freeze_unseen_hinges,
    learn_prediction_error,
    learn_velocity,
    predict_pose,
    prediction_variance,
)


def variance(hand, stats, frozen=None, gate_scale=1.0):
    """(M,) variance of the prediction; all hinges frozen unless told."""
    hinges = len(hand.target.mean)
    frozen = np.ones(hinges, dtype=bool) if frozen is None else frozen
    rules = hand.setup.rules
    return prediction_variance(frozen, stats, hand.tracker.chain, rules, gate_scale)


def test_a_pose_moves_on_by_its_velocity_and_stays_within_limits(hand):
    state = hand.state(hand.pose(0.5))
    state.velocity[:3], state.velocity[7:] = [1e-3, 0.0, -2e-3], 0.01
    limits = hand.tracker.chain.limits
    before = state.pose.copy()
    predict_pose(state, limits)
    np.testing.assert_allclose(
        state.pose[:3], before[:3] + np.array([1e-3, 0.0, -2e-3])
    )
    expected = np.clip(before[7:] + 0.01, limits[:, 0], limits[:, 1])
    np.testing.assert_allclose(state.pose[7:], expected)
    state.velocity[7:] = 10.0
    predict_pose(state, limits)
    np.testing.assert_array_equal(state.pose[7:], limits[:, 1])


def test_a_frozen_joint_stays_and_a_turned_root_keeps_its_length(hand):
    state = hand.state(hand.pose())
    state.frozen[:] = True
    state.velocity[3:7], state.velocity[7:] = [0.0, 0.1, 0.0, 0.0], 0.01
    before = state.pose.copy()
    predict_pose(state, hand.tracker.chain.limits)
    np.testing.assert_array_equal(state.pose[7:], before[7:])
    assert np.linalg.norm(state.pose[3:7]) == pytest.approx(1.0)
    assert state.pose[4] > 0.09


def test_markers_are_expected_beside_the_model_as_far_as_they_were(hand, rng):
    pose = hand.pose()
    pose[3:7] = np.roll(Rotation.random(rng=rng).as_quat(), 1)
    places, bias = np.zeros((hand.markers, 3)), np.zeros((hand.markers, 3))
    turns = place_markers(pose, hand.tracker, places)
    bias[4] = [1e-3, 2e-3, -3e-3]
    away = expected_places(pose, bias, hand.tracker) - places
    expected = np.zeros((hand.markers, 3))
    expected[4] = turns[hand.tracker.chain.link[4]] @ bias[4]
    np.testing.assert_allclose(away, expected, atol=1e-15)


def test_joints_are_frozen_beyond_which_no_marker_was_seen(hand):
    chain, frozen = hand.tracker.chain, np.zeros(len(hand.target.mean), dtype=bool)
    weight = np.ones(hand.markers)
    freeze_unseen_hinges(weight, chain, frozen)
    assert not frozen.any()
    weight[hand.finger("index")] = 0.0
    freeze_unseen_hinges(weight, chain, frozen)
    names = np.array(hand.target.model.tree.hinges)[frozen]
    assert len(names) > 0
    assert all(name.startswith("index") for name in names)


def test_gates_widen_by_their_scale_and_while_a_marker_is_out_of_sight(hand):
    seen = variance(hand, hand.stats())
    np.testing.assert_allclose(variance(hand, hand.stats(), gate_scale=2.0), 4.0 * seen)
    rules = hand.setup.rules
    for frames in (1, 5, 10):
        unseen = np.zeros(hand.markers, dtype=int)
        unseen[3] = frames
        now = variance(hand, hand.stats(unseen))
        drift = min(frames * rules.drift_m, MAX_DRIFT_PER_REACH * rules.reach_m)
        assert now[3] == pytest.approx(seen[3] + drift**2)
        np.testing.assert_array_equal(np.delete(now, 3), np.delete(seen, 3))


def test_gates_widen_less_where_markers_further_out_lead(hand):
    unseen = np.full(hand.markers, 10)
    free = np.zeros(len(hand.target.mean), dtype=bool)
    led, alone = (
        variance(hand, hand.stats(unseen), free),
        variance(hand, hand.stats(unseen)),
    )
    fingers = hand.tracker.branch > 0
    assert (led[fingers] < alone[fingers]).all()
    assert (led > variance(hand, hand.stats())).all()


def test_the_variance_of_a_prediction_grows_quickly_and_shrinks_slowly(hand):
    expected = hand.points(hand.pose())[0]
    state, stats = hand.state(hand.pose()), hand.stats()
    state.weight[:] = 1.0
    state.weight[5] = 0.0
    first = stats.error_variance.copy()
    state.observed[:] = expected
    state.observed[3] += 3.0 * np.sqrt(first[3])
    learn_prediction_error(expected, state, stats, hand.setup.rules.min_error_m)
    ratio = stats.error_variance / first
    assert ratio[3] == pytest.approx(1.0 + 0.2 * 8.0)
    assert ratio[5] == 1.0
    np.testing.assert_allclose(np.delete(ratio, [3, 5]), 0.97)


def test_one_wild_point_counts_as_a_multiple_of_the_usual_error_at_most(hand):
    expected = hand.points(hand.pose())[0]
    state, stats = hand.state(hand.pose()), hand.stats()
    state.weight[:] = 1.0
    first = stats.error_variance.copy()
    state.observed[:] = expected
    state.observed[3] += 1.0  # [m]
    least = hand.setup.rules.min_error_m
    learn_prediction_error(expected, state, stats, least)
    most = prediction.MAX_ERROR_RATIO * first[3] + least**2
    grown = first[3] + prediction.GROWING_ERROR_SHARE * (most - first[3])
    assert stats.error_variance[3] == pytest.approx(grown)


def test_a_steady_motion_is_predicted_and_a_trembling_one_is_not(hand, rng):
    steady, trembling = hand.state(hand.pose()), hand.state(hand.pose())
    for _ in range(60):
        for state, step in (
            (steady, np.array([1e-3, 0.0, 0.0])),
            (trembling, rng.normal(scale=1e-3, size=3)),
        ):
            state.last_pose[:] = state.pose
            state.pose[:3] += step
            learn_velocity(state, 0.4)
    np.testing.assert_allclose(steady.velocity[:3], [1e-3, 0.0, 0.0], atol=1e-12)
    assert steady.progress.velocity_share > 0.95
    assert trembling.progress.velocity_share < 0.3


def test_a_joint_that_jumped_has_no_velocity_and_a_flipped_quaternion_is_no_turn(hand):
    state = hand.state(hand.pose())
    state.pose[7], state.pose[8] = state.pose[7] + 0.5, state.pose[8] + 0.3
    state.pose[3:7] *= -1.0
    learn_velocity(state, 0.4)
    assert state.velocity[7] == 0.0
    assert state.velocity[8] == pytest.approx(0.3)
    np.testing.assert_array_equal(state.velocity[3:7], np.zeros(4))
