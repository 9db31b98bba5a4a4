"""Fingers that are bent wrongly, not found, or exchanged are put right."""

import numpy as np
import pytest

from handclean.labels.track.alternatives import (
    exchange_fingers,
    exchange_outer_markers,
    restart_finger,
    search_missing_fingers,
)
from handclean.labels.track.fit import (
    MISSING_COST,
    measure_fit,
    observe_points,
    solve_pose,
)
from handclean.labels.track.other_poses import align_rigidly, recover_pose

GATE_M = 0.1


def state_with(hand, pose, points, chosen):
    state = hand.state(pose)
    state.chosen[:] = chosen
    observe_points(points, state.chosen, state.observed, state.weight)
    return state


def bend(hand, pose, finger, share):
    """The pose with one finger's flexion at another share of its limits."""
    pose, tree = pose.copy(), hand.target.model.tree
    for d, name in enumerate(tree.hinges):
        if name.startswith(finger) and name.endswith("flexion"):
            pose[7 + d] = share * tree.limits[d, 1]
    return pose


def outer(hand, finger):
    """Markers of a finger, the outermost first."""
    rows = np.flatnonzero(hand.finger(finger))
    return rows[np.argsort(hand.tracker.rank[rows])]


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_the_outer_markers_of_two_fingers_are_exchanged(hand, depth):
    one, other = outer(hand, "index"), outer(hand, "middle")
    branch, rank = hand.tracker.branch, hand.tracker.rank
    rows, deep_enough = exchange_outer_markers(
        np.arange(hand.markers), branch[one[0]], branch[other[0]], depth, branch, rank
    )
    expected = np.arange(hand.markers)
    expected[one[:depth]], expected[other[:depth]] = other[:depth], one[:depth]
    np.testing.assert_array_equal(rows, expected)
    assert deep_enough


def test_no_finger_has_a_hundred_markers_to_exchange(hand):
    branch, rank = hand.tracker.branch, hand.tracker.rank
    assert not exchange_outer_markers(np.arange(hand.markers), 1, 2, 100, branch, rank)[
        1
    ]


def test_exchanged_fingers_are_exchanged_back(hand):
    pose = hand.pose(0.3)
    points = hand.points(pose)[0]
    chosen = np.arange(hand.markers)
    one, other = outer(hand, "index")[:2], outer(hand, "middle")[:2]
    chosen[one], chosen[other] = other, one
    wrong = pose.copy()
    state = state_with(hand, wrong, points, chosen)
    cost = solve_pose(wrong, hand.tracker.no_basis, state, hand.tracker).cost
    after = exchange_fingers(wrong, points, state, hand.tracker, cost)
    np.testing.assert_array_equal(state.chosen, np.arange(hand.markers))
    assert after < 1e-2 < cost
    np.testing.assert_allclose(hand.points(wrong)[0], points, atol=1e-4)


def test_fingers_that_fit_are_not_exchanged(hand):
    pose = hand.pose(0.3)
    points = hand.points(pose)[0]
    state = state_with(hand, pose, points, np.arange(hand.markers))
    assert exchange_fingers(pose, points, state, hand.tracker, 0.0) == 0.0
    np.testing.assert_array_equal(state.chosen, np.arange(hand.markers))


def test_a_finger_in_a_wrong_solution_is_restarted(hand):
    truth = bend(hand, hand.pose(0.2), "index", 0.75)
    points = hand.points(truth)[0]
    pose = bend(hand, truth, "index", 0.0)
    state = state_with(hand, pose, points, np.arange(hand.markers))
    fit = measure_fit(pose, state, hand.tracker)  # not solved for: poor
    branch = hand.tracker.branch[outer(hand, "index")[0]]
    after = restart_finger(pose, branch, fit, state, hand.tracker)
    assert after.cost < 0.1 < fit.cost
    np.testing.assert_allclose(hand.points(pose)[0], points, atol=1e-3)


def test_a_finger_that_fits_is_left_alone(hand):
    pose = hand.pose()
    points = hand.points(pose)[0]
    state = state_with(hand, pose, points, np.arange(hand.markers))
    before, fit = pose.copy(), measure_fit(pose, state, hand.tracker)
    assert restart_finger(pose, 1, fit, state, hand.tracker).cost == fit.cost
    np.testing.assert_array_equal(pose, before)


@pytest.mark.parametrize("missing", [2, 3])
def test_a_finger_far_from_where_it_was_gets_its_points(hand, missing):
    start = hand.pose(0.1)
    truth = bend(hand, start, "ring", 0.6)
    points = hand.points(truth)[0]
    chosen = np.arange(hand.markers)
    chosen[outer(hand, "ring")[:missing]] = -1
    pose = start.copy()
    state = state_with(hand, pose, points, chosen)
    cost = solve_pose(pose, hand.tracker.no_basis, state, hand.tracker).cost
    after = search_missing_fingers(pose, points, state, hand.tracker, GATE_M, cost)
    np.testing.assert_array_equal(state.chosen, np.arange(hand.markers))
    assert after < 0.1 < missing * MISSING_COST <= cost + 1e-3


def test_markers_that_nobody_sees_stay_without_points(hand):
    pose = hand.pose()
    few = outer(hand, "ring")[:2]
    points = np.delete(hand.points(pose)[0], few, axis=0)
    chosen = np.full(hand.markers, -1)
    chosen[np.setdiff1d(np.arange(hand.markers), few)] = np.arange(len(points))
    state = state_with(hand, pose, points, chosen)
    cost = 2 * MISSING_COST
    after = search_missing_fingers(pose, points, state, hand.tracker, GATE_M, cost)
    assert after == cost
    np.testing.assert_array_equal(state.chosen, chosen)


def test_a_stiff_hand_is_aligned_with_points_nearby(hand):
    truth, pose = hand.pose(0.3), hand.pose(0.3, (0.12, 0.19, 0.31))
    points = hand.points(truth)[0]
    align_rigidly(pose, points, hand.state(pose), hand.tracker, GATE_M)
    np.testing.assert_allclose(hand.points(pose)[0], points, atol=1e-4)


def test_a_hand_that_moved_on_is_found_again(hand):
    last = hand.pose(0.3)
    truth = hand.pose(0.35, (0.14, 0.16, 0.31))
    points = hand.points(truth)[0]
    state = hand.state(last)
    state.chosen[:] = -1
    cost = recover_pose(points, state, hand.tracker, GATE_M, 1e9)
    assert cost < 0.1
    np.testing.assert_array_equal(state.chosen, np.arange(hand.markers))
    np.testing.assert_allclose(hand.points(state.pose)[0], points, atol=1e-3)


def test_a_pose_that_fits_is_kept(hand):
    pose = hand.pose()
    points = hand.points(pose)[0]
    state = state_with(hand, pose, points, np.arange(hand.markers))
    state.last_pose[:] = hand.pose(0.5, (0.11, 0.2, 0.3))
    assert recover_pose(points, state, hand.tracker, GATE_M, 1e-9) == 1e-9
    np.testing.assert_array_equal(state.pose, pose)
