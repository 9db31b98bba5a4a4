"""A pose fitted to points: its cost, the assignment, and what does not change it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.labels.track.fit import (
    MIN_GATE_M,
    MISSING_COST,
    assign_and_solve,
    closed_gate,
    fit_cost,
    gated_squares,
    measure_fit,
    no_fit,
    observe_points,
    place_markers,
    solve_pose,
)

GATE_M = 0.05


def observed(hand, pose, points):
    """A state in which every marker has the point of its own row."""
    state = hand.state(pose)
    state.chosen[:] = np.arange(hand.markers)
    observe_points(points, state.chosen, state.observed, state.weight)
    return state


def fitted(hand, pose, points):
    """Pose, assignment and cost from a start."""
    state, pose = hand.state(pose), pose.copy()
    tracker = hand.tracker
    least = closed_gate(tracker.variance)
    cost = assign_and_solve(pose, points, state, tracker, tracker.basis, GATE_M, least)
    return pose, state.chosen.copy(), cost


def test_markers_are_placed_where_the_model_puts_them(hand):
    pose, places = hand.pose(0.4), np.zeros((hand.markers, 3))
    turns = place_markers(pose, hand.tracker, places)
    np.testing.assert_allclose(places, hand.points(pose)[0], atol=1e-12)
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, 1, 2), np.tile(np.eye(3), (len(turns), 1, 1)),
        atol=1e-12,
    )  # fmt: skip


def test_the_cost_of_a_fit_counts_far_and_missing_markers_alike():
    variance = np.array([1.0, 4.0, 1.0, 1.0])
    squares = np.array([0.5, 8.0, 100.0, np.nan])
    assert fit_cost(squares, variance) == 0.5 + 2.0 + 2.0 * MISSING_COST


def test_a_fit_is_measured_marker_by_marker(hand):
    pose = hand.pose()
    points = hand.points(pose)[0]
    points[3] += [0.003, 0.0, 0.004]
    state = observed(hand, pose, points)
    state.weight[7] = 0.0
    fit = measure_fit(pose, state, hand.tracker)
    expected = np.zeros(hand.markers)
    expected[3], expected[7] = 25e-6, np.nan
    np.testing.assert_allclose(fit.squares, expected, atol=1e-12)
    assert fit.assigned == hand.markers - 1
    cost = 25e-6 / hand.tracker.variance[3] + MISSING_COST
    assert fit.cost == pytest.approx(min(cost, 2.0 * MISSING_COST))


def test_no_fit_costs_more_than_any():
    fit = no_fit(3)
    assert fit.cost == np.inf
    assert fit.assigned == 0
    assert np.isnan(fit.squares).all()


def test_squares_beyond_the_gate_are_infinite():
    places, points = np.zeros((1, 3)), np.array([[0.0, 0.3, 0.4], [0.6, 0.0, 0.0]])
    out = np.zeros((1, 2))
    gated_squares(places, points, 0.55, out)
    np.testing.assert_allclose(out, [[0.25, np.inf]])


def test_a_gate_closes_no_further_than_the_markers_stray():
    assert closed_gate(np.array([1e-8])) == MIN_GATE_M
    assert closed_gate(np.array([1e-6, 1e-4])) == pytest.approx(0.03)


def test_a_pose_is_solved_for_from_its_points(hand):
    truth, pose = hand.pose(0.4), hand.pose(0.3, (0.11, 0.2, 0.3))
    state = observed(hand, pose, hand.points(truth)[0])
    fit = solve_pose(pose, hand.tracker.no_basis, state, hand.tracker)
    assert fit.cost < 1e-3
    np.testing.assert_allclose(pose[:3], truth[:3], atol=1e-4)


def test_which_joints_are_open_is_tested_again_when_other_markers_are_seen(hand):
    pose = hand.pose()
    state = observed(hand, pose, hand.points(pose)[0])
    solve_pose(pose, hand.tracker.no_basis, state, hand.tracker)
    assert not state.is_open.any()
    state.weight[hand.finger("index")] = 0.0
    solve_pose(pose, hand.tracker.no_basis, state, hand.tracker)
    assert state.is_open.any()


def test_points_are_assigned_and_the_pose_found_from_a_start_nearby(hand, rng):
    truth, start = hand.pose(0.4), hand.pose(0.33, (0.104, 0.197, 0.3))
    order = rng.permutation(hand.markers)
    points = hand.points(truth)[0][order]
    ghosts = points[:3] + 0.03
    pose, chosen, cost = fitted(hand, start, np.concatenate([points, ghosts]))
    np.testing.assert_array_equal(order[chosen], np.arange(hand.markers))
    assert cost < 1e-3
    assert np.linalg.norm(hand.points(pose) - hand.points(truth), axis=2).max() < 1e-4


def test_a_missing_point_leaves_its_marker_without_one(hand):
    truth = hand.pose()
    points = np.delete(hand.points(truth)[0], 5, axis=0)
    _, chosen, cost = fitted(hand, truth, points)
    assert chosen[5] == -1
    assert (np.delete(chosen, 5) == np.arange(hand.markers - 1)).all()
    assert cost == pytest.approx(MISSING_COST, abs=1e-3)


def test_three_points_are_no_fit(hand):
    points = hand.points(hand.pose())[0][:3]
    assert fitted(hand, hand.pose(), points)[2] == np.inf


def test_the_order_of_points_does_not_matter(hand, rng):
    start, points = hand.pose(0.2), hand.points(hand.pose(0.35))[0]
    order = rng.permutation(hand.markers)
    pose, chosen, cost = fitted(hand, start, points)
    again, other, same = fitted(hand, start, points[order])
    np.testing.assert_array_equal(order[other], chosen)
    np.testing.assert_array_equal(again, pose)
    assert same == cost


def test_the_fit_moves_with_everything(hand, rng):
    start, points = hand.pose(0.2), hand.points(hand.pose(0.35))[0]
    turn, shift = Rotation.random(rng=rng), np.array([1.0, -2.0, 0.5])
    moved = start.copy()
    moved[:3] = turn.apply(start[:3]) + shift
    moved[3:7] = np.roll(
        (turn * Rotation.from_quat(np.roll(start[3:7], -1))).as_quat(), 1
    )
    pose, chosen, _ = fitted(hand, start, points)
    again, other, _ = fitted(hand, moved, turn.apply(points) + shift)
    np.testing.assert_array_equal(other, chosen)
    np.testing.assert_allclose(again[7:], pose[7:], atol=1e-5)
    np.testing.assert_allclose(again[:3], turn.apply(pose[:3]) + shift, atol=1e-6)
